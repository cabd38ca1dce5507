//! Commands for stored looks.

use crate::four_looks::FourSlot;
use crate::stored_looks::LookId;
use std::path::PathBuf;

/// Stores looks, applies them, and compares them side by side.
#[derive(Clone, Debug, PartialEq)]
pub enum LooksCommand {
    /// Store the current look under this name. A look of this name gets a new version.
    Store(String),
    /// Store the current look as a new version of this look.
    Update(LookId),
    /// Apply a version of a look, by number; None for the newest.
    Apply(LookId, Option<u32>),
    Rename(LookId, String),
    Duplicate(LookId),
    /// Remove a look from its shelf; it can be restored.
    Remove(LookId),
    /// Restore a removed look.
    BringBack(LookId),
    /// Move a look to the shelf for all projects, or from there to this project.
    Copy(LookId),
    /// Ask for the file to write a look to.
    SaveAs(LookId),
    /// Write the look to this file.
    Write(PathBuf),
    /// Apply the look in a file, and store it under the file's name.
    Load(PathBuf),
    /// Show four looks side by side, or the single picture again.
    ToggleFour,
    /// Show this in one of the four slots, 0 to 3 from the upper left.
    Place(usize, FourSlot),
    /// Apply the look in one of the four slots.
    Pick(usize),
}
