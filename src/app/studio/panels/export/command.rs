//! Commands of the export panel.

use crate::export_options::ExportOptions;
use farm::Engine;
use std::path::PathBuf;

/// Exports clips and stills.
#[derive(Clone, Debug, PartialEq)]
pub enum ExportCommand {
    /// Change the options of the next export.
    Options(Box<ExportOptions>),
    /// Use this file as the export's name.
    Destination(PathBuf),
    /// Add an export with the current settings to the queue.
    Add,
    /// Write an export with the current settings as a farm job for this engine, into a new folder in this one.
    Farm(Engine, PathBuf),
    /// Remove an export from the queue; a running one is asked to stop.
    Withdraw(u64),
    /// Write a waiting export before all others that wait.
    WriteNext(u64),
    /// Write an export that failed or was stopped again.
    Retry(u64),
    /// Show a folder in the system's file manager.
    OpenFolder(PathBuf),
}
