//! The lat-long panorama: direction and solid angle of each texel.
//!
//! Right-handed, +Y up, the camera on +Z looking along −Z. With u, v ∈ (0, 1) at half-pixel centres:
//! polar angle θ = π·v from +Y, azimuth φ = 2π(u − ½), ω = (sin θ·sin φ, cos θ, −sin θ·cos φ).
//! The centre column is the camera's view behind the subject; the left half is camera-left.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Unit direction of the point (u, v) of the panorama.
pub fn direction_from_uv(u: f32, v: f32) -> Vec3 {
    let (sin_theta, cos_theta) = (PI * v).sin_cos();
    let (sin_phi, cos_phi) = (TAU * (u - 0.5)).sin_cos();
    Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi)
}

/// Panorama position (u ∈ [0, 1), v ∈ [0, 1]) of a direction of any non-zero length.
pub fn uv_from_direction(direction: Vec3) -> (f32, f32) {
    let theta = direction.x.hypot(direction.z).atan2(direction.y);
    let u = 0.5 + direction.x.atan2(-direction.z) / TAU;
    (if u >= 1.0 { u - 1.0 } else { u }, theta / PI)
}

/// Unit direction of the centre of texel (`x`, `y`) of a `width × height` panorama.
pub fn texel_direction(x: usize, y: usize, width: usize, height: usize) -> Vec3 {
    direction_from_uv((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32)
}

/// Solid angle in steradians of one texel of row `y`: (2π/W)·(cos θ_top − cos θ_bottom), exact, so
/// that a panorama adds up to 4π.
pub fn texel_solid_angle(y: usize, width: usize, height: usize) -> f64 {
    let step = std::f64::consts::PI / height as f64;
    // cos a − cos b = 2·sin((a + b)/2)·sin((b − a)/2) stays precise at the poles.
    let difference = 2.0 * ((y as f64 + 0.5) * step).sin() * (0.5 * step).sin();
    std::f64::consts::TAU / width as f64 * difference
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::cell::Cell;
    use test_support::shown;

    #[test]
    fn the_signs_are_those_of_the_method() {
        let near = |a: Vec3, b: Vec3| assert!(a.distance(b) < 1e-6, "{a} is not {b}");
        near(direction_from_uv(0.5, 0.5), Vec3::NEG_Z);
        near(direction_from_uv(0.75, 0.5), Vec3::X);
        near(direction_from_uv(0.25, 0.5), Vec3::NEG_X);
        near(direction_from_uv(0.3, 0.0), Vec3::Y);
    }

    #[test]
    fn a_panorama_covers_the_sphere() {
        for (w, h) in [(1, 1), (2, 1), (64, 32), (1023, 511)] {
            let sum: f64 = (0..h).map(|y| texel_solid_angle(y, w, h) * w as f64).sum();
            assert!((sum - 4.0 * std::f64::consts::PI).abs() < 1e-11, "{w}×{h}: {sum}");
        }
    }

    #[test]
    fn positions_round_trip() {
        let largest = Cell::new(0.0f32);
        proptest!(|(u in 0.001f32..0.999, v in 0.001f32..0.999)| {
            let (u2, v2) = uv_from_direction(direction_from_uv(u, v) * 3.0);
            let error = (u - u2).abs().max((v - v2).abs());
            prop_assert!(error < 1e-4);
            largest.set(largest.get().max(error));
        });
        shown!(Light, "Panorama positions to directions and back",
            bound: "1e-4 of the panorama, also beside the poles",
            measured: format!("{:.1e}", largest.get()));
    }
}
