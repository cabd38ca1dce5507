//! Settings of the flow.

/// Settings of [`flow`](super::flow). The defaults find poses of one face in pictures of 256 to 384 pixels a
/// side.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowSettings {
    /// Halvings of the finest pictures that are matched; 0: full size.
    pub finest_scale: usize,
    /// Pixels from patch to patch, 1 to 8.
    pub stride: usize,
    /// Most steps of a patch at each scale: half of them in each direction of the search.
    pub descent_iterations: usize,
    /// Linearisations of the refinement at each scale; 0: none.
    pub refinement_iterations: usize,
    /// Weight of smoothness.
    pub alpha: f32,
    /// Weight of equal codes.
    pub delta: f32,
    /// Weight of equal slopes.
    pub gamma: f32,
}

impl Default for FlowSettings {
    fn default() -> Self {
        Self {
            finest_scale: 0,
            stride: 4,
            descent_iterations: 12,
            refinement_iterations: 5,
            alpha: 40.0,
            delta: 5.0,
            gamma: 10.0,
        }
    }
}
