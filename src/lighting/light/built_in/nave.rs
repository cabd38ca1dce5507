//! A church nave: stained windows, candles, dark arcades.
//!
//! A box seen from inside. Its walls are lit by formulas of the distance to the light sources. Radiances have the
//! ratios of real churches: daylight in a window is about a hundred times as bright as the walls, a flame a
//! thousand times.

use super::panorama::panorama;
use super::pattern::{arch, noise, ramp, wall};
use crate::patch::{Outline, Patch};
use glam::{Vec2, Vec3};
use imaging::Image;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Light through stained glass at a place of the pane in metres.
fn stained_glass(p: Vec2) -> Vec3 {
    const GLASS: [Vec3; 6] = [
        Vec3::new(0.10, 0.22, 1.00),
        Vec3::new(1.00, 0.10, 0.07),
        Vec3::new(1.00, 0.62, 0.12),
        Vec3::new(0.16, 0.45, 0.95),
        Vec3::new(0.20, 0.75, 0.30),
        Vec3::new(0.95, 0.90, 0.75),
    ];
    let cell = (p * 2.6).floor();
    let pick = noise(Vec3::new(cell.x, cell.y, 3.0)) * 0.5 + 0.5;
    let lead = (p * 2.6 - cell - 0.5).abs().max_element();
    GLASS[((pick * 6.0) as usize).min(5)] * (1.0 - 0.92 * ramp(0.44, 0.48, lead))
}

/// A flame's radius in metres.
const FLAME: f32 = 0.045;

/// Candles on stands to either side, most of them in front.
static FLAMES: LazyLock<[Vec3; 14]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let side = if i % 2 == 0 { -1.0 } else { 1.0 };
        let row = (i / 2) as f32;
        Vec3::new(side * (2.7 + 0.25 * (row * 2.4).sin()), -0.45 + 0.12 * (row * 1.7).cos(), 4.4 - 2.3 * row)
    })
});

/// The nave's panorama, with a bright wall at 1.
pub fn nave(width: usize) -> Image {
    let mut image = panorama(width, radiance);
    for flame in FLAMES.iter() {
        let wide = f64::from(FLAME / flame.length());
        let disc = Patch {
            azimuth: f64::from(flame.x).atan2(f64::from(-flame.z)),
            elevation: f64::from(flame.y / flame.length()).asin(),
            outline: Outline::Disc(wide),
            softness: 0.4,
        };
        // ∫ of the disc's profile: 2π · wide² · 0.324 with this softness.
        let solid_angle = 2.0 * PI * wide * wide * 0.324;
        disc.add(&mut image, [1.0, 0.52, 0.17].map(|v| v * 1500.0 * solid_angle));
    }
    image
}

fn radiance(direction: Vec3) -> Vec3 {
    let (low, high) = (Vec3::new(-6.5, -1.6, -26.0), Vec3::new(6.5, 13.0, 15.0));
    let (p, axis) = wall(direction, low, high);
    let mut light = Vec3::splat(0.012);
    // Daylight from the rose window falls off along the nave; candles warm everything near the floor.
    light += Vec3::new(0.05, 0.06, 0.09) * (60.0 / ((p - Vec3::new(0.0, 7.0, -26.0)).length_squared() + 30.0));
    let stones = 0.85 + 0.12 * noise(p * Vec3::new(1.3, 2.2, 1.3)) + 0.06 * noise(p * 5.0);
    let mut seen = Vec3::ZERO;
    match axis {
        2 if p.z < 0.0 => {
            let rose = Vec2::new(p.x, p.y - 8.2);
            let petal = 0.75 + 0.25 * (12.0 * rose.y.atan2(rose.x)).cos();
            if rose.length() < 2.4 {
                seen = stained_glass(rose * 1.4) * 95.0 * ramp(0.5, 0.62, petal);
            }
            for x in [-2.6, 0.0, 2.6] {
                let pane = Vec2::new(p.x - x, p.y - 1.2);
                if arch(pane, 0.7, 2.4) > 0.0 {
                    seen = stained_glass(pane) * 70.0;
                }
            }
        }
        2 => {
            // The door behind the camera is ajar and lets daylight in.
            if arch(Vec2::new(p.x - 0.9, p.y + 1.6), 0.5, 2.4) > 0.0 {
                seen = Vec3::new(0.85, 0.95, 1.1) * 26.0;
            }
        }
        0 => {
            let bay = (p.z / 4.6 - (p.z / 4.6).floor() - 0.5) * 4.6;
            let pane = Vec2::new(bay, p.y - 6.4);
            if arch(pane, 0.62, 2.2) > 0.0 {
                // The sun is on the −X side: those windows burn.
                let day = if p.x < 0.0 { Vec3::new(1.25, 1.05, 0.80) * 260.0 } else { Vec3::new(0.7, 0.9, 1.2) * 34.0 };
                seen = stained_glass(Vec2::new(p.z, pane.y)) * day;
            }
            // Arcades below: dark openings between columns, which catch a little light.
            let arcade = arch(Vec2::new(bay, p.y + 1.6), 1.55, 3.4);
            light *= 1.0 - 0.85 * ramp(0.0, 0.3, arcade);
        }
        _ if p.y < 0.0 => {
            // Flagstones, with the coloured light of the windows.
            let flag = (Vec2::new(p.x, p.z) * 0.8 - (Vec2::new(p.x, p.z) * 0.8).floor() - 0.5).abs().max_element();
            light *= 1.0 - 0.4 * ramp(0.46, 0.49, flag);
            let pool = Vec2::new(p.x - 2.2, (p.z / 4.6 - (p.z / 4.6).floor() - 0.5) * 4.6);
            let throw = (-pool.length_squared() / 1.6).exp();
            light += stained_glass(Vec2::new(p.z, p.x)) * Vec3::new(3.6, 2.6, 1.8) * throw;
        }
        _ => {
            let rib = (p.z / 4.6 - (p.z / 4.6).floor() - 0.5).abs();
            light *= 0.7 + 0.9 * ramp(0.45, 0.47, rib) - 0.25 * (p.x / 6.5).powi(2);
        }
    }
    for flame in FLAMES.iter() {
        // The halo is below 10⁻⁶ at 20°.
        if direction.dot(*flame) > 0.94 * flame.length() {
            let off = direction.angle_between(*flame);
            let wide = FLAME / flame.length();
            seen += Vec3::new(1.0, 0.45, 0.13) * 0.5 * (-off * off / (30.0 * wide * wide)).exp();
        }
        let near = (p - flame).length_squared();
        light += Vec3::new(1.0, 0.50, 0.18) * (0.35 / (near + 0.6));
    }
    let stone = Vec3::new(0.42, 0.38, 0.33) * stones;
    seen + stone * light
}
