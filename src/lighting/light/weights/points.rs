//! Points of the fit: directions that sample the environment's light.

use glam::DVec3;

/// Number of points, 6° apart.
pub(super) const POINTS: usize = 1024;

/// The points, evenly spaced over the sphere.
pub(super) fn points() -> Vec<DVec3> {
    spiral(POINTS)
}

/// Directions evenly spaced over the sphere (a Fibonacci spiral).
pub(super) fn spiral(count: usize) -> Vec<DVec3> {
    (0..count)
        .map(|i| {
            let y = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
            let (sin, cos) = (2.399_963_229_728_653 * i as f64).sin_cos();
            let across = (1.0 - y * y).sqrt();
            DVec3::new(across * cos, y, across * sin)
        })
        .collect()
}
