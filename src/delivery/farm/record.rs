//! Record of a chunk's cost, one file per chunk: no two chunks write the same file.

use base::error::{Error, Result};
use base::files::{self, write_beside};
use base::machine::Machine;
use export::Stages;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Newest run of a chunk that relit at least one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// First and last frame.
    pub frames: (usize, usize),
    /// Number of frames that existed already.
    pub kept: usize,
    /// Seconds from the program's start to the last frame.
    pub seconds: f64,
    /// Of these, seconds before the first frame: checking the job and reading the network.
    pub start_seconds: f64,
    /// Mean milliseconds from frame to frame, and in each stage.
    pub stages: Stages,
    /// Bytes of the existing frames.
    pub bytes: u64,
    /// Device of the network, and the reason for the choice.
    pub device: String,
    pub machine: Machine,
}

/// File name of the record of frames `first` to `last`, or of their lock.
pub(crate) fn path(folder: &Path, (first, last): (usize, usize), ending: &str) -> PathBuf {
    folder.join("records").join(format!("{first:09}-{last:09}.{ending}"))
}

impl Record {
    pub(crate) fn save(&self, folder: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self)
            .map_err(|e| Error::bug(format!("cannot write a chunk's record: {e}")))?;
        write_beside(&path(folder, self.frames, "json"), |out| out.write_all(text.as_bytes()))
    }

    /// All records of a job, by frames. Unreadable files are skipped: records only inform people.
    pub(crate) fn all(folder: &Path) -> Vec<Self> {
        let entries = std::fs::read_dir(folder.join("records"));
        let paths = entries.into_iter().flatten().flatten().map(|entry| entry.path());
        let is_record = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "json");
        let read = |path: PathBuf| {
            let text = files::read_text(&path, files::MOST_TEXT).ok()?;
            serde_json::from_str::<Self>(&text).ok()
        };
        let mut found: Vec<Self> = paths.filter(is_record).filter_map(read).collect();
        found.sort_unstable_by_key(|record| record.frames);
        found
    }
}
