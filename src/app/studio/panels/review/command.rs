//! Commands of the review.

use evaluation::review::{Mark, MarkedOlat};
use std::path::PathBuf;

/// Compares the network with the truth.
#[derive(Clone, Debug, PartialEq)]
pub enum ReviewCommand {
    /// Measure against the truth in this folder, or in the last folder used.
    Measure(Option<PathBuf>),
    /// Write the review as a page.
    Report(PathBuf),
    /// Save a verdict and a note.
    Mark(Box<MarkedOlat>),
    /// Give the selected cell a verdict.
    Verdict(Mark),
    /// Select a cell by its indices of case and lamp in the review, and show it beside its truth.
    Choose((usize, usize)),
    /// Select the worst cell without a verdict that follows the selected one.
    NextWorst,
    /// Estimate the errors of all frames, and find those unlike every pose.
    Trust,
}
