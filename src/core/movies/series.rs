//! The one series of numbered pictures in a folder, apart from strays and from a second series.

use super::sequence::{NumberedName, Pattern, gaps, pictures, split};
use base::error::{Error, Result};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Maximum number of spans, names or series in a sentence.
const MOST_NAMED: usize = 8;

/// Pictures of a folder that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Pattern of the names, such as `shot.%04d.exr`; `None` if their numbers are not frame numbers.
    pub pattern: Option<String>,
    /// Names, in natural order.
    pub names: Vec<Box<str>>,
    /// Missing numbers of the series.
    pub missing: Vec<RangeInclusive<u64>>,
    /// Pictures that are not part of the series.
    pub left_out: Vec<Box<str>>,
    folder: PathBuf,
}

/// Series that a picture belongs to.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum SeriesKey {
    /// A picture without a number, by its place in the folder.
    Alone(usize),
    /// Numbered pictures, by the lower-case names before and after the number.
    Numbered(String, String),
}

impl Series {
    /// Finds the series in a folder. Pictures beside it are left out if they are fewer; without a series, all pictures
    /// of the folder count.
    ///
    /// # Errors
    /// When the folder cannot be read, or holds two or more series: the error names them.
    pub fn find(folder: &Path) -> Result<Self> {
        let all = pictures(folder)?;
        let mut groups: BTreeMap<SeriesKey, Vec<&Box<str>>> = BTreeMap::new();
        for (place, name) in all.iter().enumerate() {
            let key = match split(name) {
                Some(NumberedName { before, after, .. }) => {
                    // The sign of a number below 0.
                    let unsigned = before.strip_suffix('-').unwrap_or(before);
                    let is_sign = unsigned.is_empty() || unsigned.ends_with(['.', '_']);
                    let before = if is_sign { unsigned } else { before };
                    SeriesKey::Numbered(before.to_lowercase(), after.to_lowercase())
                }
                None => SeriesKey::Alone(place),
            };
            groups.entry(key).or_default().push(name);
        }
        let mut series: Vec<_> = groups.into_values().filter(|names| names.len() > 1).collect();
        if series.len() > 1 {
            let shown = series
                .iter()
                .take(MOST_NAMED)
                .map(|names| format!("{} ({} pictures)", with_hashes(names[0]), names.len()));
            return Err(Error::invalid(
                format!(
                    "{} has more than one series of pictures: {}",
                    folder.display(),
                    shown.collect::<Vec<_>>().join(", ")
                ),
                "Keep one of them in the folder, or name one by its pattern, such as shot.%04d.exr, in a TOML map: \
                 docs/movies.md",
            ));
        }
        let folder = folder.to_path_buf();
        let names = series.pop().filter(|names| 2 * names.len() > all.len());
        let Some(names) = names.map(|names| names.into_iter().cloned().collect::<Vec<_>>()) else {
            return Ok(Self { names: all, folder, ..Self::default() });
        };
        let left_out = all.iter().filter(|name| !names.contains(name)).cloned().collect();
        let (pattern, missing) = pattern(&names).unzip();
        let missing: Vec<RangeInclusive<u64>> = missing.unwrap_or_default();
        // Times and steps are numbers with more gaps than pictures.
        let count: u64 = missing.iter().map(|gap| gap.end() - gap.start() + 1).sum();
        let pattern = pattern.filter(|_| count <= names.len() as u64);
        Ok(Self { pattern, names, missing, left_out, folder })
    }

    /// Address for [`open`](super::open): the pattern of the files, otherwise the folder.
    pub fn path(&self) -> PathBuf {
        match &self.pattern {
            Some(pattern) => self.folder.join(pattern),
            None => self.folder.clone(),
        }
    }

    /// Names, and in the place of each missing picture the name that it would have.
    pub fn with_missing(&self) -> Vec<String> {
        let pattern = self.pattern.as_deref().and_then(Pattern::from_name);
        let Some(pattern) = pattern else { return self.names.iter().map(ToString::to_string).collect() };
        let mut gaps = self.missing.iter().cloned().peekable();
        let mut names = Vec::new();
        for name in &self.names {
            let number = pattern.number(name);
            while let Some(gap) = gaps.next_if(|gap| number.is_some_and(|number| *gap.end() < number)) {
                names.extend(gap.map(|missing| pattern.name(missing)));
            }
            names.push(name.to_string());
        }
        names
    }

    /// Sentence on the pictures that are left out; `None` without any.
    pub fn left_out_note(&self) -> Option<String> {
        let first = self.names.first().filter(|_| !self.left_out.is_empty())?;
        let verb = if self.left_out.len() == 1 { "is" } else { "are" };
        Some(format!(
            "{} {verb} left out of {}: not part of {}",
            listed(&self.left_out),
            self.folder.display(),
            with_hashes(first)
        ))
    }

    /// Sentence on the missing numbers; `None` without any.
    pub fn missing_note(&self) -> Option<String> {
        let first = self.names.first().filter(|_| !self.missing.is_empty())?;
        let effect = match &self.pattern {
            Some(_) => "each is a damaged frame",
            None => "the pictures are taken one after the other",
        };
        let path = self.folder.join(with_hashes(first));
        Some(format!("{}: {effect}", missing_words(&self.missing, path.display())))
    }
}

/// "Pictures 3, 5–7 of `place` are missing".
pub(super) fn missing_words(missing: &[RangeInclusive<u64>], place: impl Display) -> String {
    let span = |span: &RangeInclusive<u64>| {
        if span.start() == span.end() { span.start().to_string() } else { format!("{}–{}", span.start(), span.end()) }
    };
    let spans: Vec<String> = missing.iter().map(span).collect();
    match missing {
        [one] if one.start() == one.end() => format!("Picture {} of {place} is missing", spans[0]),
        _ => format!("Pictures {} of {place} are missing", listed(&spans)),
    }
}

/// The first words, and the number of others.
pub fn listed<T: AsRef<str>>(words: &[T]) -> String {
    let shown: Vec<&str> = words.iter().take(MOST_NAMED).map(AsRef::as_ref).collect();
    match words.len().saturating_sub(MOST_NAMED) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// A name with `#` for each digit of its number.
fn with_hashes(name: &str) -> String {
    match split(name) {
        Some(NumberedName { before, digits, after }) => {
            format!("{before}{}{after}", "#".repeat(digits.len()))
        }
        None => name.to_owned(),
    }
}

/// Pattern of a series in natural order, and its missing numbers; `None` if no pattern names all files.
fn pattern(names: &[Box<str>]) -> Option<(String, Vec<RangeInclusive<u64>>)> {
    let NumberedName { before, digits, after } = split(names.first()?)?;
    let text = format!("{before}%0{}d{after}", digits.len());
    let is_plain = !before.contains(['%', '#']) && digits.len() <= 18;
    let pattern = Pattern::from_name(&text).filter(|_| is_plain)?;
    let numbers: Vec<u64> = names.iter().map(|name| pattern.number(name)).collect::<Option<_>>()?;
    let rises = numbers.windows(2).all(|pair| pair[0] < pair[1]);
    rises.then(|| (text, gaps(&numbers)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(names: &[&str]) -> Result<Series> {
        let folder = tempfile::tempdir().unwrap();
        for name in names {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        Series::find(folder.path())
    }

    #[test]
    fn a_series_is_found_with_its_gaps_and_without_strays() {
        for (names, pattern, missing, left_out) in [
            (&["a.0098.exr", "a.0099.exr", "a.0100.exr"][..], Some("a.%04d.exr"), "", ""),
            (&["9.png", "10.png", "12.png"], Some("%01d.png"), "11", ""),
            (&["f_1.jpg", "f_2.jpg", "f_5.jpg", "f_6.jpg"], Some("f_%01d.jpg"), "3–4", ""),
            (&["a.0001.exr", "A.0002.EXR", "thumb.png"], Some("a.%04d.exr"), "", "thumb.png"),
            (&["s_8_main.tif", "s_9_main.tif", "s_10_main.tif"], Some("s_%01d_main.tif"), "", ""),
            // Mixed padding, steps, times, and numbers below 0 are no pattern.
            (&["f_1.png", "f_02.png", "f_3.png"], None, "", ""),
            (&["f_10.png", "f_20.png", "f_30.png"], None, "11–19, 21–29", ""),
            (&["s.-1.exr", "s.0.exr", "s.1.exr"], None, "", ""),
            (&["back.png", "front.png", "left.png"], None, "", ""),
            (&["a1.png", "a2.png", "key.png", "rim.png"], None, "", ""),
            (&["._a1.png", ".a2.png", "Thumbs.db", "a1.png"], None, "", ""),
        ] {
            let found = find(names).unwrap();
            assert_eq!(found.pattern.as_deref(), pattern, "{names:?}");
            let note = found.missing_note().unwrap_or_default();
            let says = |gap: &str| note.contains(&format!(" {gap} of "));
            assert!(if missing.is_empty() { note.is_empty() } else { says(missing) }, "{note}");
            assert_eq!(found.left_out.join(" "), left_out, "{names:?}");
            assert_eq!(found.left_out_note().is_some(), !left_out.is_empty());
            let kept = names.iter().filter(|name| !base::files::is_clutter(name)).count();
            assert_eq!(found.names.len() + found.left_out.len(), kept);
        }
        let gap = find(&["9.png", "10.png", "13.png"]).unwrap();
        assert_eq!(gap.with_missing(), ["9.png", "10.png", "11.png", "12.png", "13.png"]);
    }

    #[test]
    fn two_series_are_refused_by_their_names() {
        for names in [
            ["shot.001.exr", "shot.002.exr", "shot.001.jpg", "shot.002.jpg"],
            ["a_1.png", "a_2.png", "b_1.png", "b_2.png"],
        ] {
            let said = find(&names).unwrap_err().to_string();
            let [one, other] = [names[0], names[2]].map(with_hashes);
            assert!(said.contains(&one) && said.contains(&other), "{said}");
            assert!(said.contains("pattern"), "{said}");
        }
    }
}
