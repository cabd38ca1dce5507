//! The balls compared pixel for pixel: what shows the shape of the response.

use super::super::code_values::{CodeValues, ResponseTable, STEPS};
use super::super::least_squares::NormalEquations;
use super::Probes;
use rayon::prelude::*;

/// A pixel of the interview's ball beside the same pixel under each lamp that reaches it.
pub(super) struct ProfilePixel {
    interview: CodeValues,
    lamps: Vec<(usize, CodeValues)>,
    /// The brightest of these lamps here.
    strongest: usize,
    /// Its place in the photograph.
    index: usize,
}

/// The interview's ball compared with the lamps' pixel by pixel.
pub(crate) struct Profile {
    /// For each lamp, the sum of squared encoded distances where it is the strongest.
    pub squares: Vec<f64>,
    /// Mean square of the part of these distances that changes from pixel to pixel: the noise. The rest is a misfit
    /// that neighbours share.
    pub noise: f64,
    /// The weights that explain the pixels best. [`Probes::fit`], which uses the lamps' whole light, finds others;
    /// under the right response both agree.
    pub weights: Vec<[f32; 3]>,
}

impl Probes {
    /// Squared distance in encoded values between the interview's ball and the best sum of the lamps' balls, pixel
    /// for pixel, as the mean over channels: one sum for the pixels in which each lamp is the strongest, and the
    /// weights of that sum. A lamp's image has bright and dim pixels, and each lamp has its own weight: only the
    /// right shape of the response makes all of them proportional. A power of the response cannot be told this way:
    /// it fits as well, with powers of the weights.
    pub(crate) fn profile(&self, table: &ResponseTable) -> Profile {
        let backgrounds: Vec<[f32; 3]> = self
            .footprints
            .iter()
            .map(|f| f.background(table))
            .collect();
        let channels: Vec<(Vec<f64>, f64, Vec<f64>)> = (0..3usize)
            .into_par_iter()
            .map(|c| {
                let light = |&(lamp, code): &(usize, CodeValues)| {
                    (
                        lamp,
                        f64::from((table.light(code[c]) - backgrounds[lamp][c]).max(0.0)),
                    )
                };
                // The last unknown is the room's own light during the interview.
                let constant = self.footprints.len();
                let mut equations = NormalEquations::new(constant + 1);
                let mut terms = Vec::new();
                for pixel in &self.profile {
                    // Errors are alike in the code, so light is divided by the slope there.
                    let certainty = 1.0 / f64::from(table.slope(pixel.interview[c]));
                    terms.clear();
                    terms.extend(
                        pixel
                            .lamps
                            .iter()
                            .map(light)
                            .map(|(lamp, l)| (lamp, l * certainty)),
                    );
                    terms.push((constant, certainty));
                    equations.add(
                        &terms,
                        f64::from(table.light(pixel.interview[c])) * certainty,
                    );
                }
                let x = equations.solve();
                let mut squares = vec![0.0; constant];
                let mut differences = NeighbourDifferences::default();
                for pixel in &self.profile {
                    let sum: f64 = pixel
                        .lamps
                        .iter()
                        .map(light)
                        .map(|(lamp, l)| x[lamp] * l)
                        .sum();
                    let code = f32::from(pixel.interview[c]) / f32::from(STEPS);
                    let off = f64::from(table.encode((sum + x[constant]) as f32) - code);
                    squares[pixel.strongest] += off.powi(2) / 3.0;
                    differences.add(pixel.index, off);
                }
                (squares, differences.noise(), x)
            })
            .collect();
        let lamps = 0..self.footprints.len();
        Profile {
            squares: lamps
                .clone()
                .map(|lamp| channels.iter().map(|(squares, ..)| squares[lamp]).sum())
                .collect(),
            noise: channels.iter().map(|(_, noise, _)| noise).sum::<f64>() / 3.0,
            weights: lamps
                .map(|lamp| [0, 1, 2].map(|c| channels[c].2[lamp] as f32))
                .collect(),
        }
    }

    /// How many pixels [`Self::profile`] compares.
    pub(crate) fn profile_pixels(&self) -> usize {
        self.profile.len()
    }

    /// The code values that [`Self::profile`] compares, of the lamps' balls and of the interview's.
    pub(crate) fn profile_codes(&self) -> impl Iterator<Item = &CodeValues> {
        self.profile.iter().flat_map(|pixel| {
            let lamps = pixel.lamps.iter().map(|(_, code)| code);
            lamps.chain(std::iter::once(&pixel.interview))
        })
    }

    /// The pixels that [`Self::profile`] compares.
    pub(super) fn make_profile(&self, provisional: &ResponseTable) -> Vec<ProfilePixel> {
        /// Enough pixels to determine a response; more only take time.
        const ENOUGH: usize = 16_384;
        /// A pixel counts from this many times the room's own light on: below, the sensor's noise and the light
        /// outside the lamps' footprints bend the curve.
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
            .filter(|(((code, lamps), comparable), _)| {
                !lamps.is_empty() && lit(code) && **comparable
            })
            .map(|(((code, lamps), _), place)| {
                let level = |codes: &CodeValues| provisional.rgb(*codes).into_iter().sum::<f32>();
                let brighter = |a: &&(usize, CodeValues), b: &&(usize, CodeValues)| {
                    level(&a.1).total_cmp(&level(&b.1))
                };
                ProfilePixel {
                    interview: *code,
                    index: place.index,
                    strongest: lamps.iter().max_by(brighter).map_or(0, |(lamp, _)| *lamp),
                    lamps,
                }
            })
            .collect();
        let stride = profile.len().div_ceil(ENOUGH).max(1);
        // Two neighbours at a time, for the noise.
        profile
            .into_iter()
            .enumerate()
            .filter(|(i, _)| (i / 2) % stride == 0)
            .map(|(_, pixel)| pixel)
            .collect()
    }
}

/// The noise in a series of errors, from neighbours in one row: half the mean square of their
/// differences (von Neumann 1941).
#[derive(Default)]
pub(crate) struct NeighbourDifferences {
    last: Option<(usize, f64)>,
    square: f64,
    count: f64,
}

impl NeighbourDifferences {
    /// The next error, at a place counted along the rows.
    pub fn add(&mut self, place: usize, error: f64) {
        if let Some((_, last)) = self.last.filter(|(last, _)| last + 1 == place) {
            self.square += 0.5 * (error - last).powi(2);
            self.count += 1.0;
        }
        self.last = Some((place, error));
    }

    /// Mean square of the noise; 0 if no two places were neighbours.
    pub fn noise(&self) -> f64 {
        self.square / self.count.max(1.0)
    }
}
