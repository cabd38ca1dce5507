//! Arc-cosine kernel: likeness of light from two directions in its effect on a subject.

use std::f32::consts::PI;

/// Correlation between a surface's responses to light from two directions at an angle, 1 to 0, averaged over all
/// surfaces: matte shading with any normal, times a shadow edge in any direction. Both are arc-cosine kernels (Cho
/// and Saul 2009, degrees 1 and 0).
pub(super) fn kernel(cosine: f32) -> f32 {
    let angle = cosine.clamp(-1.0, 1.0).acos();
    let shading = (angle.sin() + (PI - angle) * angle.cos()) / PI;
    shading * (1.0 - angle / PI)
}
