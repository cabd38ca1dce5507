//! Exports that wait: one after the other is written whenever no job runs.

use base::error::Error;
use base::progress::Progress;
use parking_lot::Mutex;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

/// An export in the queue.
#[derive(Clone, Debug, PartialEq)]
pub struct Export {
    /// Unique number.
    pub id: u64,
    /// Name of the export: the base name of its files, with a number appended once they are written.
    pub name: String,
    pub status: ExportStatus,
}

/// State of an export.
#[derive(Clone, Debug, PartialEq)]
pub enum ExportStatus {
    Waiting,
    /// Running; its progress comes in the job's reports.
    Running,
    /// Done: place of the files, and a sentence about the export.
    Done(WrittenExport),
    /// Failed: the reason, the files that are kept, and the remedy.
    Failed(String),
    /// Stopped on request, with the files that are kept.
    Cancelled(String),
}

/// Output of an export.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenExport {
    /// Base name of the files.
    pub name: String,
    /// Folder of the files.
    pub folder: PathBuf,
    pub sentence: String,
}

/// Writes an export and returns its output.
pub(super) type Write = Box<dyn FnOnce(&Progress) -> Result<WrittenExport, Error> + Send>;

#[derive(Default)]
struct State {
    /// In the order of the requests.
    exports: Vec<Export>,
    /// Work of the waiting exports.
    waiting: VecDeque<(u64, Write)>,
    /// Count of assigned numbers.
    given: u64,
}

/// The queue. Clones share it.
#[derive(Clone, Default)]
pub(super) struct ExportQueue(Arc<Mutex<State>>);

impl ExportQueue {
    /// Puts an export at the end of the queue.
    pub fn push(&self, name: String, write: Write) -> u64 {
        let mut state = self.0.lock();
        state.given += 1;
        let id = state.given;
        state.exports.push(Export { id, name, status: ExportStatus::Waiting });
        state.waiting.push_back((id, write));
        id
    }

    pub fn exports(&self) -> Vec<Export> {
        self.0.lock().exports.clone()
    }

    /// Removes an export that waits or is over.
    pub fn remove(&self, id: u64) {
        let mut state = self.0.lock();
        state.waiting.retain(|(waiting, _)| *waiting != id);
        state.exports.retain(|export| export.id != id || export.status == ExportStatus::Running);
    }

    pub fn waits(&self) -> bool {
        !self.0.lock().waiting.is_empty()
    }

    /// Begins the first waiting export.
    pub fn begin(&self) -> Option<(u64, Write)> {
        let mut state = self.0.lock();
        let (id, write) = state.waiting.pop_front()?;
        state.set(id, ExportStatus::Running);
        Some((id, write))
    }

    /// Records the result of the running export.
    pub fn end(&self, id: u64, done: Result<WrittenExport, Error>) -> ExportStatus {
        let status = match done {
            Ok(written) => ExportStatus::Done(written),
            Err(Error::Cancelled { kept }) => ExportStatus::Cancelled(format!("Cancelled: {kept}")),
            Err(e) => ExportStatus::Failed(e.to_string()),
        };
        self.0.lock().set(id, status.clone());
        status
    }
}

impl State {
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
    /// A sentence about the export once it is over.
    pub fn sentence(&self) -> Option<&str> {
        match self {
            Self::Waiting | Self::Running => None,
            Self::Done(WrittenExport { sentence, .. })
            | Self::Failed(sentence)
            | Self::Cancelled(sentence) => Some(sentence),
        }
    }
}
