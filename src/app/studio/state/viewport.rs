//! Display of the picture in the viewport.

use super::View;
use crate::comparison::GAINS;
use crate::region::Region;
use color_config::ColorChoice;
use scene::{Inspection, Viewing};

/// Viewing settings of the picture, which are never exported.
#[derive(Clone, Debug, PartialEq)]
pub struct Display {
    pub viewing: Viewing,
    /// OpenColorIO view that replaces a tone curve for viewing, once its table is ready.
    pub color_view: Option<ColorChoice>,
    /// Image shown instead of the picture.
    pub inspection: Inspection,
    /// Gain of differences: one of [`GAINS`].
    pub gain: f32,
}

impl Default for Display {
    fn default() -> Self {
        Self { viewing: Viewing::default(), color_view: None, inspection: Inspection::default(), gain: GAINS[2] }
    }
}

/// Position of the picture, and the marks on it.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewportView {
    pub view: View,
    /// Position of the wipe between two pictures: 0 left, 1 right.
    pub wipe: f32,
    /// True if the map of expected errors lies over the picture.
    pub doubts: bool,
    /// True if a press on the picture places a light.
    pub aims: bool,
    /// Column and row of the probed pixel.
    pub probed: Option<[usize; 2]>,
    /// The probed region.
    pub region: Option<Region>,
}

impl Default for ViewportView {
    fn default() -> Self {
        Self { view: View::FITTED, wipe: 0.5, doubts: false, aims: false, probed: None, region: None }
    }
}
