//! Method of each clip of a page: the key that stays in the project, in `blind/STUDY.toml`.

use super::super::Method;
use base::error::{Error, Result};
use project::{Project, read_sealed, save_sealed};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The version of the key that this program writes and reads.
const FORMAT: u32 = 1;
/// Letters of a study's or person's name, at most.
const MOST_LETTERS: usize = 32;

/// Meaning of a page's codes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Key {
    format: u32,
    /// The page's name.
    pub study: String,
    /// Frames of the interview that the clips show.
    pub frames: Vec<usize>,
    /// Of each method that was trained for the page, or whose network the project has: minutes of training.
    pub minutes: BTreeMap<String, f64>,
    /// Trial → the two clips that are compared.
    pub trials: BTreeMap<String, [String; 2]>,
    /// Clip → what it shows.
    pub clips: BTreeMap<String, Shown>,
}

/// Content of a clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shown {
    pub method: Method,
    /// The name of the lamp that the subject is lit by.
    pub lamp: String,
}

/// True if this can be a study's, a trial's, a clip's or a person's name: it becomes the name of a file.
pub fn is_name(text: &str) -> bool {
    let letters = text.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit());
    letters && (1..=MOST_LETTERS).contains(&text.len())
}

impl Key {
    pub fn new(
        study: String,
        frames: Vec<usize>,
        minutes: BTreeMap<String, f64>,
        trials: BTreeMap<String, [String; 2]>,
        clips: BTreeMap<String, Shown>,
    ) -> Self {
        Self { format: FORMAT, study, frames, minutes, trials, clips }
    }

    /// Path of the key of `study`.
    pub fn path(project: &Project, study: &str) -> PathBuf {
        project.result_path("blind").join(format!("{study}.toml"))
    }

    /// Writes it into the project.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self, project: &Project) -> Result<()> {
        save_sealed(&Self::path(project, &self.study), self)
    }

    /// The project's key of `study`; None if it has none.
    ///
    /// # Errors
    /// When it cannot be read or is damaged.
    pub fn load(project: &Project, study: &str) -> Result<Option<Self>> {
        let path = Self::path(project, study);
        if !is_name(study) || !path.exists() {
            return Ok(None);
        }
        let remedy =
            "Take it from a copy of the project: without it nobody knows which clip is whose";
        let text = read_sealed(&path, remedy)?;
        let key: Self = toml::from_str(&text)
            .map_err(|e| Error::codec("read", &path, e.message().trim(), remedy))?;
        let known = |clip: &String| key.clips.contains_key(clip);
        let whole = key.trials.values().flatten().all(known) && key.study == study;
        if key.format != FORMAT || !whole {
            let problem = format!("expected the key of study {study} in format {FORMAT}");
            return Err(Error::codec("read", &path, problem, remedy));
        }
        Ok(Some(key))
    }
}
