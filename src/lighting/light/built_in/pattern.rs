//! Patterns for built-in environments: ramps, noise, room interiors, arches.

use glam::{Vec2, Vec3};

/// 0 below `from`, 1 above `to`, smooth between.
pub fn ramp(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Smooth, deterministic noise in `[−1, 1]` with features one unit wide.
pub fn noise(p: Vec3) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let f = f * f * (Vec3::splat(3.0) - 2.0 * f);
    let corner = |x: f32, y: f32, z: f32| lattice(cell + Vec3::new(x, y, z));
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let layer = |z: f32| {
        let low = mix(corner(0.0, 0.0, z), corner(1.0, 0.0, z), f.x);
        let high = mix(corner(0.0, 1.0, z), corner(1.0, 1.0, z), f.x);
        mix(low, high, f.y)
    };
    mix(layer(0.0), layer(1.0), f.z)
}

/// A value in `[−1, 1]` for a point of the integer lattice (an integer hash after C. Wellons).
fn lattice(p: Vec3) -> f32 {
    let fold = |h: u32, v: f32| (h ^ (v as i32 as u32)).wrapping_mul(0x85eb_ca6b).rotate_left(13);
    let mut h = fold(fold(fold(0x9e37_79b9, p.x), p.y), p.z);
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    (h ^ (h >> 16)) as f32 / u32::MAX as f32 * 2.0 - 1.0
}

/// Exit of a ray from the origin out of the box between `low` and `high`: the place, and the axis of the wall (0
/// for ±X, 1 for floor and ceiling, 2 for ±Z).
pub fn wall(direction: Vec3, low: Vec3, high: Vec3) -> (Vec3, usize) {
    let ahead = Vec3::select(direction.cmpge(Vec3::ZERO), high, low);
    let t = (ahead / direction).to_array();
    let axis = (0..3).filter(|&i| t[i].is_finite()).min_by(|&a, &b| t[a].total_cmp(&t[b])).unwrap_or(1);
    (direction * t[axis], axis)
}

/// A pointed arch: positive inside. `p` is relative to the middle of the sill, `half` is the half width, and
/// `height` is where the curve begins.
pub fn arch(p: Vec2, half: f32, height: f32) -> f32 {
    let above = p.y - height;
    let side = if above > 0.0 { Vec2::new(p.x.abs() + half, above).length() - half } else { p.x.abs() };
    (half - side).min(p.y)
}
