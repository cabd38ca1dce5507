//! An environment: radiance from every direction as a lat-long panorama.

use super::latlong::{texel_solid_angle, uv_from_direction};
use glam::Vec3;
use imaging::{Image, resample::resize_area};

/// Largest radiance, eleven powers of ten above the sun. Keeps products with weights and exposures, and sums over a
/// picture, within f32.
const MOST_RADIANCE: f32 = 1e20;

/// Largest finite half float. Replaces infinity in a panorama without finite light.
pub(super) const HALF_MAX: f32 = 65504.0;

/// A lat-long panorama of radiance, free of NaN, negative, infinite and absurdly large values.
#[derive(Clone, Debug)]
pub struct Environment {
    /// The file's stem.
    pub name: String,
    /// Radiance from 0 to 10²⁰, at any size.
    pub radiance: Image,
    /// Number of repaired texels: NaN, negative or above 10²⁰.
    pub repaired_texels: usize,
}

impl Environment {
    /// Builds an environment from a panorama in memory. Repairs and counts invalid values. Negative values (a
    /// filter's ringing) become 0. +∞ and values above 10²⁰ become the largest value below 10²⁰. NaN becomes the
    /// median of its neighbours, which a single sun does not raise.
    pub fn from_radiance(name: impl Into<String>, mut radiance: Image) -> Self {
        let is_light = |v: f32| (0.0..=MOST_RADIANCE).contains(&v);
        let broken: Vec<usize> =
            (0..radiance.pixels.len()).filter(|&i| !radiance.pixels[i].into_iter().all(is_light)).collect();
        if !broken.is_empty() {
            let finite = radiance.pixels.iter().flatten().copied().filter(|&v| is_light(v));
            let brightest = match finite.fold(0.0, f32::max) {
                0.0 => HALF_MAX,
                value => value,
            };
            let repaired: Vec<[f32; 3]> = broken
                .iter()
                .map(|&i| {
                    std::array::from_fn(|c| match radiance.pixels[i][c] {
                        v if is_light(v) => v,
                        v if v.is_nan() => median_of_neighbours(&radiance, i, c),
                        v if v > 0.0 => brightest,
                        _ => 0.0,
                    })
                })
                .collect();
            for (&i, pixel) in broken.iter().zip(repaired) {
                radiance.pixels[i] = pixel;
            }
        }
        Self { name: name.into(), radiance, repaired_texels: broken.len() }
    }

    /// ∫ E dω over the sphere, per channel.
    pub fn energy(&self) -> [f64; 3] {
        let (width, height) = self.radiance.size();
        let mut energy = [0.0; 3];
        for (y, row) in self.radiance.pixels.chunks_exact(width.max(1)).enumerate() {
            let solid_angle = texel_solid_angle(y, width, height);
            for (c, sum) in energy.iter_mut().enumerate() {
                *sum += solid_angle * row.iter().map(|p| f64::from(p[c])).sum::<f64>();
            }
        }
        energy
    }

    /// Panorama resized to `width × width/2` texels (at least one row), averaged by solid angle, which preserves
    /// energy. Enlarging repeats texels.
    pub fn reduced(&self, width: usize) -> Self {
        let height = (width / 2).max(1);
        let source = self.radiance.height;
        if self.radiance.size() == (width, height) {
            return self.clone();
        }
        // All texels of a row have the same solid angle, so columns are a plain box filter.
        let columns = resize_area(&self.radiance, width, source);
        let mut radiance = Image::filled(width, height, [0.0; 3]);
        for (y, out) in radiance.pixels.chunks_exact_mut(width).enumerate() {
            // Rows y and y + 1 of the target, in units of source rows:
            let (top, bottom) =
                (y as f64 * source as f64 / height as f64, (y + 1) as f64 * source as f64 / height as f64);
            let mut sums = vec![[0.0f64; 3]; width];
            for from in (top as usize)..(bottom.ceil() as usize).min(source) {
                let share =
                    band((from as f64).max(top), (from as f64 + 1.0).min(bottom), source) / band(top, bottom, source);
                for (sum, pixel) in sums.iter_mut().zip(&columns.pixels[from * width..(from + 1) * width]) {
                    for c in 0..3 {
                        sum[c] += share * f64::from(pixel[c]);
                    }
                }
            }
            for (out, sum) in out.iter_mut().zip(sums) {
                *out = sum.map(|v| v as f32);
            }
        }
        Self { name: self.name.clone(), radiance, repaired_texels: self.repaired_texels }
    }

    /// Radiance from a direction of any non-zero length: bilinear, across the seam and the poles.
    pub fn radiance(&self, direction: Vec3) -> [f32; 3] {
        let (width, height) = self.radiance.size();
        let (u, v) = uv_from_direction(direction);
        let (x, y) = (u * width as f32 - 0.5, v * height as f32 - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let texel = |dx: i64, dy: i64| {
            // A step across a pole lands half a turn away.
            let (row, rows) = (y.floor() as i64 + dy, height as i64);
            let (row, turn) = if row < 0 {
                (0, width / 2)
            } else if row >= rows {
                (height - 1, width / 2)
            } else {
                (row as usize, 0)
            };
            let column = (x.floor() as i64 + dx + turn as i64).rem_euclid(width as i64);
            self.radiance.at(column as usize, row)
        };
        let [a, b, c, d] = [texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)];
        std::array::from_fn(|i| (1.0 - fy) * ((1.0 - fx) * a[i] + fx * b[i]) + fy * ((1.0 - fx) * c[i] + fx * d[i]))
    }
}

/// cos θ_top − cos θ_bottom of the band between two rows of a panorama with `rows` rows; see [`texel_solid_angle`].
pub(super) fn band(top: f64, bottom: f64, rows: usize) -> f64 {
    let step = std::f64::consts::PI / rows as f64;
    (0.5 * (top + bottom) * step).sin() * (0.5 * (bottom - top) * step).sin()
}

/// Median of channel `c` among the valid texels of the eight neighbours of texel `i`; 0 without any.
fn median_of_neighbours(image: &Image, i: usize, c: usize) -> f32 {
    let (width, height) = image.size();
    let (x, y) = (i % width, i / width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    let mut values: Vec<f32> = rows
        .flat_map(|row| [width - 1, 0, 1].map(|dx| image.at((x + dx) % width, row)[c]))
        .filter(|v| (0.0..=MOST_RADIANCE).contains(v))
        .collect();
    values.sort_by(f32::total_cmp);
    values.get(values.len().saturating_sub(1) / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::latlong::texel_direction;
    use super::*;
    use proptest::prelude::*;
    use test_support::shown;

    fn speckled(width: usize, height: usize, seed: usize) -> Environment {
        let image = Image::from_fn(width, height, |x, y| {
            [0, 1, 2].map(|c| ((x * 31 + y * 17 + c * 7 + seed * 13) % 97) as f32 / 50.0)
        });
        Environment::from_radiance("speckled", image)
    }

    fn assert_same_energy(a: &Environment, b: &Environment) {
        for (a, b) in a.energy().into_iter().zip(b.energy()) {
            assert!((a - b).abs() <= 2e-6 * a, "{a} became {b}");
        }
    }

    proptest! {
        #[test]
        fn a_change_of_size_keeps_the_energy(w in 1usize..80, h in 1usize..50, to in 1usize..60, seed in 0usize..50) {
            let environment = speckled(w, h, seed);
            assert_same_energy(&environment, &environment.reduced(to));
        }
    }

    #[test]
    fn a_uniform_sky_has_four_pi_of_energy() {
        let sky = Environment::from_radiance("sky", Image::filled(37, 19, [1.0, 2.0, 0.0]));
        let [r, g, b] = sky.energy();
        assert!((r - 4.0 * std::f64::consts::PI).abs() < 1e-9 && (g - 2.0 * r).abs() < 1e-9 && b == 0.0);
    }

    #[test]
    fn a_sun_in_one_texel_keeps_its_energy() {
        for (x, y) in [(0, 0), (1023, 511), (511, 255), (3, 100)] {
            let mut image = Image::filled(1024, 512, [0.25; 3]);
            image.pixels[y * 1024 + x] = [1e6; 3];
            let day = Environment::from_radiance("day", image);
            assert_same_energy(&day, &day.reduced(128));
            assert_same_energy(&day, &day.reduced(100));
        }
        shown!(Light, "Reducing a panorama with a sun of 10⁶ in one texel",
            bound: "energy within 2e-6", measured: "holds");
    }

    #[test]
    fn values_that_are_not_light_are_repaired_and_counted() {
        let mut image = Image::filled(8, 4, [1.0; 3]);
        image.pixels[0] = [f32::NAN, 1.0, 1.0];
        image.pixels[1] = [900.0; 3];
        image.pixels[9] = [f32::INFINITY, 2.0, -0.5];
        image.pixels[20] = [f32::NEG_INFINITY; 3];
        let repaired = Environment::from_radiance("broken", image);
        assert_eq!(repaired.repaired_texels, 3);
        assert_eq!(repaired.radiance.pixels[0], [1.0; 3]);
        assert_eq!(repaired.radiance.pixels[9], [900.0, 2.0, 0.0]);
        assert_eq!(repaired.radiance.pixels[20], [0.0; 3]);
        shown!(Light, "NaN, ±∞ and negative texels in a panorama",
            bound: "every other texel unchanged", measured: "exactly");
    }

    #[test]
    fn a_panorama_of_nothing_but_nan_is_black() {
        let image = Image::filled(4, 2, [f32::NAN; 3]);
        let black = Environment::from_radiance("nan", image);
        assert_eq!((black.repaired_texels, black.energy()), (8, [0.0; 3]));
    }

    #[test]
    fn a_look_at_a_texel_gives_that_texel() {
        let environment = speckled(16, 8, 3);
        for (x, y) in [(0, 0), (15, 0), (7, 3), (0, 7), (15, 4)] {
            let seen = environment.radiance(2.0 * texel_direction(x, y, 16, 8));
            for (seen, is) in seen.iter().zip(environment.radiance.at(x, y)) {
                assert!((seen - is).abs() < 1e-4, "({x}, {y}): {seen} is not {is}");
            }
        }
    }

    #[test]
    fn nothing_jumps_at_the_seam_or_the_poles() {
        let environment = speckled(16, 8, 1);
        for (a, b) in [
            (Vec3::new(1e-4, 0.1, 1.0), Vec3::new(-1e-4, 0.1, 1.0)),
            (Vec3::new(1e-4, 1.0, 2e-4), Vec3::new(-1e-4, 1.0, -2e-4)),
            (Vec3::new(1e-4, -1.0, 2e-4), Vec3::new(-1e-4, -1.0, -2e-4)),
        ] {
            for (a, b) in environment.radiance(a).iter().zip(environment.radiance(b)) {
                assert!((a - b).abs() < 5e-3, "{a} beside {b}");
            }
        }
    }

    #[test]
    fn a_panorama_of_the_shared_data_is_read() {
        let Some(path) = test_support::shared("data/hdri/probulator_pisa.hdr") else { return };
        let pisa = crate::panorama::load(&path).unwrap();
        assert_eq!((pisa.name.as_str(), pisa.repaired_texels), ("probulator_pisa", 0));
        assert_same_energy(&pisa, &pisa.reduced(128));
    }
}
