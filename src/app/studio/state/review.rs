//! Selection among the measured cells of the review.

use crate::comparison::CellPicture;
use evaluation::review::Metric;

/// The visible cell, and the order of the cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReviewView {
    /// The measured cell shown beside the truth: indices of case (frame or pose) and lamp in the review.
    pub cell: Option<(usize, usize)>,
    /// The last selected cell: indices of case and lamp in the review.
    pub chosen: Option<(usize, usize)>,
    /// The enlarged picture of a cell; None for all three.
    pub enlarged: Option<CellPicture>,
    /// Sort order of the measured cells.
    pub metric: Metric,
}
