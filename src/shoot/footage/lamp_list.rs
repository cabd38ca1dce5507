//! Lists of lamps (`.lp`) from reflectance transformation imaging: a line for each lamp with the name of its picture and
//! its direction `x y z` (right, up, towards the camera).
//!
//! Before them there may be their number and a line of headings. Columns are separated by blanks, tabs, semicolons
//! or commas; numbers have a decimal comma where no comma separates columns. Lines that begin with `#`, `//` or `;`
//! are comments. A line that can be read in two ways is refused.

use base::error::{Error, Result};
use base::files;
use glam::Vec3;
use std::path::Path;

/// Largest number of lamps in a list.
const MOST: usize = 100_000;
const REMEDY: &str = "Write a line `name x y z` for each lamp, its columns separated by tabs or semicolons";

/// Names, without folder and extension, and unit directions of a list.
///
/// # Errors
/// When it cannot be read or is not a valid list; the error gives the line.
pub fn read(path: &Path) -> Result<Vec<(String, Vec3)>> {
    let text = files::read_text(path, files::MOST_TEXT).map_err(|e| Error::io("open", path, e, REMEDY))?;
    parse(&text).map_err(|cause| Error::codec("read", path, cause, REMEDY))
}

fn parse(text: &str) -> std::result::Result<Vec<(String, Vec3)>, String> {
    let is_comment = |line: &str| ["#", "//", ";"].iter().any(|mark| line.starts_with(mark));
    let mut lines = (text.lines().map(str::trim).enumerate())
        .filter(|(_, line)| !line.is_empty() && !is_comment(line))
        // Spreadsheets fill short lines with empty columns.
        .map(|(number, line)| (number + 1, line.trim_end_matches([';', ',']).trim_end()))
        .peekable();
    let mut declared = None;
    if let Some((number, line)) = lines.next_if(|(_, line)| line.parse::<f64>().is_ok()) {
        let count = line.parse().ok().filter(|count| (1..=MOST).contains(count));
        let wrong = || format!("line {number}: {line} is not a number of lamps from 1 to {MOST}");
        declared = Some(count.ok_or_else(wrong)?);
    }
    lines.next_if(|(_, line)| is_heading(line));
    let mut lamps: Vec<(String, Vec3)> = Vec::new();
    for (number, line) in lines {
        lamps.push(lamp(line).map_err(|why| format!("line {number}: {line:.80?} {why}"))?);
        if lamps.len() > MOST {
            return Err(format!("line {number}: more lamps than {MOST}"));
        }
    }
    match declared {
        Some(count) if count != lamps.len() => {
            return Err(format!("it declares {count} lamps and has {}", lamps.len()));
        }
        None if lamps.is_empty() => {
            return Err("it has no line with a name and three numbers".to_owned());
        }
        _ => {}
    }
    let mut names: Vec<&String> = lamps.iter().map(|(name, _)| name).collect();
    names.sort();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(format!("{} appears twice", pair[0])),
        None => Ok(lamps),
    }
}

/// True for headings whose last three columns are x, y and z, such as `file;dir_x;dir_y;dir_z`. Other headings, such
/// as angles, are not directions.
fn is_heading(line: &str) -> bool {
    let words = line.split([' ', '\t', ';', ',']).map(|word| word.trim_matches('"'));
    let words: Vec<String> = words.filter(|word| !word.is_empty()).map(str::to_lowercase).collect();
    let axes = words.iter().rev().zip(["z", "y", "x"]);
    words.len() >= 3
        && axes
            .into_iter()
            .all(|(word, axis)| word.parse::<f32>().is_err() && (word.starts_with(axis) || word.ends_with(axis)))
}

/// Name and direction in a line.
///
/// # Errors
/// When it is not a lamp, or can be read in two ways.
fn lamp(line: &str) -> std::result::Result<(String, Vec3), String> {
    let (name, columns) = columns(line)?;
    let decimal_comma = columns.iter().any(|column| column.contains(','));
    if decimal_comma && columns.iter().any(|column| column.contains('.')) {
        return Err("has decimal points and commas".to_owned());
    }
    let wrong = || "is not a lamp".to_owned();
    let number = |column: &str| number(column).ok_or_else(wrong);
    let [x, y, z] = columns;
    let direction = Vec3::new(number(x)?, number(y)?, number(z)?).try_normalize();
    let name = name.trim_matches('"').rsplit(['/', '\\']).next().unwrap_or_default();
    let name = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    match direction {
        Some(direction) if files::is_bare(name) => Ok((name.to_owned(), direction)),
        _ => Err(wrong()),
    }
}

/// A line's name and the three columns of its direction.
///
/// # Errors
/// When its columns are not four, or their separators are unclear.
fn columns(line: &str) -> std::result::Result<(&str, [&str; 3]), String> {
    let split = |mark: char| -> Vec<&str> { line.split(mark).map(str::trim).collect() };
    let counted = |count: usize| match count {
        0..4 => "is not a lamp".to_owned(),
        count => format!("has {count} columns instead of 4"),
    };
    if line.contains(';') {
        return match split(';')[..] {
            [name, x, y, z] => Ok((name, [x, y, z])),
            ref columns => Err(counted(columns.len())),
        };
    }
    let are_numbers = |columns: &[&str; 3]| columns.iter().all(|column| number(column).is_some());
    let last_blank = |text: &str| text.rfind(char::is_whitespace);
    // Columns may be aligned by several tabs.
    let tabs: Vec<&str> = split('\t').into_iter().filter(|column| !column.is_empty()).collect();
    let commas = split(',');
    let by_tabs = match tabs[..] {
        [name, x, y, z] => Some((name, [x, y, z])),
        [_, _, _, _, ..] if !line.contains(' ') => return Err(counted(tabs.len())),
        _ => None,
    };
    let by_commas = match commas[..] {
        [name, x, y, z] => Some((name, [x, y, z])),
        [start, y, z] => last_blank(start).map(|at| {
            let (name, x) = start.split_at(at);
            (name.trim_end(), [x.trim_start(), y, z])
        }),
        _ => None,
    };
    let mut found = by_tabs.into_iter().chain(by_commas);
    if let Some(found) = found.find(|(_, columns)| are_numbers(columns)) {
        return Ok(found);
    }
    let (mut name, mut columns) = (line, [""; 3]);
    for column in columns.iter_mut().rev() {
        let at = last_blank(name).ok_or_else(|| counted(commas.len()))?;
        *column = name[at..].trim_start();
        name = name[..at].trim_end();
    }
    if !are_numbers(&columns) {
        return Err(counted(commas.len()));
    }
    // Names may contain blanks and numbers, but a number after a file's name is a fifth column.
    if let Some((file, last)) = name.rsplit_once(char::is_whitespace)
        && number(last).is_some()
        && (last.contains(['.', ',']) || file.contains('.'))
    {
        return Err(counted(5));
    }
    Ok((name.trim_end_matches(','), columns))
}

/// A number with a decimal point, or a comma between digits.
fn number(text: &str) -> Option<f32> {
    let text = text.trim_matches('"').replace('\u{2212}', "-");
    match text.split_once(',') {
        None => text.parse().ok(),
        Some((whole, fraction)) => {
            let is_digit = |letter: Option<char>| letter.is_some_and(|l| l.is_ascii_digit());
            let is_decimal =
                is_digit(whole.chars().next_back()) && is_digit(fraction.chars().next()) && !fraction.contains(',');
            is_decimal.then(|| format!("{whole}.{fraction}").parse().ok())?
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_lamps_is_read_and_a_wrong_one_is_refused() {
        let lamps = parse("2\r\nC:\\dome\\key light.jpg 0 0 2\n\nrim.tif\t-1.0 0.5 0\n").unwrap();
        assert_eq!(lamps[0], ("key light".to_owned(), Vec3::Z));
        assert_eq!(lamps[1].0, "rim");
        assert!((lamps[1].1.length() - 1.0).abs() < 1e-6);
        for (text, says) in [
            ("", "number"),
            ("1e9\n", "number"),
            ("2\na 0 0 1\n", "declares 2 lamps and has 1"),
            ("1\na 0 0 0\n", "not a lamp"),
            ("1\na 0 NaN 1\n", "not a lamp"),
            ("1\n.. 0 0 1\n", "not a lamp"),
            ("2\na.jpg 0 0 1\na.png 0 1 0\n", "twice"),
        ] {
            let said = parse(text).unwrap_err();
            assert!(said.contains(says), "{text:?}: {said}");
        }
    }

    #[test]
    fn lists_of_any_tool_and_country_are_one_list() {
        let expected = [("a", Vec3::new(0.6, -0.8, 0.0)), ("key 2", Vec3::new(0.0, 0.5, 0.5))];
        for text in [
            "2\na.jpg 0.6 -0.8 0\nkey 2.jpg 0 0.5 0.5\n",
            // Aligned by blanks.
            "a.jpg       0.6   -0.8    0.0\nkey 2.jpg   0.0    0.5    0.5   \n",
            "# dome of May\n// north is up\n; by hand\n\n  2\nname x y z\na.jpg 0.6 -0.8 0\nkey 2.jpg 0 .5 .5",
            "file;dir_x;dir_y;dir_z\na.jpg;0.6;-0.8;0\nkey 2.jpg;0;0.5;0.5",
            "2;;;\n\"File\";\"X\";\"Y\";\"Z\"\n\"a.jpg\";\"0,6\";\"-0,8\";\"0\"\nkey 2.jpg; 0 ; 0,5 ; 0,5 ;\n",
            "name\tLx\tLy\tLz\na.jpg\t0,6\t-0,8\t0\nkey 2.jpg\t\t0\t\t0,5\t\t0,5\n",
            "a.jpg 0,6 -0,8 0\nkey 2.jpg   0,0 0,5 0,5\n",
            "2,,,\nname,x,y,z\na.jpg,0.6,-0.8,0\nkey 2.jpg, 0, 0.5, 0.5\n",
            "a.jpg 0.6,-0.8,0\nkey 2.jpg 0, 0.5, 0.5\n",
            "a, 0.6 \u{2212}0.8 0\n/scans/key 2.jpg, 0e0 5e-1 5e-1\n",
            "a\t0.6 -0.8 0\nkey 2\t0 0.5 0.5\n",
        ] {
            let lamps = parse(text).unwrap_or_else(|said| panic!("{text:?}: {said}"));
            assert_eq!(lamps.len(), 2, "{text:?}");
            for ((name, direction), (wanted, along)) in lamps.iter().zip(expected) {
                assert_eq!(name, wanted, "{text:?}");
                assert!(direction.distance(along.normalize()) < 1e-6, "{text:?}: {direction}");
            }
        }
        test_support::shown!(
            Strangers,
            "A list of lamps with other separators, decimal commas, headings, comments or no count",
            done: "what has one meaning is read; any other line is refused with its number",
        );
    }

    #[test]
    fn a_line_with_two_meanings_is_refused() {
        for (line, says) in [
            ("a.jpg,0,6,-0,8,0,0", "7 columns"),
            ("a.jpg,0,6,-0,8,0", "6 columns"),
            ("a.jpg 0,1 1", "not a lamp"),
            ("a.jpg,0,1 0,2 0,9", "columns"),
            ("a.jpg 0.5 0,5 0", "points and commas"),
            ("a.jpg;0.5;0,5;0", "points and commas"),
            ("a.jpg;0;0;1;0.8", "5 columns"),
            ("a.jpg\t0\t0\t1\t0.8", "5 columns"),
            ("a.jpg,0,0,1,0.8", "5 columns"),
            ("a.jpg 0 0 1 0.8", "5 columns"),
            ("a 0.1 0 1 0", "5 columns"),
            ("a;0,1,2;0;1", "not a lamp"),
            ("a.jpg 1.000,5 0 0", "not a lamp"),
            ("name azimuth elevation distance", "not a lamp"),
            ("name z y x", "not a lamp"),
            ("x y z", "not a lamp"),
        ] {
            let said = parse(&format!("# dome\nb.jpg 0 0 1\n{line}\n")).unwrap_err();
            assert!(said.contains(says) && said.contains("line 3"), "{line:?}: {said}");
        }
        assert!(parse("name azimuth elevation\na 0 0 1").is_err());
    }
}
