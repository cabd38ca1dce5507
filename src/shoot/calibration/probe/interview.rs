//! The interview's light as a sum of lamps, from the mirror balls.

use super::super::cholesky::Cholesky;
use super::super::code_values::{CodeValues, ResponseTable};
use super::super::footprint::Footprint;
use super::super::least_squares::NormalEquations;
use super::{Probes, median};
use imaging::color::luminance;
use rayon::prelude::*;

/// The error of what the ball shows of a lamp, relative to what it shows of most.
const HARDLY_SHOWN: f64 = 0.02;

/// The interview's light in terms of the lamps.
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
    /// For each channel, the expected products of what any two lamps do to the subject.
    grams: [Vec<f64>; 3],
    weights: Vec<[f32; 3]>,
    /// Part of the interview's light that the sum of the lamps leaves.
    left: Vec<[f32; 3]>,
}

struct LampCells {
    /// The cells that the lamp lights, with their energy.
    lit: Vec<(usize, [f32; 3])>,
    /// For each cell, the expected product of what light from there and the lamp do to the subject.
    spread: Vec<[f32; 3]>,
}

/// Correlation between a surface's responses to light of two directions at an angle, 1 to 0, averaged over all
/// surfaces: matte shading of any normal, times a shadow's edge of any direction. Both are arc-cosine kernels (Cho and
/// Saul 2009, degrees 1 and 0).
pub(super) fn kernel(cosine: f32) -> f32 {
    use std::f32::consts::PI;
    let angle = cosine.clamp(-1.0, 1.0).acos();
    let shading = (angle.sin() + (PI - angle) * angle.cos()) / PI;
    shading * (1.0 - angle / PI)
}

/// The inverse of a symmetric positive matrix of `n` × `n`, which is made positive if it is not quite; `None` if it is
/// 0, NaN or infinite.
fn inverse(matrix: &[f64], n: usize) -> Option<Vec<f64>> {
    let trace: f64 = (0..n).map(|i| matrix[i * n + i]).sum();
    let mut positive = matrix.to_vec();
    for i in 0..n {
        positive[i * n + i] += 1e-6 * trace / n as f64;
    }
    Some(Cholesky::new(positive, n)?.inverse())
}

impl Probes {
    /// Light that every ball shows whatever the lamp: the room's own, and the sensor's black level.
    pub(super) fn ambient(&self, table: &ResponseTable) -> [f32; 3] {
        let backgrounds: Vec<[f32; 3]> =
            self.footprints.iter().map(|f| f.background(table)).collect();
        [0, 1, 2].map(|c| median(backgrounds.iter().map(|b| b[c])))
    }

    /// Light on the interview's ball that is no lamp's image. What is dark under single lamps is the room's own
    /// light, which stays as it is, or the lamps' stray light, which adds up; how dark the interview's ball is
    /// between the lamps tells which. What exceeds the stray light of all lamps comes from where no lamp is.
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
            // The sum of the weights, as if all lamps were alike.
            let weights = if energy[c] > 0.0 {
                (interview[c] / energy[c]) as f32 * self.footprints.len() as f32
            } else {
                1.0
            };
            dark[c].clamp(ambient[c], ambient[c] * weights.max(1.0))
        })
    }

    /// The median code values of the interview's ball where no lamp is.
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

    /// The interview's light as a sum of lamps under a response, per channel, none below 0.
    ///
    /// The subject is to look under the sum as under the light itself, also where that comes from between the lamps.
    /// How a subject answers light of two directions is taken to be correlated by [`kernel`]; the weights are then those
    /// of least expected squared error (kriging, Matheron 1963). A sum of lamps is found exactly.
    pub(crate) fn weights(&self, table: &ResponseTable) -> Vec<[f32; 3]> {
        self.sums(table).weights
    }

    /// The same with what no lamp explains of the ball, blurred to half the lamps' spacing.
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
                let lit =
                    (energy.into_iter().enumerate()).filter(|(_, e)| *e != [0.0; 3]).collect();
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
            // What the ball shows of a lamp has an error. A lamp that it hardly shows is that error alone: its weight,
            // which would be anything, is 0, and its neighbours have its light.
            let mut shown: Vec<f64> =
                (0..lamps.len()).map(|i| gram[i * (lamps.len() + 1)]).collect();
            shown.sort_by(f64::total_cmp);
            let error = HARDLY_SHOWN.powi(2) * shown.get(shown.len() / 2).copied().unwrap_or(0.0);
            let mut unsure = gram.clone();
            for i in 0..lamps.len() {
                unsure[i * (lamps.len() + 1)] += error;
            }
            let solution = NormalEquations::of(unsure, target.collect()).solve();
            for ((weight, x), lamp) in weights.iter_mut().zip(&solution).zip(&lamps) {
                weight[c] = *x as f32;
                for (cell, energy) in &lamp.lit {
                    left[*cell][c] -= weight[c] * energy[c];
                }
            }
        }
        Sums { interview, lamps, grams, weights, left }
    }

    /// By how much the weights must be expected to be off for the subject, as changes that are independent of each
    /// other, one for each lamp: per lamp and channel.
    ///
    /// The light near a lamp that no sum of lamps is makes an error like that of the lamp's OLAT predicted from the
    /// others', as much larger as the expected square of the error is.
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
            let Some(inverse) = inverse(&sums.grams[c], n) else {
                continue;
            };
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

    /// The energy of the interview's ball in each cell, without ambient light.
    fn interview_cells(&self, table: &ResponseTable) -> Vec<[f32; 3]> {
        let mut energy = vec![[0.0f32; 3]; self.cells()];
        let ambient = self.interview_ambient(table);
        for (pixel, code) in
            self.interview.iter().enumerate().filter(|(pixel, _)| self.comparable[*pixel])
        {
            let light = table.rgb(*code);
            let cell = &mut energy[usize::from(self.cell_of_pixel[pixel])];
            for c in 0..3 {
                cell[c] += (light[c] - ambient[c]) * self.ball.pixels[pixel].solid_angle;
            }
        }
        energy
    }

    /// The energy of a lamp's footprint in each cell.
    fn lamp_cells(&self, footprint: &Footprint, table: &ResponseTable) -> Vec<[f32; 3]> {
        let background = footprint.background(table);
        let mut energy = vec![[0.0f32; 3]; self.cells()];
        for (pixel, code) in footprint.pixels.iter().filter(|(p, _)| self.comparable[*p as usize]) {
            let place = *pixel as usize;
            let light = table.rgb(*code);
            let cell = &mut energy[usize::from(self.cell_of_pixel[place])];
            for c in 0..3 {
                cell[c] +=
                    (light[c] - background[c]).max(0.0) * self.ball.pixels[place].solid_angle;
            }
        }
        energy
    }

    pub(super) fn cells(&self) -> usize {
        self.blur.len().isqrt()
    }

    /// Each cell's energy spread over all cells by weights between all pairs.
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
