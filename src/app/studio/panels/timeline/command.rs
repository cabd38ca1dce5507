//! Commands of the timeline.

/// Navigates the timeline, and changes its keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimelineCommand {
    /// Show all frames.
    ShowAll,
    /// Go to the next key of the selected lane, or of all lanes if none is selected; to the previous one if negative.
    StepKey(isize),
    /// Select all keys of the curve or of the lanes.
    SelectAll,
    /// Move the selected keys by this many frames.
    Nudge(isize),
}
