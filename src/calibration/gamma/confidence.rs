//! How certain the fit is: standard deviations that hold although errors are not independent.
//!
//! The curvature of the cost alone would be too certain: it takes errors for independent, but a pose that is darker
//! than the frames is darker in all its quantiles, and a lamp that has moved has moved in all its pixels. So each
//! group of errors (a pose, a frame, a lamp's pixels, a part of a picture) pulls at the answer with a force of its
//! own, and the spread of these forces replaces the curvature's own idea of it: the sandwich A⁻¹·B·A⁻¹ of White
//! (1982) and Liang and Zeger (1986), A the curvature and B the covariance of the forces.

use super::objective::{BLOCKS, LinearPictures, Objective, rounding};
use super::subject::Quantiles;
use super::{GAMMA_PRIOR, bounds};
use crate::code_values::ResponseTable;
use glam::{DMat2, DMat3, DVec2, DVec3};

/// The smallest relative error of a lamp's weight: what 8 bits and the blur of the comparison leave where the truth
/// is known.
const WEIGHT_ERROR: f32 = 0.005;
/// Step of ln exposure for finite differences.
const EXPOSURE_STEP: f64 = 0.02;
/// Steps of the exponents: the first, and the smallest and largest later. With smaller ones the roughness of 8-bit
/// data shows; with larger ones the cost is not a parabola.
const STEPS: [f64; 3] = [0.03, 0.01, 0.1];

/// Standard deviations of γ1, γ2 and ln exposure at the fit. None is larger than that of its prior.
pub(super) fn deviation(
    objective: &Objective,
    [gamma1, gamma2]: [f64; 2],
    log_exposure: f64,
) -> [f32; 3] {
    let at = DVec2::new(gamma1, gamma2);
    let [first, least, most] = STEPS;
    // The cost is nearly flat along its valley and steep across it. The first round steps along γ1 and γ2 and finds
    // the valley; the second steps along and across it, by about one deviation.
    let mut steps = DMat2::from_diagonal(DVec2::splat(first));
    let mut found = None;
    for _ in 0..2 {
        found = Neighbours::see(objective, at, steps, log_exposure).and_then(|n| n.covariance());
        let Some(covariance) = found else { break };
        let (axes, variances) = axes(DMat2::from_cols(
            covariance.x_axis.truncate(),
            covariance.y_axis.truncate(),
        ));
        let length = |variance: f64| variance.sqrt().clamp(least, most);
        steps = DMat2::from_cols(
            axes.x_axis * length(variances.x),
            axes.y_axis * length(variances.y),
        );
    }
    let prior = [GAMMA_PRIOR.1, GAMMA_PRIOR.1, objective.exposure.deviation];
    found.map_or(prior.map(|p| p as f32), |covariance| {
        [0, 1, 2].map(|i| covariance.col(i)[i].sqrt().min(prior[i]) as f32)
    })
}

/// Unit axes and variances of a covariance of two unknowns.
fn axes(covariance: DMat2) -> (DMat2, DVec2) {
    let (a, b, c) = (
        covariance.x_axis.x,
        covariance.x_axis.y,
        covariance.y_axis.y,
    );
    let turn = DVec2::from_angle(0.5 * (2.0 * b).atan2(a - c));
    let axes = DMat2::from_cols(turn, turn.perp());
    let along = |axis: DVec2| axis.dot(covariance * axis).max(0.0);
    (axes, DVec2::new(along(axes.x_axis), along(axes.y_axis)))
}

/// The pictures around the fit. Derivatives are per step along two directions of the exponents, and per
/// [`EXPOSURE_STEP`].
struct Neighbours<'a> {
    objective: &'a Objective<'a>,
    /// At −1, 0 and 1 steps along the first direction, and within that along the second.
    linear: Vec<LinearPictures>,
    steps: DMat2,
    log_exposure: f64,
    /// How the encoded subject changes, for each of its pairs.
    slopes: Vec<DVec3>,
    /// The share of a pair's error in the gradient of half the cost.
    scale: f64,
}

impl<'a> Neighbours<'a> {
    fn see(
        objective: &'a Objective<'a>,
        at: DVec2,
        steps: DMat2,
        log_exposure: f64,
    ) -> Option<Self> {
        // Near a bound, the neighbourhood moves inside by as much as the steps need.
        let reach = steps.x_axis.abs() + steps.y_axis.abs();
        let (low, high) = bounds();
        let at = at.clamp(DVec2::splat(low) + reach, DVec2::splat(high) - reach);
        let mut linear = Vec::new();
        for i in -1..=1 {
            for j in -1..=1 {
                let place = at + steps * DVec2::new(f64::from(i), f64::from(j));
                linear.push(objective.linearize([place.x, place.y])?);
            }
        }
        let mut neighbours = Self {
            objective,
            linear,
            steps,
            log_exposure,
            slopes: vec![],
            scale: 0.0,
        };
        let x = log_exposure;
        let middle = neighbours.at(0, 0);
        let square = middle.subject_square(x) + objective.subject_floor.powi(2);
        let scale = objective.subject_count / (square * middle.pairs.len().max(1) as f64);
        let rise = |from: Vec<f64>, to: Vec<f64>| -> Vec<f64> {
            from.iter().zip(to).map(|(a, b)| 0.5 * (b - a)).collect()
        };
        let rises = [
            rise(
                neighbours.at(-1, 0).encoded(x),
                neighbours.at(1, 0).encoded(x),
            ),
            rise(
                neighbours.at(0, -1).encoded(x),
                neighbours.at(0, 1).encoded(x),
            ),
            rise(
                middle.encoded(x - EXPOSURE_STEP),
                middle.encoded(x + EXPOSURE_STEP),
            ),
        ];
        let slope = |i: usize| DVec3::from_array([0, 1, 2].map(|axis: usize| rises[axis][i]));
        let slopes = (0..middle.pairs.len()).map(slope).collect();
        (neighbours.slopes, neighbours.scale) = (slopes, scale);
        Some(neighbours)
    }

    fn at(&self, i: i32, j: i32) -> &LinearPictures {
        &self.linear[(3 * (i + 1) + j + 1) as usize]
    }

    /// The covariance of γ1, γ2 and ln exposure; `None` if the curvature is not that of a minimum, when only the
    /// priors are known.
    fn covariance(&self) -> Option<DMat3> {
        let to_unknowns = DMat3::from_cols(
            self.steps.x_axis.extend(0.0),
            self.steps.y_axis.extend(0.0),
            DVec3::Z * EXPOSURE_STEP,
        );
        let priors = DMat3::from_diagonal(DVec3::new(
            GAMMA_PRIOR.1.powi(-2),
            GAMMA_PRIOR.1.powi(-2),
            self.objective.exposure.deviation.powi(-2),
        ));
        let priors = to_unknowns.transpose() * priors * to_unknowns;
        let subject = self
            .slopes
            .iter()
            .map(|s| outer(*s))
            .fold(DMat3::ZERO, |sum, square| sum + square)
            * self.scale;
        let inverse = (subject + self.ball_curvature() + priors).inverse();
        let forces = self.subject_forces() + self.ball_forces() + priors;
        let back = |m: DMat3| to_unknowns * m * to_unknowns.transpose();
        let (by_curvature, mut covariance) = (back(inverse), back(inverse * forces * inverse));
        for i in 0..3 {
            // Few groups can agree by chance: errors are never smaller than if they were independent.
            let least = by_curvature.col(i)[i];
            let found = covariance.col(i)[i];
            if !(least.is_finite() && least > 0.0 && found.is_finite()) {
                return None;
            }
            covariance.col_mut(i)[i] = found.max(least);
        }
        Some(covariance)
    }

    fn ball_scale(&self) -> f64 {
        let square = self.objective.ball_square(&self.at(0, 0).ball) + rounding().powi(2);
        self.objective.ball_count / square
    }

    /// Half the second derivatives of the balls' cost, from the squared distance, which is close to a parabola over
    /// a wider range than its logarithm.
    fn ball_curvature(&self) -> DMat3 {
        let square = |i: i32, j: i32| self.objective.ball_square(&self.at(i, j).ball);
        let middle = square(0, 0);
        let first = square(1, 0) - 2.0 * middle + square(-1, 0);
        let second = square(0, 1) - 2.0 * middle + square(0, -1);
        let mixed = (square(1, 1) - square(1, -1) - square(-1, 1) + square(-1, -1)) / 4.0;
        let scale = 0.5 * self.ball_scale();
        scale
            * DMat3::from_cols(
                DVec3::new(first, mixed, 0.0),
                DVec3::new(mixed, second, 0.0),
                DVec3::ZERO,
            )
    }

    /// Covariance of the forces on the balls, a group for each lamp.
    fn ball_forces(&self) -> DMat3 {
        let pixels = self.objective.probes.profile_pixels().max(1) as f64;
        let scale = 0.5 * self.ball_scale() / pixels;
        let forces: Vec<DVec3> = (0..self.at(0, 0).ball.squares.len())
            .map(|lamp| {
                let square = |i: i32, j: i32| self.at(i, j).ball.squares[lamp];
                let rise = DVec3::new(
                    square(1, 0) - square(-1, 0),
                    square(0, 1) - square(0, -1),
                    0.0,
                );
                0.5 * scale * rise
            })
            .collect();
        spread(&forces)
    }

    /// Covariance of the forces on the subject: a group for each pose and each frame, or for each part
    /// of the pixels, and one for each lamp's weight.
    fn subject_forces(&self) -> DMat3 {
        let (objective, middle) = (self.objective, self.at(0, 0));
        if !objective.matched.is_empty() {
            let errors: Vec<f64> = (middle.encoded(self.log_exposure).iter().zip(&middle.pairs))
                .map(|(found, (_, is))| found - f64::from(*is))
                .collect();
            let part = errors.len().div_ceil(BLOCKS).max(1);
            let forces: Vec<DVec3> = errors
                .chunks(part)
                .zip(self.slopes.chunks(part))
                .map(|(errors, slopes)| self.force(errors, slopes))
                .collect();
            return spread(&forces) + self.weight_forces();
        }
        let exposure = self.log_exposure.exp() as f32;
        let poses = objective.pose_quantiles(&middle.table, &middle.weights, exposure);
        let frames = &objective.subject.frame_quantiles;
        let forces = |pictures: &[Quantiles]| -> Vec<DVec3> {
            let share = 1.0 / pictures.len() as f64;
            let force = |picture: &Quantiles| {
                let errors: Vec<f64> = picture.iter().flatten().map(|q| f64::from(*q)).collect();
                share * self.force(&errors, &self.slopes)
            };
            pictures.iter().map(force).collect()
        };
        let of_frames = spread(&forces(frames));
        // A single pose is assumed to vary as much as a single frame does.
        let of_poses = if poses.len() > 1 {
            spread(&forces(&poses))
        } else {
            of_frames * frames.len() as f64
        };
        of_frames + of_poses + self.weight_forces()
    }

    /// Covariance of the forces of the lamps' weights, whose error all pixels share: the difference between the
    /// weight from a lamp's whole light and the weight from its pixels one by one.
    fn weight_forces(&self) -> DMat3 {
        let linear = self.at(0, 0);
        let here = linear.encoded(self.log_exposure);
        let mut sum = DMat3::ZERO;
        for (lamp, other) in linear.ball.weights.iter().enumerate() {
            let mut weights = linear.weights.clone();
            for (weight, other) in weights[lamp].iter_mut().zip(other) {
                // A lamp without pixels of its own has no weight there.
                let is_known = *weight > 0.0 && *other > 0.0;
                let error = if is_known {
                    (other / *weight - 1.0).abs()
                } else {
                    0.0
                };
                *weight *= 1.0 + error.clamp(WEIGHT_ERROR, 1.0);
            }
            let pairs = self.objective.pairs(&linear.table, &weights);
            let moved = encoded(&linear.table, &pairs, self.log_exposure);
            let errors: Vec<f64> = moved.iter().zip(&here).map(|(a, b)| a - b).collect();
            sum += outer(self.force(&errors, &self.slopes));
        }
        sum
    }

    /// The force with which errors of some pairs pull.
    fn force(&self, errors: &[f64], slopes: &[DVec3]) -> DVec3 {
        let pairs = errors.iter().zip(slopes);
        self.scale * pairs.map(|(error, slope)| *error * *slope).sum::<DVec3>()
    }
}

impl LinearPictures {
    /// The subject's encoded values at an exposure.
    fn encoded(&self, log_exposure: f64) -> Vec<f64> {
        encoded(&self.table, &self.pairs, log_exposure)
    }
}

fn encoded(table: &ResponseTable, pairs: &[(f32, f32)], log_exposure: f64) -> Vec<f64> {
    let exposure = log_exposure.exp() as f32;
    let encode = |(light, _): &(f32, f32)| f64::from(table.encode(exposure * light));
    pairs.iter().map(encode).collect()
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// The covariance of the sum of the forces of equal groups, from their spread about their mean.
fn spread(forces: &[DVec3]) -> DMat3 {
    let n = forces.len() as f64;
    if n < 2.0 {
        return DMat3::ZERO;
    }
    let mean = forces.iter().sum::<DVec3>() / n;
    let squares = forces.iter().map(|force| outer(*force - mean));
    squares.fold(DMat3::ZERO, |sum, square| sum + square) * (n / (n - 1.0))
}
