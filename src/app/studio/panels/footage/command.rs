//! Commands for mattes.

use footage::{BrushSide, Stroke};

/// Paints mattes.
#[derive(Clone, Debug, PartialEq)]
pub enum MatteCommand {
    /// Start or stop painting.
    Tool(bool),
    ToggleTool,
    /// Set the brush to keep or to remove.
    Side(BrushSide),
    SwapSide,
    /// Set the brush's radius, in pixels of the plate.
    Radius(f32),
    /// Enlarge the brush by this many steps; shrink it if negative.
    StepRadius(i32),
    /// Add a stroke.
    Stroke(Box<Stroke>),
    /// Remove the strokes of this frame.
    Clear(usize),
    /// Make all mattes that are not in the shoot.
    MakeAll,
}
