//! Commands of the performance report.

use std::path::PathBuf;

/// Measures the performance of this machine.
#[derive(Clone, Debug, PartialEq)]
pub enum MachineCommand {
    /// Measure for at most this many minutes.
    Measure(f64),
    /// Write the report to this file.
    Save(PathBuf),
}
