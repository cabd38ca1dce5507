//! A patch of light on the sphere, drawn into a panorama with exact energy.
//!
//! A texel gets the sampled part of the patch inside it. The sum is then scaled to the patch's energy, so that
//! panorama size, poles and the seam do not change it.

use super::latlong::texel_solid_angle;
use glam::DVec3;
use imaging::Image;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Shape of a patch, in radians as seen from the subject.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outline {
    /// All directions up to this angle from the middle.
    Disc(f64),
    /// Half width and half height: angles from the middle along the horizontal and the vertical through it.
    Rectangle(f64, f64),
}

/// A patch of light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Patch {
    /// Azimuth φ of the middle in radians; see [`super::latlong`].
    pub azimuth: f64,
    /// Elevation of the middle above the horizon in radians.
    pub elevation: f64,
    pub outline: Outline,
    /// Outer part, 0 to 1, over which the light falls to zero.
    pub softness: f64,
}

/// Largest half side of a rectangle. Beyond it the two angles no longer give one direction.
const MAX_HALF_SIDE: f64 = 85.0 * PI / 180.0;

impl Patch {
    /// Adds light of ∫ L dω = `energy` per channel. A patch smaller than a texel is drawn one texel wide. The
    /// panorama gains exactly that energy, up to rounding of its values.
    pub fn add(&self, panorama: &mut Image, energy: [f64; 3]) {
        let (width, height) = panorama.size();
        if width == 0 || height == 0 || energy == [0.0; 3] {
            return;
        }
        let texel = (PI / height as f64).max(TAU / width as f64);
        let seen = DrawnPatch::new(self, 0.5 * texel);
        // A small moving patch must not jump visibly from sample to sample.
        let across = match seen.reach / texel {
            0.0..2.0 => 16,
            2.0..8.0 => 4,
            _ => 2,
        };
        let theta = FRAC_PI_2 - self.elevation;
        let row = |theta: f64| theta / PI * height as f64;
        let first = row(theta - seen.reach).floor().max(0.0) as usize;
        let last = (row(theta + seen.reach).ceil() as usize).min(height);
        // Columns that touch a cone around the middle; all columns if it contains a pole.
        let sine = seen.reach.sin() / theta.sin();
        let holds_pole = seen.reach >= theta.min(PI - theta) || seen.reach >= FRAC_PI_2;
        let columns = if holds_pole || sine >= 1.0 {
            None
        } else {
            let column = |azimuth: f64| (0.5 + azimuth / TAU) * width as f64;
            let from = column(self.azimuth - sine.asin()).floor() as i64;
            let count = column(self.azimuth + sine.asin()).ceil() as i64 - from;
            Some((from, (count.max(1) as usize).min(width)))
        };
        let (from, count) = columns.unwrap_or((0, width));
        let turns: Vec<(f64, f64)> = (0..count * across)
            .map(|i| {
                let column = (from * across as i64) as f64 + i as f64 + 0.5;
                (TAU * (column / (width * across) as f64 - 0.5)).sin_cos()
            })
            .collect();
        let parts: Vec<Vec<f64>> =
            (first..last).into_par_iter().map(|y| seen.row(y, height, &turns, across, width)).collect();
        let total: f64 = parts.iter().flatten().sum();
        if total <= 0.0 {
            return;
        }
        for (y, parts) in (first..last).zip(parts) {
            let solid_angle = texel_solid_angle(y, width, height);
            for (i, part) in parts.into_iter().enumerate().filter(|(_, part)| *part > 0.0) {
                let x = (from + i as i64).rem_euclid(width as i64) as usize;
                let share = part / (total * solid_angle);
                for (value, energy) in panorama.pixels[y * width + x].iter_mut().zip(energy) {
                    *value = (f64::from(*value) + energy * share) as f32;
                }
            }
        }
    }
}

/// A patch prepared for drawing.
struct DrawnPatch {
    middle: DVec3,
    right: DVec3,
    up: DVec3,
    outline: Outline,
    softness: f64,
    /// Largest angle from the middle to any part of the patch.
    reach: f64,
    /// Cosines of a disc's radius and of its fully bright part.
    cosines: (f64, f64),
    /// Tangents of a rectangle's half width and half height.
    tangents: (f64, f64),
}

impl DrawnPatch {
    /// The patch with every radius and half side at least `least`.
    fn new(patch: &Patch, least: f64) -> Self {
        let (sin_phi, cos_phi) = patch.azimuth.sin_cos();
        let (sin_up, cos_up) = patch.elevation.sin_cos();
        let softness = patch.softness.clamp(0.0, 1.0);
        let (mut cosines, mut tangents) = ((0.0, 0.0), (0.0, 0.0));
        let (outline, reach) = match patch.outline {
            Outline::Disc(radius) => {
                let radius = radius.clamp(least.min(PI), PI);
                cosines = (radius.cos(), (radius * (1.0 - softness)).cos());
                (Outline::Disc(radius), radius)
            }
            Outline::Rectangle(width, height) => {
                let side = |half: f64| half.clamp(least.min(MAX_HALF_SIDE), MAX_HALF_SIDE);
                let (width, height) = (side(width), side(height));
                tangents = (width.tan(), height.tan());
                let reach = tangents.0.hypot(tangents.1).atan();
                (Outline::Rectangle(width, height), reach)
            }
        };
        Self {
            middle: DVec3::new(cos_up * sin_phi, sin_up, -cos_up * cos_phi),
            right: DVec3::new(cos_phi, 0.0, sin_phi),
            up: DVec3::new(-sin_up * sin_phi, cos_up, sin_up * cos_phi),
            outline,
            softness,
            reach,
            cosines,
            tangents,
        }
    }

    /// Brightness of the patch in a unit direction, 0 to 1.
    fn level(&self, direction: DVec3) -> f64 {
        let ahead = direction.dot(self.middle);
        let (x, y) = (direction.dot(self.right), direction.dot(self.up));
        match self.outline {
            Outline::Disc(radius) => {
                // Most samples are clear of the edge and need no angle.
                if ahead < self.cosines.0 {
                    return 0.0;
                }
                if ahead > self.cosines.1 {
                    return 1.0;
                }
                // atan2 stays precise for discs as small as the sun.
                self.edge(x.hypot(y).atan2(ahead) / radius)
            }
            Outline::Rectangle(..) if ahead <= 0.0 => 0.0,
            Outline::Rectangle(width, height) => {
                if x.abs() > self.tangents.0 * ahead || y.abs() > self.tangents.1 * ahead {
                    return 0.0;
                }
                self.edge(x.abs().atan2(ahead) / width) * self.edge(y.abs().atan2(ahead) / height)
            }
        }
    }

    /// Brightness from the middle, 0, to the edge, 1.
    fn edge(&self, t: f64) -> f64 {
        match t {
            t if t >= 1.0 => 0.0,
            t if t <= 1.0 - self.softness => 1.0,
            t => {
                let t = (1.0 - t) / self.softness;
                t * t * (3.0 - 2.0 * t)
            }
        }
    }

    /// ∫ level dω over each texel of a row, from the sines and cosines of the samples' azimuths.
    fn row(&self, y: usize, height: usize, turns: &[(f64, f64)], across: usize, width: usize) -> Vec<f64> {
        let mut sums = vec![0.0; turns.len() / across];
        for row in y * across..(y + 1) * across {
            let theta = PI * (row as f64 + 0.5) / (height * across) as f64;
            let (sin_theta, cos_theta) = theta.sin_cos();
            let solid_angle = texel_solid_angle(row, width * across, height * across);
            for (sum, turns) in sums.iter_mut().zip(turns.chunks_exact(across)) {
                for (sin_phi, cos_phi) in turns {
                    let direction = DVec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi);
                    *sum += solid_angle * self.level(direction);
                }
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Environment;
    use crate::latlong::texel_direction;
    use proptest::prelude::*;

    fn drawn(patch: Patch, size: (usize, usize)) -> Image {
        let mut image = Image::filled(size.0, size.1, [0.0; 3]);
        patch.add(&mut image, [3.0, 2.0, 0.5]);
        image
    }

    fn any_outline() -> impl Strategy<Value = Outline> {
        prop_oneof![
            (0.0f64..3.2).prop_map(Outline::Disc),
            (0.0f64..1.6, 0.0f64..1.6).prop_map(|(a, b)| Outline::Rectangle(a, b)),
        ]
    }

    proptest! {
        #[test]
        fn a_patch_has_its_energy_wherever_it_is(
            azimuth in -7.0f64..7.0, elevation in -FRAC_PI_2..FRAC_PI_2, outline in any_outline(),
            softness in 0.0f64..1.0, w in 1usize..90, h in 1usize..60,
        ) {
            let patch = Patch { azimuth, elevation, outline, softness };
            let energy = Environment::from_radiance("", drawn(patch, (w, h))).energy();
            for (energy, wanted) in energy.into_iter().zip([3.0, 2.0, 0.5]) {
                prop_assert!((energy - wanted).abs() < 1e-6 * wanted, "{energy} is not {wanted}");
            }
        }

        #[test]
        fn the_light_comes_from_where_the_patch_is(
            azimuth in -3.2f64..3.2, elevation in -FRAC_PI_2..FRAC_PI_2, square in any::<bool>(),
        ) {
            let outline = if square { Outline::Rectangle(0.2, 0.2) } else { Outline::Disc(0.2) };
            let image = drawn(Patch { azimuth, elevation, outline, softness: 0.3 }, (256, 128));
            let mut sum = DVec3::ZERO;
            for (i, pixel) in image.pixels.iter().enumerate() {
                let energy = f64::from(pixel[0]) * texel_solid_angle(i / 256, 256, 128);
                sum += energy * texel_direction(i % 256, i / 256, 256, 128).as_dvec3();
            }
            let middle = DVec3::new(
                elevation.cos() * azimuth.sin(), elevation.sin(), -elevation.cos() * azimuth.cos(),
            );
            // A fiftieth of a texel of 1.4°.
            prop_assert!(sum.angle_between(middle) < 5e-4, "{sum} for {middle}");
        }
    }

    #[test]
    fn a_disc_covers_its_solid_angle() {
        let disc = Patch { azimuth: 0.4, elevation: 0.3, outline: Outline::Disc(0.5), softness: 0.0 };
        let image = drawn(disc, (1024, 512));
        let level = image.pixels.iter().map(|p| f64::from(p[0])).fold(0.0, f64::max);
        let solid_angle = TAU * (1.0 - 0.5f64.cos());
        assert!((level * solid_angle / 3.0 - 1.0).abs() < 2e-3, "{level}");
    }

    #[test]
    fn a_patch_that_moves_a_hundredth_of_a_texel_does_not_jump() {
        let at = |azimuth: f64, elevation: f64| {
            drawn(Patch { azimuth, elevation, outline: Outline::Disc(0.001), softness: 0.5 }, (64, 32))
        };
        let step = PI / 32.0 / 100.0;
        for i in 0..100 {
            let (a, b) = (at(step * f64::from(i), 0.3), at(step * f64::from(i + 1), 0.3));
            let moved: f64 = a
                .pixels
                .iter()
                .zip(&b.pixels)
                .enumerate()
                .map(|(i, (a, b))| f64::from((a[0] - b[0]).abs()) * texel_solid_angle(i / 64, 64, 32))
                .sum();
            // The disc moves by a hundredth of its width, its samples by sixteenths.
            assert!(moved / 3.0 < 0.06, "step {i} moved {moved} of 3");
        }
    }
}
