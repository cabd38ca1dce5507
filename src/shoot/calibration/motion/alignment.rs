//! Position of the subject in each of a pose's pictures, relative to the others.
//!
//! Each picture is predicted from the pose's others: an OLAT as their nearest sum, because the light of one lamp is
//! nearly a sum of its neighbours'; a tracking frame as their mean. The residual is motion where it equals the
//! pictures' gradient times a shift of the body or a rotation of the head. All shifts of a pose are solved
//! together, the motion is removed from the pictures, and the process repeats. Poorly fitting pixels (a highlight,
//! a shadow's edge) count less (Huber).

use super::pixels::{between, combined, dot, product};
use crate::cholesky::Cholesky;
use footage::motion::head_turn;
use imaging::Mask;
use rayon::prelude::*;

/// Shifts per picture: the body's to the right and down, and the face's relative to it.
pub const SHIFTS: usize = 4;
/// Rounds of removing the motion and aligning again.
const ROUNDS: usize = 4;
/// Errors of the prediction: relative to the prediction, to the mean picture, and to the mean picture's level.
const RELATIVE: [f32; 3] = [0.15, 0.05, 0.02];
/// Ridge as a share of the mean square, which keeps the sum of other lamps from fitting noise.
const RIDGE: f64 = 1e-3;
/// Residuals beyond this many typical ones count less.
const HUBER: f32 = 3.0;
/// Margin in pixels around the matte for the subject's motion.
const MARGIN: usize = 3;
/// Smallest share of a picture in a prediction for its motion to count there.
const LEAST_SHARE: f64 = 0.02;

/// Method that predicts a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prediction {
    /// Nearest sum of the others.
    OtherLamps,
    /// Mean of the others, times a factor.
    Mean,
}

/// Position of the subject in each picture minus the mean, relative to the picture's side.
#[derive(Clone, Debug)]
pub struct Alignment {
    pub shifts: Vec<[f64; SHIFTS]>,
    /// Covariance of the errors, assuming independent pixel errors: a row for each shift of each picture.
    pub noise: Vec<f64>,
}

/// The pictures of one pose, grey and linear.
pub struct Pictures {
    pictures: Vec<Vec<f32>>,
    side: usize,
    /// Pixels that may show the subject.
    shown: Vec<usize>,
    /// Motion of each pixel per rotation of the head.
    head: Vec<f32>,
}

/// The pictures with the motion removed, at the visible pixels.
struct Unmoved {
    light: Vec<Vec<f32>>,
    /// Derivatives to the right and down.
    slopes: Vec<[Vec<f32>; 2]>,
}

/// Contribution of one picture to the equations for all shifts.
struct Equations {
    gram: Vec<f64>,
    target: Vec<f64>,
    residual: Vec<f32>,
    /// Weighted sum of its squares.
    misfit: f64,
    prediction: Vec<f32>,
}

impl Pictures {
    /// Pictures of one size, with their matte.
    pub fn new(pictures: Vec<Vec<f32>>, matte: &Mask) -> Self {
        let side = matte.width;
        let near = |i: usize| {
            let (x, y) = (i % side, i / side);
            let reach = |at: usize| at.saturating_sub(MARGIN)..(at + MARGIN + 1).min(side);
            reach(y).any(|y| reach(x).any(|x| matte.at(x, y) > 0.02))
        };
        Self { pictures, side, shown: (0..side * side).filter(|&i| near(i)).collect(), head: head_turn(matte).pixels }
    }

    /// Aligns the pictures; `None` if they carry too little information.
    pub fn align(&self, prediction: Prediction) -> Option<Alignment> {
        let count = self.pictures.len();
        if count < 3 || self.shown.len() < 50 {
            return None;
        }
        let mut shifts = vec![[0.0f64; SHIFTS]; count];
        let mut trust = vec![vec![1.0f32; self.shown.len()]; count];
        let mut predicted: Option<Vec<Vec<f32>>> = None;
        let mut noise = vec![];
        for round in 0..ROUNDS {
            let unmoved = self.unmoved(&shifts);
            let floor = self.floor(&unmoved.light)?;
            let expected = predicted.as_ref().unwrap_or(&unmoved.light);
            let equations: Vec<Equations> = (0..count)
                .into_par_iter()
                .map(|i| {
                    let weights = weights(&expected[i], &floor, Some(&trust[i]));
                    self.equations(&unmoved, i, &weights, prediction)
                })
                .collect::<Option<_>>()?;
            let (step, normal) = solve(&equations, count)?;
            for (shift, step) in shifts.iter_mut().zip(step.chunks(SHIFTS)) {
                for (value, step) in shift.iter_mut().zip(step) {
                    // No step exceeds the range of the gradient.
                    *value += (step / self.side as f64).clamp(-0.03, 0.03);
                }
            }
            trust = trusts(&equations, &floor);
            let misfit: f64 = equations.iter().map(|e| e.misfit).sum();
            predicted = Some(equations.into_iter().map(|e| e.prediction).collect());
            if round + 1 == ROUNDS {
                let variance = misfit / (count * self.shown.len() * self.side * self.side) as f64;
                noise = normal.inverse();
                noise.iter_mut().for_each(|v| *v *= variance);
            }
        }
        let mut mean = [0.0; SHIFTS];
        for shift in &shifts {
            (0..SHIFTS).for_each(|k| mean[k] += shift[k] / count as f64);
        }
        for shift in &mut shifts {
            (0..SHIFTS).for_each(|k| shift[k] -= mean[k]);
        }
        let is_sound = shifts.iter().flatten().all(|v: &f64| v.is_finite() && v.abs() < 0.2);
        is_sound.then_some(Alignment { shifts, noise })
    }

    /// The pictures with the subject in its middle place.
    fn unmoved(&self, shifts: &[[f64; SHIFTS]]) -> Unmoved {
        let side = self.side;
        let made = self.pictures.par_iter().zip(shifts).map(|(picture, shift)| {
            let shift = shift.map(|v| (v * side as f64) as f32);
            let light: Vec<f32> = (0..side * side)
                .map(|i| {
                    let turn = self.head[i];
                    let x = (i % side) as f32 + shift[0] + turn * shift[2];
                    let y = (i / side) as f32 + shift[1] + turn * shift[3];
                    between(picture, side, x, y)
                })
                .collect();
            let at = |x: usize, y: usize| light[y.min(side - 1) * side + x.min(side - 1)];
            // Scharr derivatives, and the light with the same blur across.
            let blur = |value: &dyn Fn(usize) -> f32, i: usize| {
                (3.0 * value(i.saturating_sub(1)) + 10.0 * value(i) + 3.0 * value(i + 1)) / 16.0
            };
            let half = |value: &dyn Fn(usize) -> f32, i: usize| 0.5 * (value(i + 1) - value(i.saturating_sub(1)));
            let pick = |f: &dyn Fn(usize, usize) -> f32| -> Vec<f32> {
                self.shown.iter().map(|&i| f(i % side, i / side)).collect()
            };
            (
                pick(&|x, y| blur(&|y| blur(&|x| at(x, y), x), y)),
                [
                    pick(&|x, y| blur(&|y| half(&|x| at(x, y), x), y)),
                    pick(&|x, y| half(&|y| blur(&|x| at(x, y), x), y)),
                ],
            )
        });
        let (light, slopes) = made.unzip();
        Unmoved { light, slopes }
    }

    /// Errors independent of the picture's own light; `None` if everything is black.
    fn floor(&self, light: &[Vec<f32>]) -> Option<Vec<f32>> {
        let mut mean = vec![0.0f32; self.shown.len()];
        for picture in light {
            mean.iter_mut().zip(picture).for_each(|(m, v)| *m += v / light.len() as f32);
        }
        let level = mean.iter().sum::<f32>() / mean.len() as f32;
        (level > 0.0 && level.is_finite()).then(|| mean.iter().map(|m| RELATIVE[1] * m + RELATIVE[2] * level).collect())
    }

    /// Equations of picture `i` for all shifts; `None` if it cannot be predicted.
    fn equations(&self, unmoved: &Unmoved, i: usize, weights: &[f32], prediction: Prediction) -> Option<Equations> {
        let count = unmoved.light.len();
        let own = &unmoved.light[i];
        let others: Vec<usize> = (0..count).filter(|&j| j != i).collect();
        let weighted: Vec<Vec<f32>> = (others.iter()).map(|&j| product(&unmoved.light[j], weights)).collect();
        let (shares, normal) = match prediction {
            Prediction::Mean => {
                let mean = combined(&others, &vec![1.0; others.len()], |j| &unmoved.light[j]);
                let weighted = product(&mean, weights);
                let share = dot(&weighted, own) / dot(&weighted, &mean);
                (vec![share; others.len()], None)
            }
            Prediction::OtherLamps => {
                let normal = Normal::new(&weighted, |a| &unmoved.light[others[a]])?;
                let target: Vec<f64> = weighted.iter().map(|w| dot(w, own)).collect();
                (normal.factor.solve(&target), Some(normal))
            }
        };
        let predicted = combined(&others, &shares, |j| &unmoved.light[j]);
        let residual: Vec<f32> = own.iter().zip(&predicted).map(|(a, b)| a - b).collect();
        let designs: Vec<Design> = (self.moved(unmoved, i, &others, &shares).into_iter())
            .map(|(row, pixels)| {
                let weighted_pixels = product(&pixels, weights);
                let (cross, explained) = match &normal {
                    Some(normal) => {
                        let cross: Vec<f64> = weighted.iter().map(|w| dot(w, &pixels)).collect();
                        let explained = normal.factor.solve(&cross);
                        (cross, explained)
                    }
                    None => (vec![], vec![]),
                };
                Design { row, pixels, weighted: weighted_pixels, cross, explained }
            })
            .collect();
        let ridge = normal.map_or(0.0, |normal| normal.ridge);
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let unknowns = count * SHIFTS;
        let (mut gram, mut target) = (vec![0.0; unknowns * unknowns], vec![0.0; unknowns]);
        // The part of a design explained by other shares carries no information about motion. By the equations of
        // the shares, it need not be subtracted pixel by pixel.
        for (a, one) in designs.iter().enumerate() {
            target[one.row] += dot(&one.weighted, &residual) - ridge * sum(&one.explained, &shares);
            for other in &designs[..=a] {
                let v = dot(&one.weighted, &other.pixels)
                    - sum(&one.cross, &other.explained)
                    - ridge * sum(&one.explained, &other.explained);
                gram[one.row * unknowns + other.row] += v;
                if one.row != other.row {
                    gram[other.row * unknowns + one.row] += v;
                }
            }
        }
        Some(Equations {
            gram,
            target,
            misfit: dot(&product(&residual, weights), &residual),
            residual,
            prediction: predicted,
        })
    }

    /// Change of the residuals when a picture is shifted, as its own prediction error and as part of the others'
    /// predictions.
    fn moved(&self, unmoved: &Unmoved, i: usize, others: &[usize], shares: &[f64]) -> Vec<(usize, Vec<f32>)> {
        let column = |slopes: &[f32], share: f32, turns: bool| -> Vec<f32> {
            let pixels = slopes.iter().zip(&self.shown);
            if turns {
                pixels.map(|(v, &p)| share * v * self.head[p]).collect()
            } else {
                pixels.map(|(v, _)| share * v).collect()
            }
        };
        let mut designs = Vec::new();
        for axis in 0..2 {
            let slopes = combined(others, shares, |j| &unmoved.slopes[j][axis]);
            for (turns, k) in [(false, axis), (true, axis + 2)] {
                designs.push((i * SHIFTS + k, column(&slopes, -1.0, turns)));
                for (&j, &share) in others.iter().zip(shares) {
                    if share.abs() >= LEAST_SHARE {
                        let design = column(&unmoved.slopes[j][axis], share as f32, turns);
                        designs.push((j * SHIFTS + k, design));
                    }
                }
            }
        }
        designs
    }
}

/// Equations for the shares of other pictures in a prediction.
struct Normal {
    factor: Cholesky,
    /// Amount added to the diagonal.
    ridge: f64,
}

impl Normal {
    /// Equations from the pictures, also multiplied by the weights of their pixels; `None` if all are black.
    fn new<'a>(weighted: &[Vec<f32>], light: impl Fn(usize) -> &'a Vec<f32>) -> Option<Self> {
        let n = weighted.len();
        let mut gram = vec![0.0; n * n];
        for a in 0..n {
            for b in 0..=a {
                let v = dot(&weighted[a], light(b));
                (gram[a * n + b], gram[b * n + a]) = (v, v);
            }
        }
        let ridge = RIDGE * (0..n).map(|a| gram[a * n + a]).sum::<f64>() / n as f64;
        (0..n).for_each(|a| gram[a * n + a] += ridge);
        let factor = Cholesky::new(gram, n)?;
        Some(Self { factor, ridge })
    }
}

/// Effect of a shift on a residual.
struct Design {
    /// Index of the shift among all.
    row: usize,
    pixels: Vec<f32>,
    /// Effect times the weights.
    weighted: Vec<f32>,
    /// Products with the other pictures, and the nearest shares of these.
    cross: Vec<f64>,
    explained: Vec<f64>,
}

/// Shifts in pixels with the least error and mean 0, and the matrix of their equations.
fn solve(equations: &[Equations], count: usize) -> Option<(Vec<f64>, Cholesky)> {
    let n = count * SHIFTS;
    let (mut gram, mut target) = (vec![0.0; n * n], vec![0.0; n]);
    for one in equations {
        gram.iter_mut().zip(&one.gram).for_each(|(sum, v)| *sum += v);
        target.iter_mut().zip(&one.target).for_each(|(sum, v)| *sum += v);
    }
    let mean = (0..n).map(|i| gram[i * n + i]).sum::<f64>() / n as f64;
    if !(mean > 0.0 && mean.is_finite()) {
        return None;
    }
    for a in 0..n {
        gram[a * n + a] += 1e-6 * mean;
        for b in (a % SHIFTS..n).step_by(SHIFTS) {
            gram[a * n + b] += mean;
        }
    }
    let normal = Cholesky::new(gram, n)?;
    Some((normal.solve(&target), normal))
}

/// Weight of each pixel's squared residual.
fn weights(predicted: &[f32], floor: &[f32], trust: Option<&Vec<f32>>) -> Vec<f32> {
    let each = predicted.iter().zip(floor).enumerate();
    each.map(|(i, (light, floor))| {
        let own = RELATIVE[0] * light.max(0.0);
        trust.map_or(1.0, |t| t[i]) / (own * own + floor * floor)
    })
    .collect()
}

/// Weight of each pixel of each picture: lower where it fits worse than usual in that picture.
fn trusts(equations: &[Equations], floor: &[f32]) -> Vec<Vec<f32>> {
    let each = equations.iter().map(|e| {
        let weights = weights(&e.prediction, floor, None);
        let errors: Vec<f32> = (e.residual.iter().zip(&weights)).map(|(r, w)| r.abs() * w.sqrt()).collect();
        let mut sorted = errors.clone();
        sorted.sort_by(f32::total_cmp);
        // The median of a normal distribution's absolute values is 0.6745 deviations.
        let typical = (sorted[sorted.len() / 2] / 0.6745).max(1e-6);
        errors.iter().map(|e| 1.0 / (e / typical / HUBER).max(1.0)).collect()
    });
    each.collect()
}
