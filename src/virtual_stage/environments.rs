//! Environments of the stage's own: a church nave and a courtyard, as lat-long panoramas.
//!
//! Each is a box seen from inside, with openings, columns and a floor, its walls lit by formulas of
//! the distance to what shines. Radiances keep the ratios of such places: daylight in a window is
//! some hundred times the walls, a flame a thousand, the sun fifty thousand times the sky.

use super::shape::{noise, ramp};
use crate::imaging::{Image, Raster};
use crate::light::latlong::direction_from_uv;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Columns and rows of the panoramas.
const SIZE: (usize, usize) = (256, 128);
/// Rays across a texel, so that small lights keep their energy.
const RAYS: usize = 5;

/// The environments with the names of their files.
pub fn all() -> Vec<(&'static str, Image)> {
    vec![("nave", panorama(nave)), ("courtyard", panorama(courtyard))]
}

fn panorama(radiance: impl Fn(Vec3) -> Vec3 + Sync) -> Image {
    let (width, height) = SIZE;
    let pixels = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let mut sum = Vec3::ZERO;
            for ray in 0..RAYS * RAYS {
                let u =
                    ((i % width) as f32 + ((ray % RAYS) as f32 + 0.5) / RAYS as f32) / width as f32;
                let v = ((i / width) as f32 + ((ray / RAYS) as f32 + 0.5) / RAYS as f32)
                    / height as f32;
                sum += radiance(direction_from_uv(u, v));
            }
            (sum / (RAYS * RAYS) as f32).to_array()
        })
        .collect();
    Raster {
        width,
        height,
        pixels,
    }
}

/// Where a ray from the origin leaves the box between `low` and `high`: the place, and the axis of
/// the wall (0 for ±X, 1 for floor and ceiling, 2 for ±Z).
fn wall(direction: Vec3, low: Vec3, high: Vec3) -> (Vec3, usize) {
    let ahead = Vec3::select(direction.cmpge(Vec3::ZERO), high, low);
    let t = (ahead / direction).to_array();
    let axis = (0..3)
        .filter(|&i| t[i].is_finite())
        .min_by(|&a, &b| t[a].total_cmp(&t[b]))
        .unwrap_or(1);
    (direction * t[axis], axis)
}

/// A pointed arch: positive inside, for a place from the middle of its sill, `half` wide on either
/// side and `height` to where the curve begins.
fn arch(p: Vec2, half: f32, height: f32) -> f32 {
    let above = p.y - height;
    let side = if above > 0.0 {
        Vec2::new(p.x.abs() + half, above).length() - half
    } else {
        p.x.abs()
    };
    (half - side).min(p.y)
}

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

fn nave(direction: Vec3) -> Vec3 {
    let (low, high) = (Vec3::new(-6.5, -1.6, -26.0), Vec3::new(6.5, 13.0, 15.0));
    let (p, axis) = wall(direction, low, high);
    let mut light = Vec3::splat(0.012);
    // Daylight from the rose falls off along the nave; candles warm what is near the floor.
    light += Vec3::new(0.05, 0.06, 0.09)
        * (60.0 / ((p - Vec3::new(0.0, 7.0, -26.0)).length_squared() + 30.0));
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
            // Behind the camera stands the door, ajar on daylight.
            if arch(Vec2::new(p.x - 0.9, p.y + 1.6), 0.5, 2.4) > 0.0 {
                seen = Vec3::new(0.85, 0.95, 1.1) * 26.0;
            }
        }
        0 => {
            let bay = (p.z / 4.6 - (p.z / 4.6).floor() - 0.5) * 4.6;
            let pane = Vec2::new(bay, p.y - 6.4);
            if arch(pane, 0.62, 2.2) > 0.0 {
                // The sun stands on the −X side: those windows burn.
                let day = if p.x < 0.0 {
                    Vec3::new(1.25, 1.05, 0.80) * 260.0
                } else {
                    Vec3::new(0.7, 0.9, 1.2) * 34.0
                };
                seen = stained_glass(Vec2::new(p.z, pane.y)) * day;
            }
            // Arcades below: dark openings between columns, which catch a little light.
            let arcade = arch(Vec2::new(bay, p.y + 1.6), 1.55, 3.4);
            light *= 1.0 - 0.85 * ramp(0.0, 0.3, arcade);
        }
        _ if p.y < 0.0 => {
            // Flagstones, with the coloured light that the windows throw.
            let flag = (Vec2::new(p.x, p.z) * 0.8 - (Vec2::new(p.x, p.z) * 0.8).floor() - 0.5)
                .abs()
                .max_element();
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
    // Candles on stands to either side, most of them in front.
    for i in 0..14 {
        let side = if i % 2 == 0 { -1.0 } else { 1.0 };
        let row = (i / 2) as f32;
        let flame = Vec3::new(
            side * (2.7 + 0.25 * (row * 2.4).sin()),
            -0.45 + 0.12 * (row * 1.7).cos(),
            4.4 - 2.3 * row,
        );
        let off = direction.angle_between(flame);
        let wide = 0.045 / flame.length();
        seen += Vec3::new(1.0, 0.52, 0.17) * (1500.0 * (1.0 - ramp(0.6 * wide, wide, off)));
        seen += Vec3::new(1.0, 0.45, 0.13) * 0.5 * (-off * off / (30.0 * wide * wide)).exp();
        let near = (p - flame).length_squared();
        light += Vec3::new(1.0, 0.50, 0.18) * (0.35 / (near + 0.6));
    }
    let stone = Vec3::new(0.42, 0.38, 0.33) * stones;
    seen + stone * light
}

fn courtyard(direction: Vec3) -> Vec3 {
    let sun = Vec3::new(0.62, 0.62, 0.48).normalize();
    let (low, high) = (Vec3::new(-9.0, -1.6, -13.0), Vec3::new(9.0, 6.2, 11.0));
    let (p, axis) = wall(direction, low, Vec3::new(high.x, 1e4, high.z));
    if p.y > high.y || axis == 1 && p.y > 0.0 {
        return sky(direction, sun);
    }
    // What faces the sun is sun-lit, unless a wall throws its shadow there.
    let normal = [Vec3::X, Vec3::Y, Vec3::Z][axis]
        * if axis == 1 {
            1.0
        } else {
            -p.to_array()[axis].signum()
        };
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

/// A clear sky with a few clouds and the sun's disc.
fn sky(direction: Vec3, sun: Vec3) -> Vec3 {
    let height = direction.y.max(0.0);
    let off = direction.angle_between(sun);
    let blue = Vec3::new(1.25, 1.40, 1.55).lerp(Vec3::new(0.28, 0.55, 1.25), height.powf(0.45));
    let haze =
        Vec3::new(1.0, 0.92, 0.80) * (3.0 * (-off / 0.22).exp() + 14.0 * (-off / 0.05).exp());
    let p = direction / (direction.y + 0.12);
    let billow = 0.6 * noise(p * Vec3::new(1.4, 0.0, 1.4))
        + 0.3 * noise(p * Vec3::new(3.3, 0.0, 3.3) + 7.0)
        + 0.15 * noise(p * Vec3::new(7.0, 0.0, 7.0) + 3.0);
    let cloud = ramp(0.05, 0.5, billow);
    let lit = Vec3::splat(1.6) + Vec3::new(1.6, 1.5, 1.35) * (-off / 0.9).exp();
    // Half the sun's disc in angle is 0.266°; its irradiance here is some five times the sky's.
    let disc = if off < 0.00465 * 1.5 {
        Vec3::new(1.0, 0.93, 0.80) * 9e4
    } else {
        Vec3::ZERO
    };
    blue.lerp(lit, 0.85 * cloud) + haze + disc
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::color::luminance;
    use crate::light::latlong::texel_solid_angle;

    #[test]
    fn the_environments_are_light_with_a_wide_range() {
        for (name, image) in all() {
            assert!(
                image
                    .pixels
                    .iter()
                    .flatten()
                    .all(|v| v.is_finite() && *v > 0.0),
                "{name}"
            );
            let mut levels: Vec<f32> = image.pixels.iter().map(|&p| luminance(p)).collect();
            levels.sort_by(f32::total_cmp);
            let (median, brightest) = (levels[levels.len() / 2], levels[levels.len() - 1]);
            assert!(
                brightest > 500.0 * median,
                "{name}: {brightest} over {median}"
            );
            // Half floats hold it.
            assert!(brightest < 65_504.0, "{name}: {brightest}");
        }
    }

    #[test]
    fn the_sun_lights_the_courtyard_a_few_times_as_much_as_the_sky() {
        let image = panorama(courtyard);
        let mut flux = [0.0f64; 2];
        for (i, &p) in image.pixels.iter().enumerate() {
            let level = f64::from(luminance(p));
            flux[usize::from(level > 100.0)] +=
                level * texel_solid_angle(i / image.width, image.width, image.height);
        }
        let ratio = flux[1] / flux[0];
        assert!((0.3..8.0).contains(&ratio), "{ratio}");
    }
}
