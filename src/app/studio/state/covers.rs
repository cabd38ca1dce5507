//! Questions, lists and reports that lie over the panes.

use crate::command::Dialog;
use std::path::PathBuf;

/// Kind of path chosen in a file dialog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    Folder,
    Files,
    /// A new file, which need not exist.
    NewFile,
}

/// The path field beside an open file dialog.
#[derive(Clone, Debug, PartialEq)]
pub struct PathEntry {
    pub dialog: Dialog,
    /// Number of its dialog.
    pub number: u64,
    pub title: &'static str,
    pub wanted: Wanted,
    /// Initial text of the field, or the text of a drop.
    pub begun: String,
    /// Number of times that a drop has filled it.
    pub fills: usize,
    /// Reason that the system shows no dialog, if it shows none.
    pub missing: Option<String>,
    /// An existing file that would be replaced: the question is open.
    pub existing: Option<PathBuf>,
}

/// A project to open once the person agrees to end work in the current one.
#[derive(Clone, Debug, PartialEq)]
pub struct Leaving {
    pub folder: PathBuf,
    /// True if it is the open project, to be reread.
    pub again: bool,
    /// Work that would end, one sentence each.
    pub ends: Vec<String>,
}

/// Open questions, lists and reports.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Covers {
    /// True if the list of shortcuts covers the picture.
    pub keys: bool,
    /// True if the list of commands is open.
    pub palette: bool,
    /// True if the performance report lies over the window.
    pub machine: bool,
    /// The path field, while a file dialog is open or missing.
    pub path: Option<PathEntry>,
    /// Work that a requested close would end, one sentence each; empty unless the question is open.
    pub closing: Vec<String>,
    /// A project whose opening would end work.
    pub leaving: Option<Leaving>,
}

impl Covers {
    /// True if a question or a list covers the window and takes the keys.
    pub fn takes_keys(&self) -> bool {
        let asks = !self.closing.is_empty() || self.leaving.is_some() || self.path.is_some();
        asks || self.palette || self.keys
    }
}
