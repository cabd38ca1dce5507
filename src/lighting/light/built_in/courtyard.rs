//! A sunny courtyard: plastered walls over arcades, a paved floor, the sky with a few clouds and the sun,
//! some fifty thousand times as bright.

use super::panorama::panorama;
use super::pattern::{arch, noise, ramp, wall};
use crate::patch::{Outline, Patch};
use glam::{Vec2, Vec3};
use imaging::Image;

/// Towards the sun, not of unit length.
const SUN: Vec3 = Vec3::new(0.62, 0.62, 0.48);

/// The courtyard's panorama, with the sky at about 1.
pub fn courtyard(width: usize) -> Image {
    let mut image = panorama(width, radiance);
    let disc = Patch {
        azimuth: f64::from(SUN.x).atan2(f64::from(-SUN.z)),
        elevation: f64::from(SUN.y / SUN.length()).asin(),
        // One and a half times the sun's radius, because of haze.
        outline: Outline::Disc(0.00465 * 1.5),
        softness: 0.0,
    };
    // Its irradiance is about five times the sky's.
    disc.add(&mut image, [15.23, 14.16, 12.18]);
    image
}

fn radiance(direction: Vec3) -> Vec3 {
    let sun = SUN.normalize();
    let (low, high) = (Vec3::new(-9.0, -1.6, -13.0), Vec3::new(9.0, 6.2, 11.0));
    let (p, axis) = wall(direction, low, Vec3::new(high.x, 1e4, high.z));
    if p.y > high.y || axis == 1 && p.y > 0.0 {
        return sky(direction, sun);
    }
    // Surfaces facing the sun are sun-lit, unless a wall shadows them.
    let normal = [Vec3::X, Vec3::Y, Vec3::Z][axis] * if axis == 1 { 1.0 } else { -p.to_array()[axis].signum() };
    let facing = normal.dot(sun).max(0.0);
    let free = sun * ((high.y - p.y) / sun.y) + p;
    let reaches = ramp(0.0, 0.12, (high.x - free.x).min(high.z - free.z));
    let skylight = Vec3::new(0.62, 0.80, 1.10) * (0.45 + 0.35 * (p.y + 1.6) / 7.8);
    let bounce = Vec3::new(0.75, 0.62, 0.46) * 0.55;
    let light = skylight + bounce + Vec3::new(1.0, 0.90, 0.76) * (16.0 * facing * reaches);
    let grain = 1.0 + 0.10 * noise(p * 1.7) + 0.08 * noise(p * 7.0);
    let albedo = match axis {
        1 => {
            let slab = Vec2::new(p.x * 0.7, p.z * 0.7);
            let joint = (slab - slab.floor() - 0.5).abs().max_element();
            Vec3::new(0.36, 0.33, 0.29) * (1.0 - 0.45 * ramp(0.46, 0.49, joint))
        }
        _ => facade(if axis == 0 { p.z } else { p.x }, p.y),
    };
    albedo * grain * light / std::f32::consts::PI
}

/// A plastered wall over an arcade, with shuttered windows above and a cornice.
fn facade(along: f32, y: f32) -> Vec3 {
    let bay = (along / 3.0 - (along / 3.0).floor() - 0.5) * 3.0;
    if arch(Vec2::new(bay, y + 1.6), 1.1, 2.1) > 0.0 {
        return Vec3::new(0.055, 0.048, 0.042);
    }
    let window = Vec2::new(bay, y - 3.1);
    if window.x.abs() < 0.45 && window.y > 0.0 && window.y < 1.5 {
        return Vec3::new(0.05, 0.06, 0.07);
    }
    if window.x.abs() < 0.85 && window.y > 0.0 && window.y < 1.5 {
        return Vec3::new(0.13, 0.24, 0.22);
    }
    if y > 5.9 || (y - 1.95).abs() < 0.10 {
        return Vec3::new(0.62, 0.58, 0.50);
    }
    Vec3::new(0.60, 0.43, 0.25)
}

/// A clear sky with a few clouds, without the sun's disc.
fn sky(direction: Vec3, sun: Vec3) -> Vec3 {
    let height = direction.y.max(0.0);
    let off = direction.angle_between(sun);
    let blue = Vec3::new(1.25, 1.40, 1.55).lerp(Vec3::new(0.28, 0.55, 1.25), height.powf(0.45));
    let haze = Vec3::new(1.0, 0.92, 0.80) * (3.0 * (-off / 0.22).exp() + 14.0 * (-off / 0.05).exp());
    let p = direction / (direction.y + 0.12);
    let billow = 0.6 * noise(p * Vec3::new(1.4, 0.0, 1.4))
        + 0.3 * noise(p * Vec3::new(3.3, 0.0, 3.3) + 7.0)
        + 0.15 * noise(p * Vec3::new(7.0, 0.0, 7.0) + 3.0);
    let cloud = ramp(0.05, 0.5, billow);
    let lit = Vec3::splat(1.6) + Vec3::new(1.6, 1.5, 1.35) * (-off / 0.9).exp();
    blue.lerp(lit, 0.85 * cloud) + haze
}
