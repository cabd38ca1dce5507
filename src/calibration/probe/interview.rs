//! The interview's light as a sum of lamps, from the mirror balls.

use super::super::code_values::{CodeValues, ResponseTable};
use super::super::footprint::Footprint;
use super::super::least_squares::NormalEquations;
use super::{Probes, median};
use imaging::color::luminance;
use rayon::prelude::*;

/// The interview's light in terms of the lamps.
pub struct InterviewFit {
    /// Per lamp and channel, its share.
    pub weights: Vec<[f32; 3]>,
    /// Per lamp and channel, the root-mean-square of what no lamp explains near it, relative to the light there.
    pub unexplained: Vec<[f32; 3]>,
    /// Relative root-mean-square residual of the blurred ball.
    pub residual: f32,
    /// Share of the ball's luminance energy that no lamp explains.
    pub uncovered: f32,
}

impl Probes {
    /// Light that every ball shows whatever the lamp: the room's own, and the sensor's black level.
    pub(super) fn ambient(&self, table: &ResponseTable) -> [f32; 3] {
        let backgrounds: Vec<[f32; 3]> = self
            .footprints
            .iter()
            .map(|f| f.background(table))
            .collect();
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

    /// The interview's light as a sum of lamps under a response: a non-negative least-squares fit of the lamps' balls
    /// to the interview's, per channel, both blurred to half the lamps' spacing.
    pub(crate) fn fit(&self, table: &ResponseTable) -> InterviewFit {
        let interview = self.interview_cells(table);
        let lamps: Vec<Vec<[f32; 3]>> = self
            .footprints
            .par_iter()
            .map(|footprint| self.lamp_cells(footprint, table))
            .collect();
        let mut weights = vec![[0.0f32; 3]; lamps.len()];
        let mut unexplained = vec![[0.0f32; 3]; lamps.len()];
        let (mut error, mut power) = (0.0f64, 0.0f64);
        let share = |part: f64, whole: f64| {
            if whole > 0.0 {
                (part / whole) as f32
            } else {
                0.0
            }
        };
        let mut missing = [0.0f32; 3];
        let mut all = [0.0f32; 3];
        for c in 0..3 {
            let mut equations = NormalEquations::new(lamps.len());
            for (cell, light) in interview.iter().enumerate() {
                let terms: Vec<(usize, f64)> = lamps
                    .iter()
                    .enumerate()
                    .filter(|(_, lamp)| lamp[cell][c] > 0.0)
                    .map(|(i, lamp)| (i, f64::from(lamp[cell][c])))
                    .collect();
                equations.add(&terms, f64::from(light[c]));
            }
            let solution = equations.solve();
            for (weight, x) in weights.iter_mut().zip(&solution) {
                weight[c] = *x as f32;
            }
            let mut near = vec![[0.0f64; 2]; lamps.len()];
            for (cell, light) in interview.iter().enumerate() {
                let explained: f32 = lamps
                    .iter()
                    .zip(&weights)
                    .map(|(lamp, w)| w[c] * lamp[cell][c])
                    .sum();
                let left = light[c] - explained;
                for (near, lamp) in near.iter_mut().zip(&lamps) {
                    near[0] += f64::from(lamp[cell][c] * left * left);
                    near[1] += f64::from(lamp[cell][c] * light[c] * light[c]);
                }
                error += f64::from(left).powi(2);
                power += f64::from(light[c]).powi(2);
                missing[c] += left.max(0.0);
                all[c] += light[c];
            }
            for (unexplained, [left, whole]) in unexplained.iter_mut().zip(near) {
                unexplained[c] = share(left, whole).sqrt();
            }
        }
        InterviewFit {
            weights,
            unexplained,
            residual: share(error, power).sqrt(),
            uncovered: share(f64::from(luminance(missing)), f64::from(luminance(all))).min(1.0),
        }
    }

    /// The blurred energy of the interview's ball in each cell, without ambient light; not negative.
    fn interview_cells(&self, table: &ResponseTable) -> Vec<[f32; 3]> {
        let mut energy = vec![[0.0f32; 3]; self.cells()];
        let ambient = self.interview_ambient(table);
        for (pixel, code) in self
            .interview
            .iter()
            .enumerate()
            .filter(|(pixel, _)| self.comparable[*pixel])
        {
            let light = table.rgb(*code);
            let cell = &mut energy[usize::from(self.cell_of_pixel[pixel])];
            for c in 0..3 {
                cell[c] += (light[c] - ambient[c]) * self.ball.pixels[pixel].solid_angle;
            }
        }
        let blurred = self.blurred(&energy).into_iter();
        blurred.map(|e| e.map(|v| v.max(0.0))).collect()
    }

    /// The blurred energy of a lamp's footprint in each cell.
    fn lamp_cells(&self, footprint: &Footprint, table: &ResponseTable) -> Vec<[f32; 3]> {
        let background = footprint.background(table);
        let mut energy = vec![[0.0f32; 3]; self.cells()];
        for (pixel, code) in footprint
            .pixels
            .iter()
            .filter(|(p, _)| self.comparable[*p as usize])
        {
            let place = *pixel as usize;
            let light = table.rgb(*code);
            let cell = &mut energy[usize::from(self.cell_of_pixel[place])];
            for c in 0..3 {
                cell[c] +=
                    (light[c] - background[c]).max(0.0) * self.ball.pixels[place].solid_angle;
            }
        }
        self.blurred(&energy)
    }

    pub(super) fn cells(&self) -> usize {
        self.blur.len().isqrt()
    }

    fn blurred(&self, energy: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let n = self.cells();
        let lit: Vec<usize> = (0..n).filter(|&i| energy[i] != [0.0; 3]).collect();
        let at = |cell: usize| {
            lit.iter().fold([0.0f32; 3], |sum, &from| {
                let k = self.blur[cell * n + from];
                [0, 1, 2].map(|c| sum[c] + k * energy[from][c])
            })
        };
        (0..n).map(at).collect()
    }
}
