//! Commands for the list of environments.

use std::path::PathBuf;

/// Changes the list of environments.
#[derive(Clone, Debug, PartialEq)]
pub enum EnvironmentsCommand {
    /// Light the subject with the entry this many places further in the visible list, which wraps around.
    Step(isize),
    /// Read this entry's panorama: its row is seen, or reading failed before.
    Read(usize),
    /// Add an entry to the favourites or remove it; None for the current environment.
    ToggleFavourite(Option<usize>),
    /// List only entries that contain each of these words.
    Search(String),
    /// Stop watching the folder that holds this one.
    Unwatch(PathBuf),
}
