//! The interview's light as a sum of lamps, from the mirror balls.

use super::super::cholesky::inverse;
use super::super::code_values::{CodeValues, ResponseTable};
use super::super::footprint::Footprint;
use super::super::least_squares::NormalEquations;
use super::Probes;
use base::median::median;
use imaging::color::luminance;
use rayon::prelude::*;

/// Error of a lamp's measurement on the ball, relative to the best-measured lamp.
const HARDLY_SHOWN: f64 = 0.02;

/// The interview's light expressed in the lamps.
pub struct InterviewFit {
    /// Relative root-mean-square residual of the blurred ball.
    pub residual: f32,
    /// Share of the ball's luminance energy that no lamp explains.
    pub uncovered: f32,
}

/// Energies of the cells of the interview's ball and of the lamps'.
struct Sums {
    interview: Vec<[f32; 3]>,
    lamps: Vec<LampCells>,
    /// Expected product of the effects of any two lamps on the subject, per channel.
    grams: [Vec<f64>; 3],
    weights: Vec<[f32; 3]>,
    /// Part of the interview's light not explained by the lamps.
    left: Vec<[f32; 3]>,
}

struct LampCells {
    /// Cells lit by the lamp, with their energy.
    lit: Vec<(usize, [f32; 3])>,
    /// Expected product of the effects on the subject of light from each cell and of the lamp.
    spread: Vec<[f32; 3]>,
}

impl Probes {
    /// Light on every ball regardless of the lamp: the room's own, and the sensor's black level.
    pub(super) fn ambient(&self, table: &ResponseTable) -> [f32; 3] {
        let backgrounds: Vec<[f32; 3]> = self.footprints.iter().map(|f| f.background(table)).collect();
        [0, 1, 2].map(|c| median(backgrounds.iter().map(|b| b[c])))
    }

    /// Light on the interview's ball outside the lamps' images. The dark level under single lamps is either the
    /// room's own light, which stays constant, or the lamps' stray light, which adds up. The darkness of the
    /// interview's ball between the lamps decides. Light above the stray light of all lamps comes from directions
    /// without lamps.
    fn interview_ambient(&self, table: &ResponseTable) -> [f32; 3] {
        let ambient = self.ambient(table);
        let dark = table.rgb(self.interview_dark);
        let mut energy = [0.0f64; 3];
        for footprint in &self.footprints {
            let background = footprint.background(table);
            for (pixel, code) in &footprint.pixels {
                let light = table.rgb(*code);
                let solid_angle = self.ball.pixels[*pixel as usize].solid_angle;
                for c in 0..3 {
                    energy[c] += f64::from((light[c] - background[c]).max(0.0) * solid_angle);
                }
            }
        }
        let mut interview = [0.0f64; 3];
        for (pixel, code) in self.ball.pixels.iter().zip(&self.interview) {
            let light = table.rgb(*code);
            for c in 0..3 {
                interview[c] += f64::from((light[c] - ambient[c]).max(0.0) * pixel.solid_angle);
            }
        }
        [0, 1, 2].map(|c| {
            // Sum of the weights, assuming equal lamps.
            let weights =
                if energy[c] > 0.0 { (interview[c] / energy[c]) as f32 * self.footprints.len() as f32 } else { 1.0 };
            dark[c].clamp(ambient[c], ambient[c] * weights.max(1.0))
        })
    }

    /// Median code values of the interview's ball outside the lamps.
    pub(super) fn find_interview_dark(&self) -> CodeValues {
        let mut is_lit = vec![false; self.interview.len()];
        for (pixel, _) in self.footprints.iter().flat_map(|f| &f.pixels) {
            is_lit[*pixel as usize] = true;
        }
        [0, 1, 2].map(|c| {
            let dark = self.interview.iter().zip(&is_lit).filter(|(_, lit)| !**lit);
            let mut codes: Vec<u16> = dark.map(|(code, _)| code[c]).collect();
            codes.sort_unstable();
            codes.get(codes.len() / 2).copied().unwrap_or(0)
        })
    }

    /// The interview's light as a sum of lamps under a response, per channel, none negative.
    ///
    /// The subject should look the same under the sum as under the light itself, including light from between the
    /// lamps. A subject's responses to light from two directions are assumed to be correlated by [`kernel`]; the
    /// weights have the least expected squared error (kriging, Matheron 1963). A sum of lamps is recovered exactly.
    pub(crate) fn weights(&self, table: &ResponseTable) -> Vec<[f32; 3]> {
        self.sums(table).weights
    }

    /// Weights together with the unexplained light of the ball, blurred to half the lamps' spacing.
    pub(crate) fn fit(&self, table: &ResponseTable) -> InterviewFit {
        let sums = self.sums(table);
        let left = self.spread(&self.blur, &sums.left);
        let whole = self.spread(&self.blur, &sums.interview);
        let share = |part: f64, whole: f64| {
            if whole > 0.0 { (part / whole) as f32 } else { 0.0 }
        };
        let (mut error, mut power) = (0.0f64, 0.0f64);
        let (mut missing, mut all) = ([0.0f32; 3], [0.0f32; 3]);
        for (left, whole) in left.iter().zip(&whole) {
            for c in 0..3 {
                error += f64::from(left[c]).powi(2);
                power += f64::from(whole[c]).powi(2);
                missing[c] += left[c].max(0.0);
                all[c] += whole[c].max(0.0);
            }
        }
        InterviewFit {
            residual: share(error, power).sqrt(),
            uncovered: share(f64::from(luminance(missing)), f64::from(luminance(all))).min(1.0),
        }
    }

    fn sums(&self, table: &ResponseTable) -> Sums {
        let interview = self.interview_cells(table);
        let lamps: Vec<LampCells> = self
            .footprints
            .par_iter()
            .map(|footprint| {
                let energy = self.lamp_cells(footprint, table);
                let spread = self.spread(&self.kernel, &energy);
                let lit = (energy.into_iter().enumerate()).filter(|(_, e)| *e != [0.0; 3]).collect();
                LampCells { lit, spread }
            })
            .collect();
        let mut weights = vec![[0.0f32; 3]; lamps.len()];
        let mut left = interview.clone();
        let mut grams = [vec![], vec![], vec![]];
        for (c, gram) in grams.iter_mut().enumerate() {
            let product = |a: &LampCells, b: &LampCells| -> f64 {
                let terms = a.lit.iter();
                terms.map(|(cell, e)| f64::from(e[c] * b.spread[*cell][c])).sum()
            };
            *gram = lamps.iter().flat_map(|a| lamps.iter().map(move |b| product(a, b))).collect();
            let target = lamps.iter().map(|lamp| {
                let terms = interview.iter().zip(&lamp.spread);
                terms.map(|(light, k)| f64::from(light[c] * k[c])).sum()
            });
            // A lamp's measurement on the ball has an error. For a barely visible lamp it is all error: its
            // arbitrary weight is set to 0, and its neighbours take its light.
            let mut shown: Vec<f64> = (0..lamps.len()).map(|i| gram[i * (lamps.len() + 1)]).collect();
            shown.sort_by(f64::total_cmp);
            let error = HARDLY_SHOWN.powi(2) * shown.get(shown.len() / 2).copied().unwrap_or(0.0);
            let mut unsure = gram.clone();
            for i in 0..lamps.len() {
                unsure[i * (lamps.len() + 1)] += error;
            }
            let solution = NormalEquations::from_gram(unsure, target.collect()).solve();
            for ((weight, x), lamp) in weights.iter_mut().zip(&solution).zip(&lamps) {
                weight[c] = *x as f32;
                for (cell, energy) in &lamp.lit {
                    left[*cell][c] -= weight[c] * energy[c];
                }
            }
        }
        Sums { interview, lamps, grams, weights, left }
    }

    /// Expected errors of the weights for the subject, as independent changes, one per lamp: per lamp and channel.
    ///
    /// Light near a lamp that is not a sum of lamps causes an error like that of predicting the lamp's OLAT from
    /// the others, scaled by the expected squared error.
    pub(crate) fn weight_errors(&self, table: &ResponseTable) -> Vec<Vec<[f32; 3]>> {
        let sums = self.sums(table);
        let n = sums.lamps.len();
        let spread = self.spread(&self.kernel, &sums.left);
        let mut errors = vec![vec![[0.0f32; 3]; n]; n];
        for c in 0..3 {
            let mut open = vec![0.0f64; n];
            for (cell, (left, spread)) in sums.left.iter().zip(&spread).enumerate() {
                let nearness = |lamp: &LampCells| {
                    let own: f32 = lamp.lit.iter().map(|(_, e)| e[c]).sum();
                    lamp.spread[cell][c] / own.max(f32::MIN_POSITIVE)
                };
                let nearest = (0..n)
                    .map(|i| (i, nearness(&sums.lamps[i])))
                    .filter(|(_, nearness)| *nearness > 0.0)
                    .max_by(|a, b| a.1.total_cmp(&b.1));
                if let Some((nearest, _)) = nearest {
                    open[nearest] += f64::from(left[c] * spread[c]);
                }
            }
            let Some(inverse) = inverse(&sums.grams[c], n) else { continue };
            for (lamp, error) in errors.iter_mut().enumerate() {
                // The prediction of a lamp from the others, and its expected squared error, follow from the inverse
                // (Dubrule 1983).
                let own = inverse[lamp * n + lamp];
                if open[lamp] <= 0.0 || own <= 0.0 {
                    continue;
                }
                let size = (open[lamp] * own).sqrt();
                for (other, change) in error.iter_mut().enumerate() {
                    change[c] = (size * inverse[lamp * n + other] / own) as f32;
                }
            }
        }
        errors
    }

    /// Energy of the interview's ball in each cell, without ambient light.
    fn interview_cells(&self, table: &ResponseTable) -> Vec<[f32; 3]> {
        let mut energy = vec![[0.0f32; 3]; self.cells()];
        let ambient = self.interview_ambient(table);
        for (pixel, code) in self.interview.iter().enumerate().filter(|(pixel, _)| self.comparable[*pixel]) {
            let light = table.rgb(*code);
            let cell = &mut energy[usize::from(self.cell_of_pixel[pixel])];
            for c in 0..3 {
                cell[c] += (light[c] - ambient[c]) * self.ball.pixels[pixel].solid_angle;
            }
        }
        energy
    }

    /// Energy of a lamp's footprint in each cell.
    fn lamp_cells(&self, footprint: &Footprint, table: &ResponseTable) -> Vec<[f32; 3]> {
        let background = footprint.background(table);
        let mut energy = vec![[0.0f32; 3]; self.cells()];
        for (pixel, code) in footprint.pixels.iter().filter(|(p, _)| self.comparable[*p as usize]) {
            let place = *pixel as usize;
            let light = table.rgb(*code);
            let cell = &mut energy[usize::from(self.cell_of_pixel[place])];
            for c in 0..3 {
                cell[c] += (light[c] - background[c]).max(0.0) * self.ball.pixels[place].solid_angle;
            }
        }
        energy
    }

    pub(super) fn cells(&self) -> usize {
        self.blur.len().isqrt()
    }

    /// Energy of each cell spread over all cells by pairwise weights.
    fn spread(&self, weights: &[f32], energy: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let n = self.cells();
        let lit: Vec<usize> = (0..n).filter(|&i| energy[i] != [0.0; 3]).collect();
        let at = |cell: usize| {
            lit.iter().fold([0.0f32; 3], |sum, &from| {
                let k = weights[cell * n + from];
                [0, 1, 2].map(|c| sum[c] + k * energy[from][c])
            })
        };
        (0..n).map(at).collect()
    }
}
