//! A sequence of pictures: files whose names differ by a number, or all pictures of a folder.

use super::process::Tools;
use super::raw::{raw, raw_program};
use super::{Movie, Pixels};
use base::FileFormat;
use base::error::{Error, Result};
use base::files::{self, sorted_names};
use imaging::file::{self, Codes};
use imaging::picture::{self, About, Picture};
use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

/// A sequence of pictures. Holds names or numbers, not pixels.
#[derive(Debug)]
pub struct Sequence {
    /// The address, and its folder's time of change when the files were listed.
    listed: (PathBuf, Option<SystemTime>),
    folder: PathBuf,
    names: Names,
    size: (usize, usize),
    has_alpha: bool,
    tools: Tools,
}

#[derive(Debug, PartialEq)]
enum Names {
    /// Names with a number between two texts, with a minimum number of digits; all numbers, sorted.
    Numbered {
        pattern: Pattern,
        numbers: Vec<u64>,
        /// Names in other letters than the pattern's, such as `SHOT.0002.EXR`.
        others: HashMap<u64, Box<str>>,
        /// Number of files with a number below 0: they are not part of the sequence.
        negative: usize,
    },
    /// All pictures of a folder, in natural order; frames are counted from 0.
    All(Vec<Box<str>>),
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pattern {
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    /// The pattern of a name like `shot.%04d.exr` or `shot.####.exr`.
    pub fn from_name(name: &str) -> Option<Self> {
        if let Some((before, rest)) = name.split_once('%') {
            let (digits, after) = rest.split_once('d')?;
            let is_count = digits.bytes().all(|b| b.is_ascii_digit()) && digits.len() <= 3;
            let digits = digits.parse().unwrap_or(1).clamp(1, 20);
            return is_count.then(|| Self { before: before.to_owned(), digits, after: after.to_owned() });
        }
        let start = name.find('#')?;
        let after = name[start..].trim_start_matches('#');
        Some(Self {
            before: name[..start].to_owned(),
            digits: name.len() - start - after.len(),
            after: after.to_owned(),
        })
    }

    /// The name of a number.
    pub fn name(&self, number: u64) -> String {
        let digits = self.digits;
        format!("{}{number:0digits$}{}", self.before, self.after)
    }

    /// The text in the number's place of a name that matches the pattern in letters of any case.
    fn between<'a>(&self, name: &'a str) -> Option<&'a str> {
        let (before, after) = (self.before.len(), self.after.len());
        let end = name.len().checked_sub(after).filter(|&end| end > before)?;
        let (start, rest) = (name.get(..before)?, name.get(end..)?);
        let is_same = start.eq_ignore_ascii_case(&self.before) && rest.eq_ignore_ascii_case(&self.after);
        name.get(before..end).filter(|_| is_same)
    }

    /// The number in a name that matches the pattern in letters of any case.
    pub fn number(&self, name: &str) -> Option<u64> {
        let number = self.between(name)?.parse().ok()?;
        self.name(number).eq_ignore_ascii_case(name).then_some(number)
    }

    /// True if a name matches the pattern with a number below 0.
    fn is_negative(&self, name: &str) -> bool {
        let is_sign = self.before.is_empty() || self.before.ends_with(['.', '_']);
        let digits = self.between(name).and_then(|text| text.strip_prefix('-'));
        is_sign && digits.is_some_and(|digits| digits.parse::<u64>().is_ok_and(|number| number > 0))
    }
}

/// True if a name has a picture's extension.
fn is_picture(name: &str) -> bool {
    !files::is_clutter(name) && FileFormat::from_path(Path::new(name)).is_some_and(FileFormat::is_sequence)
}

/// True if an address is a sequence: a pattern, a folder, or one of its files.
pub(crate) fn is_sequence(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.is_dir() || is_picture(&name)
}

impl Sequence {
    /// The pattern of the sequence whose first file is `path`, and that file's number; `None` if its name has no number.
    pub fn pattern_from_first(path: &Path) -> Option<(PathBuf, u64)> {
        let name = path.file_name()?.to_str()?;
        if Pattern::from_name(name).is_some() && !path.is_file() {
            return None;
        }
        let NumberedName { before, digits, after } = split(name)?;
        let (number, digits) = (digits.parse().ok()?, digits.len());
        let pattern = format!("{before}%0{digits}d{after}");
        (digits <= 18).then(|| (path.with_file_name(pattern), number))
    }

    /// Opens a sequence: lists its files and reads the header of the first one.
    ///
    /// # Errors
    /// When there are no files, or the first cannot be read.
    pub fn open(path: &Path, tools: &Tools) -> Result<Self> {
        let (folder, names) = list(path)?;
        let mut sequence = Self {
            listed: (path.to_path_buf(), changed(&folder)),
            folder,
            names,
            size: (0, 0),
            has_alpha: false,
            tools: Tools { cache: None, ..tools.clone() },
        };
        let first = sequence.first();
        let Some(first) = first else {
            if sequence.negative() > 0 {
                return Err(Error::missing(
                    format!("all numbers of {} are below 0", path.display()),
                    "Name the folder of the pictures: their frames are then counted from 0",
                ));
            }
            if let Some((file, program)) = raw_in(path) {
                return Err(raw(&file, program));
            }
            return Err(Error::missing(
                format!("there is no picture {}", path.display()),
                "Name a folder of pictures, one of them, or a pattern such as shot.%04d.exr",
            ));
        };
        let pixels = sequence.frame(first)?;
        (sequence.size, sequence.has_alpha) = (pixels.size, pixels.has_alpha);
        Ok(sequence)
    }

    /// True if the same files are there as when they were listed.
    pub(crate) fn is_current(&self) -> bool {
        let (path, changed_at) = &self.listed;
        (changed_at.is_some() && *changed_at == changed(&self.folder))
            || list(path).is_ok_and(|(_, names)| names == self.names)
    }

    /// Columns and rows of the first picture.
    pub fn size(&self) -> (usize, usize) {
        self.size
    }

    /// True if the first picture has an alpha channel.
    pub fn has_alpha(&self) -> bool {
        self.has_alpha
    }

    /// The first frame's number.
    pub fn first(&self) -> Option<u64> {
        match &self.names {
            Names::Numbered { numbers, .. } => numbers.first().copied(),
            Names::All(names) => (!names.is_empty()).then_some(0),
        }
    }

    /// Number of frames from the first to the last.
    pub fn count(&self) -> u64 {
        match &self.names {
            Names::Numbered { numbers, .. } => match (numbers.first(), numbers.last()) {
                (Some(first), Some(last)) => last - first + 1,
                _ => 0,
            },
            Names::All(names) => names.len() as u64,
        }
    }

    /// Missing numbers between the first frame and the last.
    pub fn gaps(&self) -> Vec<RangeInclusive<u64>> {
        match &self.names {
            Names::Numbered { numbers, .. } => gaps(numbers),
            Names::All(_) => vec![],
        }
    }

    /// Number of files that match the pattern with a number below 0.
    pub fn negative(&self) -> usize {
        match self.names {
            Names::Numbered { negative, .. } => negative,
            Names::All(_) => 0,
        }
    }

    /// The file of a frame; `None` if a folder has no such picture.
    pub fn file(&self, frame: u64) -> Option<PathBuf> {
        let name = match &self.names {
            Names::Numbered { pattern, others, .. } => {
                others.get(&frame).map_or_else(|| pattern.name(frame), ToString::to_string)
            }
            Names::All(names) => names.get(usize::try_from(frame).ok()?)?.to_string(),
        };
        Some(self.folder.join(name))
    }

    /// Frame `frame`: the number in the file's name, or in a folder the place among all pictures. EXR holds
    /// linear light: it is encoded as sRGB and clipped at 1.
    ///
    /// # Errors
    /// When the file does not exist, or it cannot be read.
    pub fn frame(&self, frame: u64) -> Result<Arc<Pixels>> {
        let file = self.present(frame)?;
        let Codes { size, has_alpha, codes } = match FileFormat::from_path(&file) {
            Some(FileFormat::Dpx) => {
                let pixels = Movie::open(&file, &self.tools)?.frame(0)?;
                return Ok(pixels);
            }
            _ => file::read_codes(&file)?,
        };
        Ok(Arc::new(Pixels { size, has_alpha, codes }))
    }

    /// The file of frame `frame`; None for DPX.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub(crate) fn picture(&self, frame: u64) -> Result<Option<Picture>> {
        self.still(frame)?.map(|file| picture::read(&file)).transpose()
    }

    /// Properties of the file of frame `frame`; None for DPX.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub(crate) fn about(&self, frame: u64) -> Result<Option<About>> {
        self.still(frame)?.map(|file| picture::about(&file)).transpose()
    }

    fn still(&self, frame: u64) -> Result<Option<PathBuf>> {
        let file = self.present(frame)?;
        Ok((FileFormat::from_path(&file) != Some(FileFormat::Dpx)).then_some(file))
    }

    fn present(&self, frame: u64) -> Result<PathBuf> {
        self.file(frame).ok_or_else(|| {
            let problem = format!("{} has no picture {frame}: it has {}", self.folder.display(), self.count());
            Error::missing(problem, "Choose frames of the sequence")
        })
    }
}

/// A camera's raw file in a folder, and the program that reads it.
fn raw_in(folder: &Path) -> Option<(PathBuf, &'static str)> {
    let mut paths = sorted_names(folder).ok()?.into_iter().map(|name| folder.join(name));
    paths.find_map(|path| raw_program(&path).map(|program| (path, program)))
}

/// A file's name around the last number before its ending.
pub(super) struct NumberedName<'a> {
    pub before: &'a str,
    pub digits: &'a str,
    pub after: &'a str,
}

/// Splits a name at its number; `None` without one.
pub(super) fn split(name: &str) -> Option<NumberedName<'_>> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let before = stem[..end].trim_end_matches(|c: char| c.is_ascii_digit());
    Some(NumberedName { before, digits: &name[before.len()..end], after: &name[end..] })
}

/// Missing numbers in a sorted list.
pub(super) fn gaps(numbers: &[u64]) -> Vec<RangeInclusive<u64>> {
    let gaps = numbers.windows(2).filter(|pair| pair[1] > pair[0] + 1);
    gaps.map(|pair| pair[0] + 1..=pair[1] - 1).collect()
}

/// The pictures in a folder, in natural order.
///
/// # Errors
/// When the folder cannot be read.
pub fn pictures(folder: &Path) -> Result<Vec<Box<str>>> {
    let remedy = "Check that the folder of the sequence is there and can be read";
    let names = sorted_names(folder).map_err(|e| Error::io("open", folder, e, remedy))?;
    let names = names.iter().map(|name| name.to_string_lossy());
    Ok(names.filter(|name| is_picture(name)).map(|name| (*name).into()).collect())
}

/// Time of change of a folder, if known.
fn changed(folder: &Path) -> Option<SystemTime> {
    folder.metadata().ok()?.modified().ok()
}

/// The folder of a sequence and its files.
fn list(path: &Path) -> Result<(PathBuf, Names)> {
    if path.is_dir() {
        return Ok((path.to_path_buf(), Names::All(pictures(path)?)));
    }
    let folder = path.parent().map_or(PathBuf::new(), Path::to_path_buf);
    let folder = if folder.as_os_str().is_empty() { ".".into() } else { folder };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if path.is_file() {
        return Ok((folder, Names::All(vec![name.into()])));
    }
    let Some(pattern) = Pattern::from_name(&name) else { return Ok((folder, Names::All(vec![]))) };
    let (mut numbers, mut others, mut negative) = (vec![], HashMap::new(), 0);
    for name in pictures(&folder)? {
        if let Some(number) = pattern.number(&name) {
            numbers.push(number);
            if pattern.name(number) != *name {
                others.insert(number, name);
            }
        } else {
            negative += usize::from(pattern.is_negative(&name));
        }
    }
    numbers.sort_unstable();
    // Names that differ only in letters: the pattern's own counts.
    for pair in numbers.windows(2).filter(|pair| pair[0] == pair[1]) {
        if folder.join(pattern.name(pair[0])).is_file() {
            others.remove(&pair[0]);
        }
    }
    numbers.dedup();
    Ok((folder, Names::Numbered { pattern, numbers, others, negative }))
}
