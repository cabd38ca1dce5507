//! A sequence of pictures: files whose names differ by a number, or all pictures of a folder.

use super::movie::{raw, raw_program};
use super::process::Tools;
use super::{Movie, Pixels};
use base::FileFormat;
use base::error::{Error, Result};
use imaging::file::{self, Codes};
use imaging::{Image, picture};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A sequence of pictures. Holds names or numbers, not pixels.
#[derive(Debug)]
pub struct Sequence {
    folder: PathBuf,
    names: Names,
    size: (usize, usize),
    has_alpha: bool,
    tools: Tools,
}

#[derive(Debug)]
enum Names {
    /// Names with a number between two texts, with a minimum number of digits; all numbers, sorted.
    Numbered { pattern: Pattern, numbers: Vec<u64> },
    /// All pictures of a folder, sorted; frames are counted from 0.
    All(Vec<Box<str>>),
}

#[derive(Clone, Debug, PartialEq)]
struct Pattern {
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    /// The pattern of a name like `shot.%04d.exr` or `shot.####.exr`.
    fn of(name: &str) -> Option<Self> {
        if let Some((before, rest)) = name.split_once('%') {
            let (digits, after) = rest.split_once('d')?;
            let is_count = digits.bytes().all(|b| b.is_ascii_digit()) && digits.len() <= 3;
            let digits = digits.parse().unwrap_or(1).clamp(1, 20);
            return is_count.then(|| Self {
                before: before.to_owned(),
                digits,
                after: after.to_owned(),
            });
        }
        let start = name.find('#')?;
        let after = name[start..].trim_start_matches('#');
        Some(Self {
            before: name[..start].to_owned(),
            digits: name.len() - start - after.len(),
            after: after.to_owned(),
        })
    }

    fn name(&self, number: u64) -> String {
        let digits = self.digits;
        format!("{}{number:0digits$}{}", self.before, self.after)
    }

    /// The number in a name that matches the pattern.
    fn number(&self, name: &str) -> Option<u64> {
        let digits = name.strip_prefix(&*self.before)?.strip_suffix(&*self.after)?;
        let number = digits.parse().ok()?;
        (self.name(number) == name).then_some(number)
    }
}

/// True if a name has a picture's extension.
fn is_picture(name: &str) -> bool {
    !name.starts_with('.') && FileFormat::of(Path::new(name)).is_some_and(FileFormat::is_sequence)
}

/// True if an address is a sequence: a pattern, a folder, or one of its files.
pub(crate) fn is_sequence(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.is_dir() || is_picture(&name)
}

impl Sequence {
    /// The pattern of the sequence whose first file is `path`, and that file's number; `None` if its name has no number.
    pub fn of_first(path: &Path) -> Option<(PathBuf, u64)> {
        let name = path.file_name()?.to_str()?;
        if Pattern::of(name).is_some() && !path.is_file() {
            return None;
        }
        let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
        let before = stem.trim_end_matches(|c: char| c.is_ascii_digit());
        let digits = stem.len() - before.len();
        let number = stem[before.len()..].parse().ok()?;
        let pattern = format!("{before}%0{digits}d{}", &name[stem.len()..]);
        (digits <= 18).then(|| (path.with_file_name(pattern), number))
    }

    /// Opens a sequence: lists its files and reads the header of the first one.
    ///
    /// # Errors
    /// When there are no files, or the first cannot be read.
    pub fn open(path: &Path, tools: &Tools) -> Result<Self> {
        let (folder, names) = list(path)?;
        let mut sequence = Self {
            folder,
            names,
            size: (0, 0),
            has_alpha: false,
            tools: Tools { cache: None, ..tools.clone() },
        };
        let first = sequence.first();
        let Some(first) = first else {
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

    /// The first missing number between the first frame and the last.
    pub fn gap(&self) -> Option<u64> {
        match &self.names {
            Names::Numbered { numbers, .. } => {
                let gap = numbers.windows(2).find(|pair| pair[1] != pair[0] + 1);
                gap.map(|pair| pair[0] + 1)
            }
            Names::All(_) => None,
        }
    }

    /// The file of a frame; `None` if a folder has no such picture.
    pub fn file(&self, frame: u64) -> Option<PathBuf> {
        let name = match &self.names {
            Names::Numbered { pattern, .. } => pattern.name(frame),
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
        let Codes { size, has_alpha, codes } = match FileFormat::of(&file) {
            Some(FileFormat::Dpx) => {
                let pixels = Movie::open(&file, &self.tools)?.frame(0)?;
                return Ok(pixels);
            }
            _ => file::read_codes(&file)?,
        };
        Ok(Arc::new(Pixels { size, has_alpha, codes }))
    }

    /// Light of frame `frame` if its file is scene-linear.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub(crate) fn light(&self, frame: u64) -> Result<Option<Image>> {
        let file = self.present(frame)?;
        if FileFormat::of(&file) == Some(FileFormat::Dpx) {
            return Ok(None);
        }
        Ok(picture::read(&file)?.into_scene_light().ok().map(|(light, _)| light))
    }

    fn present(&self, frame: u64) -> Result<PathBuf> {
        self.file(frame).ok_or_else(|| {
            let problem = format!(
                "{} has no picture {frame}: it has {}",
                self.folder.display(),
                self.count()
            );
            Error::missing(problem, "Choose frames of the sequence")
        })
    }
}

/// A camera's raw file in a folder, and the program that reads it.
fn raw_in(folder: &Path) -> Option<(PathBuf, &'static str)> {
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let mut raw = entries.filter_map(|entry| Some((entry.path(), raw_program(&entry.path())?)));
    raw.next()
}

/// The folder of a sequence and its files.
fn list(path: &Path) -> Result<(PathBuf, Names)> {
    let all = |folder: &Path, wanted: &mut dyn FnMut(&str)| -> Result<()> {
        let remedy = "Check that the folder of the sequence is there and can be read";
        let entries =
            std::fs::read_dir(folder).map_err(|e| Error::io("open", folder, e, remedy))?;
        for entry in entries.flatten() {
            wanted(&entry.file_name().to_string_lossy());
        }
        Ok(())
    };
    if path.is_dir() {
        let mut names: Vec<Box<str>> = vec![];
        all(path, &mut |name| {
            if is_picture(name) {
                names.push(name.into());
            }
        })?;
        names.sort_by(|a, b| natural(a).cmp(&natural(b)).then_with(|| a.cmp(b)));
        return Ok((path.to_path_buf(), Names::All(names)));
    }
    let folder = path.parent().map_or(PathBuf::new(), Path::to_path_buf);
    let folder = if folder.as_os_str().is_empty() { ".".into() } else { folder };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if path.is_file() {
        return Ok((folder, Names::All(vec![name.into()])));
    }
    let Some(pattern) = Pattern::of(&name) else {
        return Ok((folder, Names::All(vec![])));
    };
    let mut numbers = vec![];
    all(&folder, &mut |name| numbers.extend(pattern.number(name)))?;
    numbers.sort_unstable();
    Ok((folder, Names::Numbered { pattern, numbers }))
}

/// Sort key of a name whose last number counts as a number: `a9` comes before `a10`.
fn natural(name: &str) -> (&str, u64) {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let before = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    (before, stem[before.len()..].parse().unwrap_or(0))
}
