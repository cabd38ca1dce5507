//! The key that maps a page's clips to methods. It stays in the project, in `blind/STUDY.toml`.

use super::super::Method;
use base::error::{Error, Result};
use project::{Project, read_sealed, save_sealed};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Version of the key's format.
const FORMAT: u32 = 1;
/// Longest name of a study or person, in letters.
const MOST_LETTERS: usize = 32;

/// Meaning of a page's codes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Key {
    format: u32,
    /// Name of the page.
    pub study: String,
    /// Interview frames in the clips.
    pub frames: Vec<usize>,
    /// Training minutes of each method that was trained for the page or belongs to the project.
    pub minutes: BTreeMap<String, f64>,
    /// Trial → its two clips.
    pub trials: BTreeMap<String, [String; 2]>,
    /// Clip → its content.
    pub clips: BTreeMap<String, Shown>,
}

/// Content of a clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shown {
    pub method: Method,
    /// Name of the lamp that lights the subject.
    pub lamp: String,
}

/// True for a valid name of a study, trial, clip or person: it becomes a file name.
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

    /// The project's key of `study`; None if there is none.
    ///
    /// # Errors
    /// When it cannot be read or is damaged.
    pub fn load(project: &Project, study: &str) -> Result<Option<Self>> {
        let path = Self::path(project, study);
        if !is_name(study) || !path.exists() {
            return Ok(None);
        }
        let remedy = "Restore it from a copy of the project: only this key tells whose clip is whose";
        let text = read_sealed(&path, remedy)?;
        let key: Self = toml::from_str(&text).map_err(|e| Error::codec("read", &path, e.message().trim(), remedy))?;
        let known = |clip: &String| key.clips.contains_key(clip);
        let whole = key.trials.values().flatten().all(known) && key.study == study;
        if key.format != FORMAT || !whole {
            let problem = format!("expected the key of study {study} in format {FORMAT}");
            return Err(Error::codec("read", &path, problem, remedy));
        }
        Ok(Some(key))
    }
}
