//! Lists of lamps (`.lp`) from reflectance transformation imaging: the number of lamps, then a line for each with
//! the name of its picture and its direction `x y z` (right, up, towards the camera).

use base::error::{Error, Result};
use base::files;
use glam::Vec3;
use std::path::Path;

/// Largest number of lamps in a list.
const MOST: usize = 100_000;

/// Names, without folder and extension, and unit directions of a list.
///
/// # Errors
/// When it cannot be read or is not a valid list.
pub fn read(path: &Path) -> Result<Vec<(String, Vec3)>> {
    const REMEDY: &str = "The first line is the number of lamps, each other line `name x y z`";
    let text =
        files::read_text(path, files::MOST_TEXT).map_err(|e| Error::io("open", path, e, REMEDY))?;
    parse(&text).map_err(|cause| Error::codec("read", path, cause, REMEDY))
}

fn parse(text: &str) -> std::result::Result<Vec<(String, Vec3)>, String> {
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let count: usize = (lines.next().and_then(|line| line.parse().ok()))
        .filter(|&count| (1..=MOST).contains(&count))
        .ok_or_else(|| format!("the first line is not a number from 1 to {MOST}"))?;
    let lamp = |line: &str| {
        // Names may contain spaces.
        let mut parts = line.rsplitn(4, [' ', '\t', ',']).map(str::trim);
        let mut number = || parts.next()?.parse::<f32>().ok();
        let (z, y, x) = (number()?, number()?, number()?);
        let name = parts.next()?.rsplit(['/', '\\']).next()?;
        let name = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
        let direction = Vec3::new(x, y, z).try_normalize()?;
        files::is_bare(name).then(|| (name.to_owned(), direction))
    };
    let lamps: Vec<_> = (lines
        .map(|line| lamp(line).ok_or_else(|| format!("{line:.80?} is not a lamp"))))
    .collect::<std::result::Result<_, _>>()?;
    if lamps.len() != count {
        return Err(format!("it declares {count} lamps and has {}", lamps.len()));
    }
    let mut names: Vec<&String> = lamps.iter().map(|(name, _)| name).collect();
    names.sort();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(format!("{} appears twice", pair[0])),
        None => Ok(lamps),
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
}
