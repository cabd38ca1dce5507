//! Movies and sequences by address, each opened once per process.

use super::process::Tools;
use super::sequence::is_sequence;
use super::series::missing_words;
use super::{Movie, Pixels, Sequence};
use base::FileFormat;
use base::error::Result;
use imaging::picture::{About, Picture};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// A movie or a sequence.
#[derive(Debug)]
pub enum Source {
    Movie(Box<Movie>),
    Sequence(Box<Sequence>),
}

/// Open sources, the least recently used first.
static OPEN: Mutex<Vec<(PathBuf, Arc<Source>)>> = Mutex::new(Vec::new());
/// Maximum number of open sources: a movie may keep three decoders.
const MOST_OPEN: usize = 6;

/// True if a name has a movie's extension, including raw formats that cannot be read.
pub fn is_movie(path: &Path) -> bool {
    FileFormat::from_path(path).is_some_and(FileFormat::is_movie)
}

/// Opens a movie or a sequence, or returns the open one.
///
/// # Errors
/// When it cannot be read.
pub fn open(path: &Path) -> Result<Arc<Source>> {
    let mut all = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(at) = all.iter().position(|(opened, _)| opened == path) {
        let one = all.remove(at);
        if one.1.is_current() {
            let source = one.1.clone();
            all.push(one);
            return Ok(source);
        }
        if let Source::Movie(_) = &*one.1 {
            return Err(super::movie::replaced(path));
        }
    }
    drop(all);
    let source = Arc::new(Source::open(path, &Tools::default())?);
    let mut all = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    // Another thread may have opened it meanwhile.
    if let Some((_, source)) = all.iter().find(|(opened, _)| opened == path) {
        return Ok(source.clone());
    }
    all.push((path.to_path_buf(), source.clone()));
    let excess = all.len().saturating_sub(MOST_OPEN);
    all.drain(..excess);
    Ok(source)
}

impl Source {
    /// Opens a movie or a sequence without sharing it.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn open(path: &Path, tools: &Tools) -> Result<Self> {
        if is_sequence(path) {
            Ok(Self::Sequence(Box::new(Sequence::open(path, tools)?)))
        } else {
            Ok(Self::Movie(Box::new(Movie::open(path, tools)?)))
        }
    }

    fn is_current(&self) -> bool {
        match self {
            Self::Movie(movie) => movie.is_current(),
            Self::Sequence(sequence) => sequence.is_current(),
        }
    }

    /// Columns and rows as shown.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Self::Movie(movie) => movie.info().size,
            Self::Sequence(sequence) => sequence.size(),
        }
    }

    /// Frames per second, if known.
    pub fn frame_rate(&self) -> Option<f64> {
        match self {
            Self::Movie(movie) => Some(movie.info().frame_rate),
            Self::Sequence(_) => None,
        }
    }

    /// True if frames have an alpha channel.
    pub fn has_alpha(&self) -> bool {
        match self {
            Self::Movie(movie) => movie.info().has_alpha,
            Self::Sequence(sequence) => sequence.has_alpha(),
        }
    }

    /// The first frame's number: 0, except for numbered pictures.
    pub fn first(&self) -> u64 {
        match self {
            Self::Movie(_) => 0,
            Self::Sequence(sequence) => sequence.first().unwrap_or(0),
        }
    }

    /// Number of frames. Waits until they are listed.
    ///
    /// # Errors
    /// When they cannot be listed.
    pub fn count(&self) -> Result<u64> {
        match self {
            Self::Movie(movie) => movie.count(),
            Self::Sequence(sequence) => Ok(sequence.count()),
        }
    }

    /// Notes for the user on the decoding, in sentences.
    pub fn notes(&self) -> Vec<String> {
        match self {
            Self::Movie(movie) => movie.info().notes.clone(),
            Self::Sequence(sequence) => {
                let is_exr = |file: PathBuf| FileFormat::from_path(&file) == Some(FileFormat::OpenExr);
                let gaps = sequence.gaps();
                let gap = (!gaps.is_empty()).then(|| missing_words(&gaps, "the sequence"));
                let negative = (sequence.negative() > 0).then(|| {
                    "Pictures with numbers below 0 are not part of the pattern: to use them, name the folder, whose pictures \
                     are counted from 0"
                        .to_owned()
                });
                let exr = (sequence.first().and_then(|first| sequence.file(first))).is_some_and(is_exr);
                let exr = exr
                    .then(|| "EXR pictures are scene-linear: their light is kept, values above 1 included".to_owned());
                gap.into_iter().chain(negative).chain(exr).collect()
            }
        }
    }

    /// A frame as its own file holds it. None for a movie's frame and for DPX, which [`Self::frame`] decodes.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn picture(&self, frame: u64) -> Result<Option<Picture>> {
        match self {
            Self::Movie(_) => Ok(None),
            Self::Sequence(sequence) => sequence.picture(frame),
        }
    }

    /// Properties of a frame's own file. None for a movie's frame and for DPX.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn about(&self, frame: u64) -> Result<Option<About>> {
        match self {
            Self::Movie(_) => Ok(None),
            Self::Sequence(sequence) => sequence.about(frame),
        }
    }

    /// Frame `frame`.
    ///
    /// # Errors
    /// When there is no such frame, or it cannot be read.
    pub fn frame(&self, frame: u64) -> Result<Arc<Pixels>> {
        match self {
            Self::Movie(movie) => movie.frame(frame),
            Self::Sequence(sequence) => sequence.frame(frame),
        }
    }
}
