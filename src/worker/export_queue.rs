//! Exports in line: one after the other is written whenever no other job is in hand.

use base::error::Error;
use base::progress::Progress;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// An export in the line.
#[derive(Clone, Debug, PartialEq)]
pub struct Export {
    /// No other has this number.
    pub id: u64,
    /// What people call it: the files' name, once they are written as they were named then.
    pub name: String,
    pub status: ExportStatus,
}

/// What became of an export so far.
#[derive(Clone, Debug, PartialEq)]
pub enum ExportStatus {
    Waiting,
    /// It is in hand; how far it is, the job's reports say.
    Running,
    /// Where it was written, and a sentence about it.
    Done(WrittenExport),
    /// Why it could not be written, what is kept, and what to do.
    Failed(String),
    /// It was asked to stop; what is kept.
    Cancelled(String),
}

/// What an export wrote.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenExport {
    /// The files' name.
    pub name: String,
    /// The folder that holds them.
    pub folder: PathBuf,
    pub sentence: String,
}

/// Writes, and says what.
pub(super) type Write = Box<dyn FnOnce(&Progress) -> Result<WrittenExport, Error> + Send>;

#[derive(Default)]
struct Line {
    /// In the order in which they were asked for.
    exports: Vec<Export>,
    /// What those that wait are to do.
    waiting: Vec<(u64, Write)>,
    given: u64,
}

/// The line. Clones share it.
#[derive(Clone, Default)]
pub(super) struct ExportQueue(Arc<Mutex<Line>>);

impl ExportQueue {
    /// A list is whole at any time, even where a thread panicked with the lock in hand.
    fn line(&self) -> std::sync::MutexGuard<'_, Line> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts an export at the end of the line.
    pub fn push(&self, name: String, write: Write) -> u64 {
        let mut line = self.line();
        line.given += 1;
        let id = line.given;
        line.exports.push(Export {
            id,
            name,
            status: ExportStatus::Waiting,
        });
        line.waiting.push((id, write));
        id
    }

    pub fn exports(&self) -> Vec<Export> {
        self.line().exports.clone()
    }

    /// Takes an export that waits or is over out of the line.
    pub fn remove(&self, id: u64) {
        let mut line = self.line();
        line.waiting.retain(|(waiting, _)| *waiting != id);
        line.exports
            .retain(|export| export.id != id || export.status == ExportStatus::Running);
    }

    pub fn waits(&self) -> bool {
        !self.line().waiting.is_empty()
    }

    /// Takes the first that waits in hand.
    pub fn begin(&self) -> Option<(u64, Write)> {
        let mut line = self.line();
        if line.waiting.is_empty() {
            return None;
        }
        let (id, write) = line.waiting.remove(0);
        line.set(id, ExportStatus::Running);
        Some((id, write))
    }

    /// Notes what came of the export in hand.
    pub fn end(&self, id: u64, done: Result<WrittenExport, Error>) -> ExportStatus {
        let status = match done {
            Ok(written) => ExportStatus::Done(written),
            Err(Error::Cancelled { kept }) => ExportStatus::Cancelled(format!("Cancelled: {kept}")),
            Err(e) => ExportStatus::Failed(e.to_string()),
        };
        self.line().set(id, status.clone());
        status
    }
}

impl Line {
    fn set(&mut self, id: u64, status: ExportStatus) {
        if let Some(export) = self.exports.iter_mut().find(|export| export.id == id) {
            if let ExportStatus::Done(written) = &status {
                export.name.clone_from(&written.name);
            }
            export.status = status;
        }
    }
}

impl ExportStatus {
    /// What there is to say of it once it is over.
    pub fn sentence(&self) -> Option<&str> {
        match self {
            Self::Waiting | Self::Running => None,
            Self::Done(WrittenExport { sentence, .. })
            | Self::Failed(sentence)
            | Self::Cancelled(sentence) => Some(sentence),
        }
    }
}
