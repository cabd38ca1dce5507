//! Comparison of the balls pixel for pixel, which reveals the shape of the response.

use super::super::code_values::{CodeValues, ResponseTable, STEPS};
use super::super::least_squares::NormalEquations;
use super::{Probes, ProfilePixel};
use rayon::prelude::*;

/// The interview's ball compared with the lamps' pixel by pixel.
pub(crate) struct Profile {
    /// Sum of squared encoded distances, with the penalty of the remainder.
    pub square: f64,
    /// Mean square of the pixel-to-pixel part of these distances: the noise. The rest is a misfit common to
    /// neighbours.
    pub noise: f64,
    /// Weights that explain the pixels best. [`Probes::fit`] uses the lamps' full light and may differ; under the
    /// right response both agree.
    pub weights: Vec<[f32; 3]>,
    /// Evidence about the remainder from each channel of each cell.
    cells: Vec<CellSums>,
    /// Mean square of the codes' rounding errors.
    pub rounding: f64,
}

/// Sums over a cell's pixels of a channel for the fit of its remainder. Light is divided by the slope of the
/// response, so that errors are uniform in the code.
#[derive(Clone, Copy, Default)]
struct CellSums {
    pixels: f64,
    /// Sum of squared encoded values, for scale.
    encoded: f64,
    /// Products of the lamps' light (a), of a uniform light (h), and of the residual (r).
    aa: f64,
    ah: f64,
    hh: f64,
    ar: f64,
    hr: f64,
    rr: f64,
}

impl CellSums {
    /// Penalties of the cell's two unknowns under a remainder with variance `power` relative to the noise.
    fn penalties(&self, power: f64) -> [f64; 2] {
        [self.aa, self.hh].map(|square| square / (power * self.encoded).max(1e-300))
    }

    /// Change of the lamps' light and uniform light that explain the residual, and their penalty.
    fn remainder(&self, power: f64) -> ([f64; 2], f64) {
        let [penalty_a, penalty_h] = self.penalties(power);
        let (a, h) = (self.aa + penalty_a, self.hh + penalty_h);
        let determinant = a * h - self.ah * self.ah;
        if power <= 0.0 || determinant.is_nan() || determinant <= 1e-12 * a * h {
            return ([0.0; 2], 0.0);
        }
        let change = (h * self.ar - self.ah * self.hr) / determinant;
        let even = (a * self.hr - self.ah * self.ar) / determinant;
        ([change, even], penalty_a * change * change + penalty_h * even * even)
    }

    /// Remaining squared distance with its penalty, and ln of the remainder's volume.
    fn left(&self, power: f64) -> [f64; 2] {
        let ([change, even], _) = self.remainder(power);
        let left = self.rr - change * self.ar - even * self.hr;
        let along = 1.0 + power * self.encoded;
        let shared = if self.aa > 0.0 && self.hh > 0.0 {
            power * self.encoded * self.ah / (self.aa * self.hh).sqrt()
        } else {
            0.0
        };
        [left.max(0.0), (along * along - shared * shared).max(1.0).ln()]
    }
}

impl Profile {
    /// Most probable variance of the remainder relative to the noise; 0 if the lamps explain all of the ball.
    pub fn remainder(&self) -> f64 {
        let pixels: f64 = self.cells.iter().map(|cell| cell.pixels).sum();
        let cost = |power: f64| {
            let [left, room] = (self.cells.iter().map(|cell| cell.left(power)))
                .fold([0.0; 2], |sum, cell| [sum[0] + cell[0], sum[1] + cell[1]]);
            pixels * (left + pixels * self.rounding).max(1e-300).ln() + room
        };
        let powers = (0..=12).map(|i| if i == 0 { 0.0 } else { 10f64.powf(0.5 * f64::from(i)) });
        powers.min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(0.0)
    }
}

impl Probes {
    /// Squared distance in encoded values between the interview's ball and the best sum of the lamps' balls, pixel
    /// for pixel, as the mean over channels. A lamp's image has bright and dim pixels, and each lamp has its own
    /// weight: only the right shape of the response makes all of them proportional. A power of the response cannot
    /// be determined this way: it fits equally well, with powers of the weights.
    ///
    /// The interview's light need not be a sum of lamps. In each cell the lamps' light may change by a factor, and
    /// a uniform light may be added; `remainder` is the variance of both relative to the noise, 0 for none.
    /// Variation within a cell, from the middle of a lamp's image to its edge, still reveals the response.
    pub(crate) fn profile(&self, table: &ResponseTable, remainder: f64) -> Profile {
        let backgrounds: Vec<[f32; 3]> = self.footprints.iter().map(|f| f.background(table)).collect();
        struct Channel {
            square: f64,
            off: Vec<f64>,
            weights: Vec<f64>,
            cells: Vec<CellSums>,
        }
        let channels: Vec<Channel> = (0..3usize)
            .into_par_iter()
            .map(|c| {
                let light = |&(lamp, code): &(usize, CodeValues)| {
                    (lamp, f64::from((table.light(code[c]) - backgrounds[lamp][c]).max(0.0)))
                };
                // The last unknown is the room's own light during the interview.
                let constant = self.footprints.len();
                let mut equations = NormalEquations::new(constant + 1);
                let mut terms = Vec::new();
                for pixel in &self.profile {
                    // Errors are uniform in the code, so light is divided by the slope there.
                    let certainty = 1.0 / f64::from(table.slope(pixel.interview[c]));
                    terms.clear();
                    terms.extend(pixel.lamps.iter().map(light).map(|(lamp, l)| (lamp, l * certainty)));
                    terms.push((constant, certainty));
                    equations.add(&terms, f64::from(table.light(pixel.interview[c])) * certainty);
                }
                let x = equations.solve();
                let sum = |pixel: &ProfilePixel| -> f64 {
                    let lamps = pixel.lamps.iter().map(light);
                    lamps.map(|(lamp, l)| x[lamp] * l).sum()
                };
                let sums: Vec<f64> = self.profile.iter().map(sum).collect();
                let mut cells = vec![CellSums::default(); self.cells()];
                for (pixel, sum) in self.profile.iter().zip(&sums) {
                    let code = pixel.interview[c];
                    let h = 1.0 / f64::from(table.slope(code));
                    let (a, r) = (sum * h, (f64::from(table.light(code)) - sum - x[constant]) * h);
                    let cell = &mut cells[pixel.cell];
                    cell.pixels += 1.0;
                    cell.encoded += (f64::from(code) / f64::from(STEPS)).powi(2);
                    cell.aa += a * a;
                    cell.ah += a * h;
                    cell.hh += h * h;
                    cell.ar += a * r;
                    cell.hr += h * r;
                    cell.rr += r * r;
                }
                let found: Vec<([f64; 2], f64)> = cells.iter().map(|cell| cell.remainder(remainder)).collect();
                let mut square: f64 = found.iter().map(|(_, penalty)| penalty).sum();
                let off = self.profile.iter().zip(&sums).map(|(pixel, sum)| {
                    let [change, even] = found[pixel.cell].0;
                    let light = (1.0 + change) * sum + x[constant] + even;
                    let code = f32::from(pixel.interview[c]) / f32::from(STEPS);
                    f64::from(table.encode(light as f32) - code)
                });
                let off: Vec<f64> = off.collect();
                square += off.iter().map(|off| off * off).sum::<f64>();
                Channel { square, off, weights: x, cells }
            })
            .collect();
        // Light outside the sum of lamps appears in all channels, noise in each independently.
        let noise = |a: &Channel, b: &Channel| {
            let mut differences = NeighbourDifferences::default();
            for (i, pixel) in self.profile.iter().enumerate() {
                differences.add(pixel.index, a.off[i] - b.off[i]);
            }
            0.5 * differences.noise()
        };
        let lamps = 0..self.footprints.len();
        Profile {
            square: channels.iter().map(|channel| channel.square).sum::<f64>() / 3.0,
            noise: 0.5 * (noise(&channels[0], &channels[1]) + noise(&channels[1], &channels[2])),
            rounding: self.profile_rounding,
            weights: lamps.map(|lamp| [0, 1, 2].map(|c: usize| channels[c].weights[lamp] as f32)).collect(),
            cells: channels.into_iter().flat_map(|channel| channel.cells).collect(),
        }
    }

    /// Number of pixels compared by [`Self::profile`].
    pub(crate) fn profile_pixels(&self) -> usize {
        self.profile.len()
    }

    /// Code values compared by [`Self::profile`], of the lamps' balls and of the interview's.
    pub(crate) fn profile_codes(&self) -> impl Iterator<Item = &CodeValues> {
        self.profile.iter().flat_map(|pixel| {
            let lamps = pixel.lamps.iter().map(|(_, code)| code);
            lamps.chain(std::iter::once(&pixel.interview))
        })
    }

    /// Pixels compared by [`Self::profile`].
    pub(super) fn make_profile(&self, provisional: &ResponseTable) -> Vec<ProfilePixel> {
        /// Number of pixels that determine a response; more only take time.
        const ENOUGH: usize = 16_384;
        /// Smallest brightness of a compared pixel relative to the room's own light. Below it, sensor noise and
        /// light outside the lamps' footprints bend the curve.
        const LIT: f32 = 10.0;
        let mut lamps: Vec<Vec<(usize, CodeValues)>> = vec![vec![]; self.interview.len()];
        for (lamp, footprint) in self.footprints.iter().enumerate() {
            for (pixel, code) in &footprint.pixels {
                lamps[*pixel as usize].push((lamp, *code));
            }
        }
        let ambient = self.ambient(provisional);
        let lit = |code: &CodeValues| (0..3).all(|c| provisional.light(code[c]) > LIT * ambient[c]);
        let profile: Vec<ProfilePixel> = self
            .interview
            .iter()
            .zip(lamps)
            .zip(&self.comparable)
            .zip(&self.ball.pixels)
            .zip(&self.cell_of_pixel)
            .filter(|((((code, lamps), comparable), _), _)| !lamps.is_empty() && lit(code) && **comparable)
            .map(|((((code, lamps), _), place), cell)| ProfilePixel {
                interview: *code,
                index: place.index,
                cell: usize::from(*cell),
                lamps,
            })
            .collect();
        let stride = profile.len().div_ceil(ENOUGH).max(1);
        // Two neighbours at a time, for the noise.
        profile.into_iter().enumerate().filter(|(i, _)| (i / 2) % stride == 0).map(|(_, pixel)| pixel).collect()
    }
}

/// Noise in a series of errors, from neighbours in one row: half the mean square of their differences (von Neumann
/// 1941).
#[derive(Default)]
pub(crate) struct NeighbourDifferences {
    last: Option<(usize, f64)>,
    square: f64,
    count: f64,
}

impl NeighbourDifferences {
    /// Adds the next error, at a place counted along the rows.
    pub fn add(&mut self, place: usize, error: f64) {
        if let Some((_, last)) = self.last.filter(|(last, _)| last + 1 == place) {
            self.square += 0.5 * (error - last).powi(2);
            self.count += 1.0;
        }
        self.last = Some((place, error));
    }

    /// Mean square of the noise; 0 without neighbours.
    pub fn noise(&self) -> f64 {
        self.square / self.count.max(1.0)
    }
}
