//! The parts of a shoot that are movies: the interview's frames, and takes with one frame per lamp.

use base::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The interview's frames, in presentation order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Frames {
    /// Names of files under `interview/`, without extension: `frame_000` …
    Named(Vec<String>),
    /// A part of a movie or sequence.
    Clip(Clip),
}

/// Successive frames of a movie or sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Clip {
    /// The movie's file, or the pattern of a sequence's files, relative to the shoot's folder.
    pub movie: PathBuf,
    /// The first frame.
    #[serde(default)]
    pub first: u64,
    /// Number of frames.
    pub count: u64,
    /// True if its alpha is the matte.
    #[serde(default, skip_serializing_if = "is_false")]
    pub alpha: bool,
}

/// Replacement for an interview frame that cannot be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum DamagedFrames {
    /// None: work stops and names the frame.
    #[default]
    Stop,
    /// The previous frame; at the interview's start the next one.
    Hold,
    /// Black, without the subject. Calibration and training use the previous frame.
    Black,
}

impl DamagedFrames {
    /// True if work stops.
    pub fn is_stop(&self) -> bool {
        *self == Self::Stop
    }
}

/// Frames of a movie or sequence that show one subject under each lamp alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Take {
    /// The movie's file, or the pattern of a sequence's files, relative to the shoot's folder.
    pub movie: PathBuf,
    /// True if its alpha is the matte.
    #[serde(default, skip_serializing_if = "is_false")]
    pub alpha: bool,
    /// Frames in which all lamps lit the subject, in order of time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tracking: Vec<u64>,
    /// Frame of each lamp alone, by lamp name.
    pub lamps: BTreeMap<String, u64>,
}

/// Parts of a shoot that are frames of movies, besides the interview; the rest are files.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Takes {
    /// Poses by name; other poses are files under `exemplars/`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub poses: BTreeMap<String, Take>,
    /// The mirror balls under each lamp; otherwise they are files under `probes/`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub balls: Option<Take>,
    /// The mirror ball under the interview's light; otherwise it is a file under `probes/`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interview_ball: Option<Still>,
    /// Movie of the interview's mattes, a frame for each frame; otherwise they are files under `interview_masks/`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interview_mattes: Option<PathBuf>,
}

/// One frame of a movie or sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Still {
    /// The movie's file, or the pattern of a sequence's files, relative to the shoot's folder.
    pub movie: PathBuf,
    /// The frame.
    pub frame: u64,
}

fn is_false(value: &bool) -> bool {
    !value
}

impl Takes {
    /// True if all parts are files.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Rejects takes that lack one of the `lamps`.
    ///
    /// # Errors
    /// When a take lacks a lamp.
    pub fn check<'a>(&self, lamps: impl Iterator<Item = &'a String> + Clone) -> Result<()> {
        let balls = self.balls.iter().map(|take| ("the mirror balls", take));
        let poses = self.poses.iter().map(|(pose, take)| (&**pose, take));
        for (what, take) in poses.chain(balls) {
            if let Some(lamp) = lamps.clone().find(|&lamp| !take.lamps.contains_key(lamp)) {
                return Err(Error::invalid(
                    format!("`takes` has no frame of {} for {what} under {lamp}", take.movie.display()),
                    "Correct it, or import the shoot again",
                ));
            }
        }
        Ok(())
    }
}

impl Frames {
    /// Number of frames.
    pub fn len(&self) -> usize {
        match self {
            Self::Named(names) => names.len(),
            Self::Clip(clip) => clip.count as usize,
        }
    }

    /// True if there are no frames.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The name of frame `frame`, from 0: a file name, or the frame's number in its movie. `None` beyond the
    /// last.
    pub fn get(&self, frame: usize) -> Option<Cow<'_, str>> {
        match self {
            Self::Named(names) => names.get(frame).map(|name| Cow::Borrowed(&**name)),
            Self::Clip(clip) if frame < self.len() => Some(format!("frame_{:06}", clip.first + frame as u64).into()),
            Self::Clip(_) => None,
        }
    }

    /// The name of frame `frame`, from 0.
    ///
    /// # Panics
    /// When the frame does not exist.
    pub fn name(&self, frame: usize) -> Cow<'_, str> {
        let Some(name) = self.get(frame) else {
            panic!("there is no frame {frame}");
        };
        name
    }

    /// All names, in order. They are made one at a time, because a long movie has millions.
    pub fn names(&self) -> impl ExactSizeIterator<Item = Cow<'_, str>> {
        (0..self.len()).map(|frame| self.name(frame))
    }
}

impl Default for Frames {
    fn default() -> Self {
        Self::Named(vec![])
    }
}

impl From<Vec<String>> for Frames {
    fn from(names: Vec<String>) -> Self {
        Self::Named(names)
    }
}

impl Clip {
    /// Maximum number of frames of a clip: ten days at 1,000 frames per second.
    pub const MOST: u64 = 1 << 30;

    /// Rejects frame numbers that no movie has.
    ///
    /// # Errors
    /// When the numbers are out of range.
    pub fn check(&self) -> Result<()> {
        if self.count <= Self::MOST && self.first <= Self::MOST {
            return Ok(());
        }
        let problem = format!(
            "{} cannot have {} frames from {} on: the limit is {}",
            self.movie.display(),
            self.count,
            self.first,
            Self::MOST
        );
        Err(Error::invalid(problem, "Correct `frames`, or import the shoot again"))
    }
}
