//! Matte from a clean plate: a picture of the background without the subject.

use super::cut::{ROUNDS, Reduced};
use super::grab_cut::{Known, Mark, grab_cut_knowing};
use super::parts::clean;
use super::screen::upper_border;
use super::{Matte, linear, quantile, spread, window};
use base::error::{Error, Result};
use imaging::color::srgb_from_linear;
use imaging::resample::resize_area;
use imaging::{Encoded, Raster};
use rayon::prelude::*;

/// Smallest light with a meaningful logarithm.
const DARK: f32 = 2e-3;
/// Codes between black and clipping.
const READABLE: std::ops::Range<f32> = 0.02..0.97;
/// Possible offset of the plate in pixels at the size of the cut.
const OFF_PX: f32 = 0.25;
/// Smallest noise in codes: rounding and compression.
const LEAST_NOISE: f32 = 1.0;
/// Number of brightness levels of the noise measurement, and smallest number of pixels in each.
const LEVELS: usize = 12;
const ENOUGH: usize = 60;
/// Mean square difference, over channels and neighbours, of a pixel that differs, in variances.
const DIFFERENT: f32 = 6.0;
/// Smallest share of a picture that must show the plate's background.
const LEAST_SHOWN: f32 = 0.1;

/// Matte of a picture from a clean plate: a picture of the same view without the subject, possibly at another
/// exposure. The difference to it, relative to the noise of both pictures, replaces the background's colours in
/// GrabCut (as in Sun et al. 2006, "Background Cut"). At edges, coverage is measured against the plate's own
/// pixels.
///
/// # Errors
/// If the sizes differ, or the picture does not show the plate's background.
pub fn by_clean_plate(picture: &Encoded, plate: &Encoded) -> Result<Matte> {
    let size = picture.0.size();
    if plate.0.size() != size {
        return Err(Error::other_size(
            ("the clean plate", plate.0.size()),
            ("the picture", size),
            "Use a clean plate from the same camera at the same size",
        ));
    }
    let reduced = Reduced::from_picture(picture);
    let small = reduced.small.0.size();
    let light = resize_area(&reduced.light, small.0, small.1);
    let plate = Raster { width: size.0, height: size.1, pixels: linear(plate) };
    let small_plate = resize_area(&plate, small.0, small.1);
    let exposure = Exposure::new(&light, &small_plate)?;
    let behind = Raster { pixels: exposure.exposed(&small_plate.pixels), ..small_plate };
    let difference = Difference::new(&reduced.small, &behind);
    let different: Vec<bool> = difference.squares.iter().map(|&d| d > DIFFERENT).collect();
    let shown = different.iter().filter(|d| !**d).count() as f32 / different.len().max(1) as f32;
    if shown < LEAST_SHOWN {
        return Err(unlike(shown));
    }
    let mut cut = different.clone();
    clean(&mut cut, small, |i| !different[i]);
    if cut.contains(&true) {
        let marks = Raster {
            width: small.0,
            height: small.1,
            pixels: (cut.iter())
                .map(|&subject| if subject { Mark::MaybeSubject } else { Mark::MaybeBackground })
                .collect(),
        };
        let known = Known { behind: Some(&difference.costs), ..Known::default() };
        cut = grab_cut_knowing(&reduced.small, &marks, &known, ROUNDS)?.subject.pixels;
        clean(&mut cut, small, |i| !different[i]);
    }
    Ok(reduced.matte(&cut, Some(&exposure.exposed(&plate.pixels))))
}

fn unlike(shown: f32) -> Error {
    Error::missing(
        format!("only {:.0} % of the picture matches the clean plate", 100.0 * shown),
        "Use a clean plate of the same view: the camera must not have moved or zoomed since",
    )
}

/// Mapping from the plate's light to the picture's: a linear function of the logarithm per channel, which covers
/// changes of exposure, white balance and gamma.
struct Exposure([[f32; 2]; 3]);

impl Exposure {
    fn new(light: &Raster<[f32; 3]>, plate: &Raster<[f32; 3]>) -> Result<Self> {
        let log = |p: [f32; 3]| p.map(|v| v.max(DARK).ln());
        let pairs: Vec<Option<[[f32; 3]; 2]>> = (light.pixels.iter().zip(&plate.pixels))
            .map(|(&a, &b)| {
                let readable = |p: [f32; 3]| p.iter().all(|&v| v >= DARK && READABLE.contains(&srgb_from_linear(v)));
                (readable(a) && readable(b)).then(|| [log(a), log(b)])
            })
            .collect();
        // The subject is seldom at the upper border.
        let border = upper_border(light.size());
        let steps = |c: usize| -> Vec<f32> {
            let known = border.iter().filter_map(|&i| pairs[i]);
            known.map(|[a, b]| a[c] - b[c]).collect()
        };
        let mut lines = [[0.0, 1.0]; 3];
        for (c, line) in lines.iter_mut().enumerate() {
            line[0] = quantile(steps(c), 0.5).unwrap_or(0.0);
        }
        for _ in 0..6 {
            let off = |[a, b]: [[f32; 3]; 2], c: usize| a[c] - lines[c][0] - lines[c][1] * b[c];
            let on_border = |c: usize| border.iter().filter_map(|&i| pairs[i]).map(move |p| (p, c));
            let limits = [0, 1, 2].map(|c| {
                let noise = spread(on_border(c).map(|(p, c)| off(p, c)), 0.0);
                3.0 * noise.clamp(0.02, 0.2)
            });
            let alike: Vec<_> =
                (pairs.iter().flatten()).filter(|p| (0..3).all(|c| off(**p, c).abs() < limits[c])).collect();
            let mut next = lines;
            for (c, line) in next.iter_mut().enumerate() {
                let count = alike.len().max(1) as f32;
                let mean = |k: usize| alike.iter().map(|p| p[k][c]).sum::<f32>() / count;
                let (a, b) = (mean(0), mean(1));
                let both: f32 = alike.iter().map(|p| (p[0][c] - a) * (p[1][c] - b)).sum();
                let own: f32 = alike.iter().map(|p| (p[1][c] - b).powi(2)).sum();
                // A uniform background does not determine the slope; it is 1 then.
                let slope = (both + 0.02 * count) / (own + 0.02 * count);
                let slope = slope.clamp(0.6, 1.6);
                *line = [a - slope * b, slope];
            }
            if !alike.is_empty() {
                lines = next;
            }
        }
        Ok(Self(lines))
    }

    fn exposed(&self, plate: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let exposed = |p: &[f32; 3]| {
            std::array::from_fn(|c| {
                let [step, slope] = self.0[c];
                // Darker values continue in proportion.
                let log = p[c].max(DARK).ln();
                let light = (step + slope * log).exp() * (p[c] / DARK).min(1.0);
                light.clamp(0.0, 1.0)
            })
        };
        plate.par_iter().map(exposed).collect()
    }
}

/// Difference of each pixel from the plate.
struct Difference {
    /// Mean square over channels and the 3 × 3 pixels around, in variances.
    squares: Vec<f32>,
    /// Cost of each colour as the plate's: minus the logarithm of its density in codes.
    costs: Vec<f32>,
}

impl Difference {
    fn new(picture: &Encoded, behind: &Raster<[f32; 3]>) -> Self {
        let size = picture.0.size();
        let codes = behind.map(|p| p.map(|v| 255.0 * srgb_from_linear(v)));
        let errors: Vec<[f32; 3]> = (picture.0.pixels.iter().zip(&codes.pixels))
            .map(|(a, b)| {
                std::array::from_fn(|c| {
                    let off = 255.0 * a[c] - b[c];
                    if off.is_finite() { off } else { 255.0 }
                })
            })
            .collect();
        let noise = Noise::new(&errors, &codes.pixels);
        let (width, height) = size;
        let variance = |i: usize| -> [f32; 3] {
            let (x, y) = (i % width, i / width);
            let (left, right) = (codes.at(x.saturating_sub(1), y), codes.at((x + 1).min(width - 1), y));
            let (above, below) = (codes.at(x, y.saturating_sub(1)), codes.at(x, (y + 1).min(height - 1)));
            std::array::from_fn(|c| {
                let slope = (0.5 * (right[c] - left[c])).powi(2) + (0.5 * (below[c] - above[c])).powi(2);
                noise.variance(codes.pixels[i][c]) + OFF_PX * OFF_PX * slope
            })
        };
        let told: Vec<([f32; 1], f32)> = (0..errors.len())
            .into_par_iter()
            .map(|i| {
                let variance = variance(i);
                let square: f32 = (0..3).map(|c| errors[i][c].powi(2) / variance[c]).sum();
                let level: f32 = variance.iter().map(|v| v.ln()).sum();
                ([square / 3.0], 0.5 * (square + level))
            })
            .collect();
        let (squares, costs): (Vec<_>, Vec<_>) = told.into_iter().unzip();
        let count = window::counts(size, 1);
        let squares = window::sums(&squares, size, 1);
        Self { squares: (0..squares.len()).map(|i| squares[i][0] / count(i)).collect(), costs }
    }
}

/// Standard deviation of differences, by brightness, because noise depends on light.
struct Noise([f32; LEVELS]);

impl Noise {
    fn level(code: f32) -> usize {
        ((code / 256.0 * LEVELS as f32) as usize).min(LEVELS - 1)
    }

    fn new(errors: &[[f32; 3]], codes: &[[f32; 3]]) -> Self {
        let mut levels = vec![Vec::new(); LEVELS];
        let mut all = Vec::new();
        for (error, code) in errors.iter().zip(codes) {
            for c in 0..3 {
                levels[Self::level(code[c])].push(error[c]);
                all.push(error[c]);
            }
        }
        // The subject's differences are large, so the quarter with the smallest differences gives the noise. A
        // quarter of a normal distribution is within 0.3186 standard deviations.
        let deviation = |values: Vec<f32>| {
            let sizes = values.into_iter().map(f32::abs).collect();
            quantile(sizes, 0.25).unwrap_or(0.0) / 0.3186
        };
        let overall = deviation(all).max(LEAST_NOISE);
        let mut noise = [overall; LEVELS];
        for (noise, values) in noise.iter_mut().zip(levels) {
            if values.len() >= ENOUGH {
                // A level mostly hidden by the subject reflects more than the noise.
                *noise = deviation(values).clamp(LEAST_NOISE, 2.0 * overall);
            }
        }
        Self(noise)
    }

    fn variance(&self, code: f32) -> f32 {
        self.0[Self::level(code)].powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{round, scores};
    use imaging::color::unit;
    use test_support::shown;

    /// A wall with pictures, stripes and a window.
    fn wall(x: usize, y: usize, (width, height): (usize, usize)) -> [f32; 3] {
        let (u, v) = (x as f32 / width as f32, y as f32 / height as f32);
        let stripes = 0.06 * (40.0 * u).sin() + 0.05 * (23.0 * v + 9.0 * u).sin();
        let base = match () {
            () if (0.1..0.3).contains(&u) && (0.2..0.6).contains(&v) => [0.45, 0.3, 0.2],
            () if (0.62..0.9).contains(&u) && (0.15..0.5).contains(&v) => [0.6, 0.7, 0.8],
            () => [0.25, 0.28, 0.22],
        };
        base.map(|b| (b + stripes).clamp(0.02, 1.0))
    }

    fn noise(x: usize, y: usize, seed: u32) -> f32 {
        let mixed = [x as u32, y as u32, seed]
            .iter()
            .fold(0x9e37_79b9_u32, |h, &v| (h ^ v).wrapping_mul(0x85eb_ca6b).rotate_left(13));
        (mixed >> 8) as f32 / 16_777_216.0 - 0.5
    }

    #[test]
    fn a_clean_plate_tells_a_subject_before_a_wall_with_its_own_colours() {
        let mut worst = (1.0_f32, 0.0_f32);
        for size in [(220, 160), (1000, 700)] {
            for (gain, gamma, grain) in [(1.0, 1.0, 0.0), (0.7, 1.0, 0.02), (1.25, 1.1, 0.03)] {
                let (_, truth) = round(size, [0.0; 3], [0.0; 3]);
                let seen = |light: f32, x: usize, y: usize, seed: u32| {
                    unit(srgb_from_linear(light) + grain * noise(x, y, seed))
                };
                let plate = Encoded(Raster::from_fn(size.0, size.1, |x, y| {
                    wall(x, y, size).map(|v| seen(gain * v.powf(gamma), x, y, 1))
                }));
                let picture = Encoded(Raster::from_fn(size.0, size.1, |x, y| {
                    let a = truth.at(x, y);
                    let wall = wall(x, y, size);
                    // Skin on one side, cloth in the wall's colour on the other.
                    let subject = if x > size.0 / 2 { [0.5, 0.3, 0.2] } else { [0.12, 0.1, 0.2] };
                    let mix = |c: usize| a * subject[c] + (1.0 - a) * wall[c];
                    std::array::from_fn(|c| seen(mix(c), x, y, 2 + c as u32))
                }));
                let found = by_clean_plate(&picture, &plate).unwrap();
                let (iou, off) = scores(&found.mask, &truth);
                println!("{size:?} {gain} {gamma} {grain}: IoU {iou:.4}, error {off:.5}");
                worst = (worst.0.min(iou), worst.1.max(off));
            }
        }
        assert!(worst.0 >= 0.985 && worst.1 <= 0.01, "{worst:?}");
        shown!(Pictures, "A noisy clean plate of a wall with pictures on it, at another exposure",
            bound: "IoU 0.985, mean error 0.01",
            measured: format!("IoU {:.3}, mean error {:.4}", worst.0, worst.1));
    }

    #[test]
    fn an_empty_picture_has_an_empty_matte_and_another_place_is_refused() {
        let size = (200, 150);
        let plate = Encoded(Raster::from_fn(200, 150, |x, y| wall(x, y, size).map(srgb_from_linear)));
        let empty = by_clean_plate(&plate, &plate).unwrap();
        assert!(empty.mask.pixels.iter().all(|a| *a == 0.0));
        let other = Encoded(Raster::from_fn(200, 150, |x, y| {
            [0.5 + noise(x, y, 5), 0.5 + noise(x, y, 6), 0.5 + noise(x, y, 7)]
        }));
        match by_clean_plate(&other, &plate) {
            Ok(found) => assert!(found.mask.pixels.iter().all(|a| (0.0..=1.0).contains(a))),
            Err(e) => assert!(e.to_string().contains("same view"), "{e}"),
        }
        let small = Encoded(Raster::filled(20, 15, [0.5; 3]));
        let said = by_clean_plate(&plate, &small).unwrap_err().to_string();
        assert!(said.contains("20 × 15") && said.contains("200 × 150"), "{said}");
        for size in [(1, 1), (2, 1), (9, 7)] {
            for value in [0.5, f32::NAN] {
                let even = Encoded(Raster::filled(size.0, size.1, [value; 3]));
                if let Ok(matte) = by_clean_plate(&even, &even) {
                    assert!(matte.mask.pixels.iter().all(|a| (0.0..=1.0).contains(a)));
                }
            }
        }
    }
}
