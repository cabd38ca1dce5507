//! Destination of an export, as the user types it: `out.%04d.png`, `look.exr`, `clip.mp4`.

use super::codec::Container;
use base::FileFormat;
use base::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::iter;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A destination for one picture or many. Shown and stored as it was typed.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Destination {
    /// One file per frame: PNG or TIFF for a display, or EXR in linear light.
    Stills(Stills),
    /// One movie: `.mp4`, `.mov`, `.mkv` or `.mxf`.
    Clip(PathBuf),
}

/// Files of stills: one path, or a pattern with the frame number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stills {
    /// As typed.
    text: String,
    before: String,
    /// Least number of digits, if the path has a number.
    digits: Option<usize>,
    after: String,
}

impl Destination {
    /// Reads a path by its extension. A number is written as in printf: `%d`, or `%04d` for at least
    /// four digits with leading zeros; `%%` is a percent sign. In a name without such a number `####` is one.
    ///
    /// # Errors
    /// When the extension is unknown, or the pattern is invalid.
    pub fn parse(text: &str) -> Result<Self> {
        if Container::from_path(Path::new(text)).is_some() {
            return Ok(Self::Clip(PathBuf::from(text)));
        }
        let extension = Path::new(text).extension().unwrap_or_default().to_ascii_lowercase();
        match FileFormat::from_path(Path::new(text)) {
            Some(format) if format.is_still() => Ok(Self::Stills(Stills::parse(text)?)),
            _ => Err(Error::invalid(
                if extension.is_empty() {
                    format!("the destination {text} has no extension")
                } else {
                    format!("cannot write {text}: .{} is not a format that Afterlight writes", extension.display())
                },
                "Give a name that ends in .png, .tif, .exr, .mp4, .mov, .mkv or .mxf, such as out.%04d.png or clip.mp4",
            )),
        }
    }

    /// True for files of linear light.
    pub fn is_linear(&self) -> bool {
        matches!(self, Self::Stills(stills) if stills.format() == Some(FileFormat::OpenExr))
    }

    /// Files with the numbers `first` to `last`, in order.
    pub fn files(&self, first: i64, last: i64) -> impl Iterator<Item = PathBuf> + '_ {
        let one = match self {
            Self::Clip(_) => true,
            Self::Stills(stills) => stills.digits.is_none(),
        };
        let numbers = first..=if one { first } else { last };
        numbers.map(move |number| match self {
            Self::Clip(path) => path.clone(),
            Self::Stills(stills) => stills.path(number),
        })
    }

    /// Number of existing files with the numbers `first` to `last`.
    pub fn taken(&self, first: i64, last: i64) -> usize {
        self.files(first, last).filter(|file| file.exists()).count()
    }

    /// Refuses several frames for a single file.
    ///
    /// # Errors
    /// When the destination is one file; the remedy shows a pattern.
    pub fn check_frames(&self, frames: usize) -> Result<()> {
        match self {
            Self::Stills(stills) if stills.digits.is_none() && frames > 1 => Err(Error::invalid(
                format!(
                    "the destination {} is a single file, but the export has {frames} frames",
                    stills.path(0).display()
                ),
                "Put a number into the name, such as out.%04d.png, or write a movie, such as clip.mp4",
            )),
            _ => Ok(()),
        }
    }

    /// This destination, or the first with `_2`, `_3` … appended to the name under which no file with the numbers
    /// `first` to `last` exists yet.
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn untaken(&self, first: i64, last: i64) -> Result<Self> {
        let mut free = self.clone();
        let mut number = 1;
        while free.taken(first, last) > 0 {
            number += 1;
            free = Self::parse(&numbered(&self.to_string(), number))?;
        }
        Ok(free)
    }

    /// Destinations that [`Self::untaken`] tries, in order, starting at `free`; empty if it is not among the first
    /// million.
    pub fn numbered_from(&self, free: &Self) -> impl Iterator<Item = Self> {
        let number = move |number| Self::parse(&numbered(&self.to_string(), number)).ok();
        let all = iter::once(self.clone()).chain((2..=1_000_000).filter_map(number));
        all.skip_while(move |tried| tried != free)
    }
}

/// Names no file.
impl Default for Destination {
    fn default() -> Self {
        Self::Stills(Stills::default())
    }
}

impl fmt::Display for Destination {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Stills(stills) => f.write_str(&stills.text),
            Self::Clip(path) => write!(f, "{}", path.display()),
        }
    }
}

/// As in the provenance of files, which holds a hash of this.
impl fmt::Debug for Destination {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:?}", self.to_string())
    }
}

impl From<Destination> for String {
    fn from(destination: Destination) -> Self {
        destination.to_string()
    }
}

impl TryFrom<String> for Destination {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        Self::parse(&text)
    }
}

/// Destination `text` with a number appended to its name, before the frame number.
fn numbered(text: &str, number: usize) -> String {
    let start = text.rfind(std::path::is_separator).map_or(0, |at| at + 1);
    let (folder, name) = text.split_at(start);
    // A literal percent sign does not end the name.
    let pattern = name.replace("%%", "  ").find('%').or_else(|| Some(hashes(name)?.start));
    let end = pattern.or_else(|| name.rfind('.')).unwrap_or(name.len());
    let (stem, rest) = name.split_at(end);
    let kept = stem.trim_end_matches(['.', '_', '-']);
    let gap = match &stem[kept.len()..] {
        "" if pattern.is_some() => "_",
        gap => gap,
    };
    if kept.is_empty() { format!("{folder}{number}{gap}{rest}") } else { format!("{folder}{kept}_{number}{gap}{rest}") }
}

/// Place of the last run of two or more `#` in a file's name.
fn hashes(name: &str) -> Option<Range<usize>> {
    let start = name.rfind("##")?;
    let start = name[..start].trim_end_matches('#').len();
    let end = name.len() - name[start..].trim_start_matches('#').len();
    Some(start..end)
}

impl Stills {
    /// File with the number `number`.
    pub fn path(&self, number: i64) -> PathBuf {
        let number = self.digits.map_or(String::new(), |digits| format!("{number:0digits$}"));
        PathBuf::from(format!("{}{number}{}", self.before, self.after))
    }

    /// Text before the frame number, its least number of digits, and the text after it. Without a number the first text is the
    /// whole path.
    pub fn parts(&self) -> (&str, Option<usize>, &str) {
        (&self.before, self.digits, &self.after)
    }

    /// Format of the files.
    pub fn format(&self) -> Option<FileFormat> {
        FileFormat::from_path(&self.path(0))
    }

    fn parse(text: &str) -> Result<Self> {
        let wrong = |found: String| {
            Error::invalid(
                format!("the destination {text} has {found}; a name may have one number, written %d, %04d or ####"),
                "Write for example out.%04d.png; a percent sign itself is %%",
            )
        };
        let mut stills = Self { text: text.to_owned(), ..Self::default() };
        let mut rest = text;
        while let Some((literal, conversion)) = rest.split_once('%') {
            stills.current().push_str(literal);
            if let Some(next) = conversion.strip_prefix('%') {
                stills.current().push('%');
                rest = next;
                continue;
            }
            let digits = conversion.find(|c: char| !c.is_ascii_digit()).unwrap_or(conversion.len());
            let (width, next) = conversion.split_at(digits);
            rest = next.strip_prefix('d').ok_or_else(|| wrong(format!("%{conversion}")))?;
            if stills.digits.is_some() {
                return Err(wrong("two numbers".to_owned()));
            }
            let width = if width.is_empty() { Ok(1) } else { width.parse() };
            // No file system takes longer names.
            stills.digits = Some(width.ok().filter(|w| *w <= 20).ok_or_else(|| wrong(format!("%{conversion}")))?);
        }
        stills.current().push_str(rest);
        if stills.digits.is_none() {
            let name = stills.before.rfind(std::path::is_separator).map_or(0, |at| at + 1);
            if let Some(number) = hashes(&stills.before[name..]) {
                stills.digits = Some(number.len());
                stills.after = stills.before.split_off(name + number.end);
                stills.before.truncate(name + number.start);
            }
        }
        Ok(stills)
    }

    /// Part of the path under the parser.
    fn current(&mut self) -> &mut String {
        if self.digits.is_some() { &mut self.after } else { &mut self.before }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(text: &str, frame: i64) -> String {
        match Destination::parse(text).unwrap() {
            Destination::Stills(stills) => stills.path(frame).display().to_string(),
            Destination::Clip(path) => panic!("{} is a clip", path.display()),
        }
    }

    #[test]
    fn numbers_are_written_like_printf() {
        assert_eq!(path("out.%04d.png", 7), "out.0007.png");
        assert_eq!(path("a/%d/b.exr", 12), "a/12/b.exr");
        assert_eq!(path("%3d.png", 1234), "1234.png");
        assert_eq!(path("100%%_%02d.png", 5), "100%_05.png");
        assert_eq!(path("one.png", 5), "one.png");
        assert_eq!(path("out.%04d.png", -7), "out.-007.png");
        assert_eq!(path("out.%d.png", -12), "out.-12.png");
        assert_eq!(path("a##/out.####.png", 1001), "a##/out.1001.png");
        assert_eq!(path("100%%_###_v2.exr", -7), "100%_-07_v2.exr");
        assert_eq!(path("take #2.png", 5), "take #2.png");
        assert_eq!(path("##.%d.png", 5), "##.5.png");
    }

    #[test]
    fn the_extension_decides_what_is_made() {
        for (text, is_linear) in [("a.PNG", false), ("a.%d.EXR", true), ("one.exr", true), ("x.mov", false)] {
            assert_eq!(Destination::parse(text).unwrap().is_linear(), is_linear, "{text}");
        }
        for (text, is_tiff) in [("a.tif", true), ("a.%04d.TIFF", true), ("a.tif/%d.png", false)] {
            let Destination::Stills(stills) = Destination::parse(text).unwrap() else { panic!() };
            assert_eq!(stills.format() == Some(FileFormat::Tiff), is_tiff, "{text}");
        }
        assert_eq!(Destination::parse("x.mov").unwrap(), Destination::Clip("x.mov".into()));
    }

    #[test]
    fn what_was_typed_is_shown_and_stored() {
        for text in ["100%%.####.png", "out.%d.exr", "out.%1d.exr", "é/clip.mov"] {
            let destination = Destination::parse(text).unwrap();
            assert_eq!(destination.to_string(), text);
            let stored = serde_json::to_string(&destination).unwrap();
            assert_eq!(stored, format!("{text:?}"));
            assert_eq!(serde_json::from_str::<Destination>(&stored).unwrap(), destination);
        }
        assert!(serde_json::from_str::<Destination>("\"clip.avi\"").is_err());
    }

    #[test]
    fn what_is_not_understood_is_refused_with_an_example() {
        for text in ["clip", "clip.avi", "%s.png", "%04d_%d.png", "50%.png", "%99d.png", "%99999999999999999999d.png"] {
            let error = Destination::parse(text).unwrap_err().to_string();
            assert!(error.contains("%04d"), "{error}");
        }
    }

    #[test]
    fn a_name_that_is_taken_gets_a_number() {
        for (text, wanted) in [
            ("a/clip.mp4", "a/clip_2.mp4"),
            ("a.b/shot.%04d.exr", "a.b/shot_2.%04d.exr"),
            ("%04d.png", "2_%04d.png"),
            ("a/100%%_%d.png", "a/100%%_2_%d.png"),
            ("a/%d/b.exr", "a/%d/b_2.exr"),
            ("shot%d.png", "shot_2_%d.png"),
            ("a##/shot.####.png", "a##/shot_2.####.png"),
        ] {
            assert_eq!(numbered(text, 2), wanted);
        }
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name).display().to_string();
        let untaken = |name: &str, last| {
            let destination = Destination::parse(&at(name)).unwrap();
            destination.untaken(0, last).unwrap().to_string()
        };
        let name = "shot.%02d.png";
        assert_eq!(untaken(name, 9), at(name));
        for taken in ["shot.07.png", "shot_2.09.png"] {
            std::fs::write(folder.path().join(taken), "").unwrap();
        }
        let destination = Destination::parse(&at(name)).unwrap();
        assert_eq!((destination.taken(0, 9), destination.taken(0, 6)), (1, 0));
        assert_eq!(untaken(name, 9), at("shot_3.%02d.png"));
        assert_eq!(untaken(name, 6), at(name));
        std::fs::write(folder.path().join("clip.mov"), "").unwrap();
        assert_eq!(untaken("clip.mov", 9), at("clip_2.mov"));
    }

    #[test]
    fn several_frames_need_a_number_or_a_movie() {
        let check = |text: &str, frames| Destination::parse(text).unwrap().check_frames(frames);
        assert!(check("a.png", 1).is_ok() && check("a.%d.png", 9).is_ok() && check("a.mp4", 9).is_ok());
        assert!(check("a.png", 2).unwrap_err().to_string().contains("2 frames"));
    }
}
