//! Motion of the picture from one frame to another, and mattes carried along it.

use super::refine::FLAT;
use super::{linear, quantile, window};
use imaging::color::{srgb_from_linear, unit};
use imaging::resample::{resize, resize_area};
use imaging::{Encoded, Mask, Raster};
use rayon::prelude::*;

/// Longer side of the pictures used for motion.
const SIDE: usize = 480;
/// Largest variance of encoded values that counts as noise: a standard deviation of one in twenty.
pub const MOST_NOISE: f32 = 2.5e-3;
/// Largest ratio of a frame's difference from the next, along the motion, to its noise.
const FOLLOWS: f32 = 2.5;
/// Noise at least, in encoded values: a step of eight bits.
const QUIET: f32 = 1.0 / 255.0;
/// Half the side of a window with uniform motion.
const RADIUS: usize = 3;
/// Steps at each pyramid size.
const STEPS: usize = 4;
/// Shortest side of the smallest pyramid picture.
const LEAST: usize = 12;

/// The picture used for motion: encoded values at a small size.
pub fn flow_picture(picture: &Encoded) -> Encoded {
    let (width, height) = picture.0.size();
    let longer = width.max(height).max(1);
    if longer <= SIDE {
        return Encoded(picture.0.map(|p| p.map(unit)));
    }
    let side = |full: usize| (full * SIDE).div_ceil(longer);
    let light = Raster { width, height, pixels: linear(picture) };
    let small = resize_area(&light, side(width), side(height));
    Encoded(small.map(|p| p.map(srgb_from_linear)))
}

/// Place of each pixel of one frame in another.
#[derive(Clone, Debug, PartialEq)]
pub struct Flow {
    /// Shifts to the right and down, in pixels of the motion pictures.
    shifts: Raster<[f32; 2]>,
    /// Confidence in each shift, in `[0, 1]`: 1 if the match is within the pictures' noise.
    trust: Mask,
    /// False for a cut or another pose: most pixels have no match within the picture's noise.
    follows: bool,
}

impl Flow {
    /// Motion from one frame to another, both made by [`flow_picture`] from pictures of one size: least squares of
    /// the difference in windows of 7 × 7 pixels (Lucas and Kanade 1981), from coarse to fine (Bouguet 2001), over
    /// all three channels. Windows without detail follow the coarser ones around them.
    pub fn between(from: &Encoded, to: &Encoded) -> Self {
        let pyramid = |picture: &Encoded| {
            let mut levels = vec![picture.0.clone()];
            while let Some(finest) = levels.last()
                && finest.width.min(finest.height) >= 2 * LEAST
            {
                let (w, h) = (finest.width.div_ceil(2), finest.height.div_ceil(2));
                levels.push(resize_area(finest, w, h));
            }
            levels
        };
        let (from, to) = (pyramid(from), pyramid(to));
        let mut shifts: Option<Raster<[f32; 2]>> = None;
        for (from, to) in from.iter().zip(&to).rev() {
            let (width, height) = from.size();
            let start = match &shifts {
                None => Raster::filled(width, height, [0.0; 2]),
                Some(coarse) => scaled(coarse, (width, height)),
            };
            shifts = Some(refined(from, to, start));
        }
        let (from, to) = (&from[0], &to[0]);
        let shifts = shifts.unwrap_or_else(|| Raster::filled(from.width, from.height, [0.0; 2]));
        let (trust, apart) = trust(from, to, &shifts);
        let follows = apart <= FOLLOWS * noise(from).max(QUIET);
        Self { shifts, trust, follows }
    }

    /// Confidence in each shift, in `[0, 1]`, at the size used for motion.
    pub fn trust(&self) -> &Mask {
        &self.trust
    }

    /// False for a cut or another pose: most pixels have no match within the picture's noise.
    pub fn follows(&self) -> bool {
        self.follows
    }

    /// The other frame's values warped to this frame: each pixel is read at its shifted place (bilinear; the border
    /// is repeated). The values may have any size.
    pub fn warped<const N: usize>(&self, other: &Raster<[f32; N]>) -> Raster<[f32; N]> {
        let (width, height) = other.size();
        let shifts = scaled(&self.shifts, (width, height));
        let pixels = (0..width * height).into_par_iter().map(|i| {
            let [dx, dy] = shifts.pixels[i];
            sample(other, (i % width) as f32 + dx, (i / width) as f32 + dy)
        });
        Raster { width, height, pixels: pixels.collect() }
    }

    /// [`warped`](Self::warped) of a matte.
    pub fn warped_mask(&self, other: &Mask) -> Mask {
        self.warped(&other.map(|v| [v])).map(|[v]| v)
    }

    /// The flow followed by `next`, which starts where this one ends.
    pub fn then(&self, next: &Self) -> Self {
        let further = self.warped(&next.shifts);
        let trust = self.warped_mask(&next.trust);
        let both = self.shifts.pixels.iter().zip(&further.pixels);
        Self {
            shifts: Raster { pixels: both.map(|(a, b)| [a[0] + b[0], a[1] + b[1]]).collect(), ..self.shifts },
            trust: Mask {
                pixels: (self.trust.pixels.iter().zip(&trust.pixels)).map(|(a, b)| a * b).collect(),
                ..self.trust
            },
            follows: self.follows && next.follows,
        }
    }
}

/// Shifts at another size, in pixels of that size.
fn scaled(shifts: &Raster<[f32; 2]>, (width, height): (usize, usize)) -> Raster<[f32; 2]> {
    let (sx, sy) = (width as f32 / shifts.width.max(1) as f32, height as f32 / shifts.height.max(1) as f32);
    if shifts.size() == (width, height) {
        return shifts.clone();
    }
    let [x, y] = [0, 1].map(|c| resize(&shifts.map(|s| s[c]), width, height));
    Raster { width, height, pixels: (x.pixels.iter().zip(&y.pixels)).map(|(x, y)| [x * sx, y * sy]).collect() }
}

/// A value between pixels; a NaN place reads the first pixel.
fn sample<const N: usize>(grid: &Raster<[f32; N]>, x: f32, y: f32) -> [f32; N] {
    let inside = |at: f32, length: usize| at.clamp(0.0, (length - 1) as f32);
    let (x, y) = (inside(x, grid.width), inside(y, grid.height));
    let (left, top) = (x as usize, y as usize);
    let (right, bottom) = ((left + 1).min(grid.width - 1), (top + 1).min(grid.height - 1));
    let (fx, fy) = (x - left as f32, y - top as f32);
    let (a, b, c, d) = (grid.at(left, top), grid.at(right, top), grid.at(left, bottom), grid.at(right, bottom));
    std::array::from_fn(|i| (1.0 - fy) * ((1.0 - fx) * a[i] + fx * b[i]) + fy * ((1.0 - fx) * c[i] + fx * d[i]))
}

fn refined(from: &Raster<[f32; 3]>, to: &Raster<[f32; 3]>, mut shifts: Raster<[f32; 2]>) -> Raster<[f32; 2]> {
    let size = from.size();
    let (width, height) = size;
    let slopes: Vec<[[f32; 2]; 3]> = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let (x, y) = ((i % width) as f32, (i / width) as f32);
            let (right, left) = (sample(from, x + 1.0, y), sample(from, x - 1.0, y));
            let (below, above) = (sample(from, x, y + 1.0), sample(from, x, y - 1.0));
            std::array::from_fn(|c| [0.5 * (right[c] - left[c]), 0.5 * (below[c] - above[c])])
        })
        .collect();
    let squares: Vec<[f32; 3]> = (slopes.par_iter())
        .map(|s| {
            let sum = |a: usize, b: usize| (0..3).map(|c| s[c][a] * s[c][b]).sum();
            [sum(0, 0), sum(0, 1), sum(1, 1)]
        })
        .collect();
    let squares = window::sums(&squares, size, RADIUS);
    let count = window::counts(size, RADIUS);
    for _ in 0..STEPS {
        let errors: Vec<[f32; 2]> = (0..width * height)
            .into_par_iter()
            .map(|i| {
                let [dx, dy] = shifts.pixels[i];
                let there = sample(to, (i % width) as f32 + dx, (i / width) as f32 + dy);
                let here = from.pixels[i];
                std::array::from_fn(|a| (0..3).map(|c| (there[c] - here[c]) * slopes[i][c][a]).sum())
            })
            .collect();
        let errors = window::sums(&errors, size, RADIUS);
        (shifts.pixels.par_iter_mut().enumerate()).for_each(|(i, shift)| {
            // The slopes of pure noise keep windows without detail in place.
            let still = 3.0 * FLAT * count(i);
            let [xx, xy, yy] = squares[i];
            let (xx, yy) = (xx + still, yy + still);
            let [ex, ey] = errors[i];
            let det = (xx * yy - xy * xy).max(f32::MIN_POSITIVE);
            let step = [(yy * ex - xy * ey) / det, (xx * ey - xy * ex) / det];
            for (shift, step) in shift.iter_mut().zip(step) {
                *shift -= step.clamp(-1.0, 1.0);
            }
        });
        let smooth = window::sums(&shifts.pixels, size, 1);
        let around = window::counts(size, 1);
        for (i, shift) in shifts.pixels.iter_mut().enumerate() {
            *shift = smooth[i].map(|v| v / around(i));
        }
    }
    shifts
}

/// Standard deviation of a picture's noise after Immerkær 1996, "Fast noise variance estimation", by the median, which
/// edges do not move.
fn noise(picture: &Raster<[f32; 3]>) -> f32 {
    let (width, height) = picture.size();
    let weight = [1.0, -2.0, 1.0];
    let differences = (1..height.saturating_sub(1)).flat_map(|y| {
        (1..width.saturating_sub(1)).flat_map(move |x| {
            (0..3).map(move |c| {
                let near = |i: usize| picture.at(x + i % 3 - 1, y + i / 3 - 1)[c];
                (0..9).map(|i| weight[i % 3] * weight[i / 3] * near(i)).sum::<f32>().abs()
            })
        })
    });
    // The filter multiplies the noise by 6, and the median of a normal distribution's absolute values is 0.6745.
    quantile(differences.collect(), 0.5).unwrap_or(0.0) / (6.0 * 0.6745)
}

/// Quality of each pixel's match relative to most pixels, and the median difference.
fn trust(from: &Raster<[f32; 3]>, to: &Raster<[f32; 3]>, shifts: &Raster<[f32; 2]>) -> (Mask, f32) {
    let size = from.size();
    let errors: Vec<[f32; 1]> = (0..from.pixels.len())
        .into_par_iter()
        .map(|i| {
            let [dx, dy] = shifts.pixels[i];
            let (x, y) = ((i % size.0) as f32 + dx, (i / size.0) as f32 + dy);
            let there = sample(to, x, y);
            let square: f32 = (0..3).map(|c| (there[c] - from.pixels[i][c]).powi(2)).sum();
            let inside = |at: f32, length: usize| (-0.5..=length as f32 - 0.5).contains(&at);
            // Pixels that left the picture have no match.
            let seen = inside(x, size.0) && inside(y, size.1);
            [if seen { square / 3.0 } else { 1.0 }]
        })
        .collect();
    let near = window::sums(&errors, size, 1);
    let count = window::counts(size, 1);
    let mean: Vec<f32> = (0..near.len()).map(|i| near[i][0] / count(i)).collect();
    let median = quantile(mean.clone(), 0.5).unwrap_or(0.0);
    let noise = median.clamp(FLAT, MOST_NOISE);
    let trust = Mask {
        width: size.0,
        height: size.1,
        // A difference of three standard deviations gives 0.6.
        pixels: mean.iter().map(|m| (-m / (18.0 * noise)).exp()).collect(),
    };
    (trust, median.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A shifted picture of waves.
    fn waves((width, height): (usize, usize), [dx, dy]: [f32; 2]) -> Encoded {
        Encoded(Raster::from_fn(width, height, |x, y| {
            let (x, y) = (x as f32 - dx, y as f32 - dy);
            let v = 0.5 + 0.2 * (0.31 * x).sin() * (0.23 * y).cos() + 0.15 * (0.11 * x + 0.17 * y).sin();
            [v, 0.8 * v, 1.0 - v]
        }))
    }

    #[test]
    fn a_shift_is_found_and_undone() {
        for shift in [[0.0, 0.0], [3.0, -2.0], [-5.5, 4.25]] {
            let (from, to) = (waves((120, 90), [0.0; 2]), waves((120, 90), shift));
            let flow = Flow::between(&from, &to);
            let back = flow.warped(&to.0);
            for y in 20..70 {
                for x in 20..100 {
                    let found = flow.shifts.at(x, y);
                    let off = (found[0] - shift[0]).hypot(found[1] - shift[1]);
                    assert!(off < 0.2, "{shift:?} at {x}, {y}: {found:?}");
                    assert!((back.at(x, y)[0] - from.0.at(x, y)[0]).abs() < 0.02);
                    assert!(flow.trust.at(x, y) > 0.5);
                }
            }
        }
    }

    #[test]
    fn two_flows_make_one() {
        let at = |shift| waves((100, 80), shift);
        let (a, b, c) = (at([0.0, 0.0]), at([2.0, 1.0]), at([3.5, 0.0]));
        let flow = Flow::between(&a, &b).then(&Flow::between(&b, &c));
        for (x, y) in [(30, 30), (60, 40), (50, 55)] {
            let found = flow.shifts.at(x, y);
            assert!((found[0] - 3.5).abs() < 0.15 && found[1].abs() < 0.15, "{found:?}");
        }
    }

    #[test]
    fn frames_follow_each_other_in_any_noise_and_a_cut_does_not() {
        for (deviation, seed) in [(0.0, 0), (0.005, 1), (0.04, 2)] {
            let mut state = seed + 1_u32;
            let mut noisy = |picture: Encoded| {
                Encoded(picture.0.map(|p| {
                    p.map(|v| {
                        // A sum of four uniform values has a deviation of 0.577.
                        let sum: f32 = (0..4)
                            .map(|_| {
                                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                                (state >> 8) as f32 / (1 << 24) as f32 - 0.5
                            })
                            .sum();
                        v + deviation * sum / 0.577
                    })
                }))
            };
            let from = noisy(waves((120, 90), [0.0; 2]));
            let to = noisy(waves((120, 90), [3.0, -2.0]));
            assert!(Flow::between(&from, &to).follows(), "{deviation}");
            let cut = noisy(Encoded(Raster::from_fn(120, 90, |x, y| {
                [0.5 + 0.3 * (0.05 * (x * y) as f32).sin(), 0.4, 0.01 * x as f32]
            })));
            assert!(!Flow::between(&from, &cut).follows(), "{deviation}");
        }
    }

    #[test]
    fn another_picture_is_not_trusted_and_odd_ones_do_no_harm() {
        let from = waves((100, 80), [0.0; 2]);
        let mut to = waves((100, 80), [1.0, 0.0]);
        for y in 30..50 {
            for x in 40..60 {
                to.0.pixels[y * 100 + x] = [1.0, 0.0, (x % 2) as f32];
            }
        }
        let flow = Flow::between(&from, &to);
        assert!(flow.trust.at(49, 40) < 0.05 && flow.trust.at(15, 15) > 0.5);
        for size in [(1, 1), (1, 9), (30, 2), (500, 300)] {
            let odd = flow_picture(&Encoded(Raster::filled(size.0, size.1, [f32::NAN; 3])));
            let flow = Flow::between(&odd, &odd);
            assert!(flow.trust.pixels.iter().all(|v| *v == 1.0));
            assert_eq!(flow.warped_mask(&Mask::filled(7, 5, 0.5)).pixels, [0.5; 35]);
        }
    }
}
