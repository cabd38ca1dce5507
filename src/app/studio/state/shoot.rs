//! Selections among the pictures of the shoot, and its lamps.

/// The visible pictures of the shoot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShootView {
    /// The lamp of the visible mirror ball; None for the interview's light.
    pub photograph: Option<usize>,
    /// The lamp of the visible training pose.
    pub trained_lamp: usize,
    /// The exemplar to relight like the interview.
    pub pose: usize,
}

/// Numbers of lamps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LampCounts {
    /// Lamps in the rig, once known.
    pub rig: usize,
    /// Lamps of the shoot used for training.
    pub(super) shoot: usize,
    /// Lamps of the shoot with a photograph of the mirror ball.
    pub(super) photographed: usize,
}
