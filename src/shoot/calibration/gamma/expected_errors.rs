//! Expected distance between the quantiles of the relit poses and of the interview under the right response. It is
//! not zero, because poses differ from frames and the relighting weights are not exact.

use super::brightness::ONES;
use super::objective::{LinearPictures, Objective};
use super::subject::{QUANTILES, Quantiles};
use crate::code_values::ResponseTable;
use glam::{DMat3, DVec3};
use std::ops::Range;

/// Smallest relative error of a lamp's weight: the effect of 8 bits and of the comparison's blur, measured with
/// known truth.
const WEIGHT_ERROR: f32 = 0.005;
/// Largest relative error where the light is not a sum of lamps, so that single pixels say little about a weight.
const WEIGHT_ERROR_BESIDE_REMAINDER: f32 = 0.1;
/// Brightness error of the subject from errors common to several lamps, relative to that of independent errors and
/// added to it. Light between lamps causes common errors. Measured on random shoots at the true response.
const SHARED_BRIGHTNESS: f64 = 1.5;
/// Step of ln exposure.
const BRIGHTER: f64 = 0.02;
/// Factor for the underestimated spread of a few poses and frames: the deviation of Student's distribution with
/// five degrees of freedom, to which the covariance is widened.
const FEW_PICTURES: f64 = 1.3;
/// Differences between poses and frames not present in the sample, relative to the present ones.
const UNSEEN_DIFFERENCE: f64 = 0.4;
/// Distance between encoded quantiles of a single pose and a single frame: heads rotated by 20°.
const ONE_POSE_AND_FRAME: f64 = 0.02;

impl Objective<'_> {
    /// Expected distance between quantiles under the right response, because poses and frames differ: the
    /// differences of each from their mean, as parts of the error of that mean.
    pub fn differences(&self, table: &ResponseTable, weights: &[[f32; 3]], log_factors: DVec3) -> Vec<Vec<f64>> {
        let frames = &self.subject.frame_quantiles;
        let poses = self.pose_quantiles(table, weights, log_factors);
        // A single picture is assumed to vary as much as one of the others.
        let deviations = |pictures: &[Quantiles], others: &[Quantiles]| match pictures.len() {
            0 | 1 => from_mean(others, (others.len() as f64).sqrt()),
            _ => from_mean(pictures, 1.0),
        };
        let mut differences = deviations(frames, &poses);
        differences.extend(deviations(&poses, frames));
        let square: f64 = differences.iter().flatten().map(|d| d * d).sum();
        let typical = match differences.len() {
            0 => ONE_POSE_AND_FRAME,
            _ => (square / (3 * QUANTILES) as f64).sqrt(),
        };
        for difference in differences.iter_mut().flatten() {
            *difference *= FEW_PICTURES;
        }
        differences.extend(waves(UNSEEN_DIFFERENCE * typical));
        differences
    }

    /// Errors of the interview's light, common to all pixels: the light on the ball that the lamps do not explain
    /// (see [`Probes::weight_errors`]), and each lamp's own error, the difference between the weight from its full
    /// light and the weight from its single pixels.
    pub fn light_errors(&self, linear: &LinearPictures, log_factors: DVec3) -> LightErrors {
        let here = linear.encoded(log_factors);
        let moved = |change: &[[f32; 3]]| -> Vec<f64> {
            let weights: Vec<[f32; 3]> =
                (linear.weights.iter().zip(change)).map(|(w, change)| [0, 1, 2].map(|c| w[c] + change[c])).collect();
            let pairs = self.pairs(&linear.table, &weights);
            let there = pairs.encoded(&linear.table, log_factors);
            there.iter().zip(&here).map(|(a, b)| a - b).collect()
        };
        let there = linear.encoded(log_factors + BRIGHTER);
        let slope: Vec<f64> = (there.iter().zip(&here)).map(|(a, b)| (a - b) / BRIGHTER).collect();
        let mut errors = LightErrors { quantiles: vec![], brightness: DMat3::ZERO };
        for change in self.probes.weight_errors(&linear.table) {
            errors.add(moved(&change), &slope);
        }
        let shared = DVec3::ONE.dot(errors.brightness * DVec3::ONE) / 9.0;
        errors.brightness += ONES * (shared * SHARED_BRIGHTNESS.powi(2));
        let is_sum = self.remainder <= 0.0;
        let largest = if is_sum { 1.0 } else { WEIGHT_ERROR_BESIDE_REMAINDER };
        for (lamp, other) in linear.ball.weights.iter().enumerate() {
            let mut change = vec![[0.0; 3]; linear.weights.len()];
            change[lamp] = [0, 1, 2].map(|c: usize| {
                let weight = linear.weights[lamp][c];
                // A lamp without its own pixels has no weight there.
                let is_known = weight > 0.0 && other[c] > 0.0;
                let difference = if is_known { other[c] / weight - 1.0 } else { 0.0 };
                weight * difference.abs().clamp(WEIGHT_ERROR, largest)
            });
            errors.add(moved(&change), &slope);
        }
        errors
    }
}

/// Errors of the interview's light and their effect on the subject's encoded quantiles. The effect on each
/// channel's brightness is fitted with the subject, so it is removed here.
pub(super) struct LightErrors {
    /// Independent errors of the quantiles.
    pub quantiles: Vec<Vec<f64>>,
    /// Covariance of ln light from all errors together.
    pub brightness: DMat3,
}

impl LightErrors {
    /// Adds an error, given the effect of a step of ln light.
    fn add(&mut self, mut error: Vec<f64>, slope: &[f64]) {
        let brighter = take_brightness(&mut error, slope);
        self.brightness += DMat3::from_cols(brighter * brighter.x, brighter * brighter.y, brighter * brighter.z);
        self.quantiles.push(error);
    }
}

/// Removes each channel's brightness change from an error of encoded quantiles, given the effect of a step of ln
/// light, and returns that change.
fn take_brightness(error: &mut [f64], slope: &[f64]) -> DVec3 {
    let mut change = [0.0; 3];
    let channels = error.chunks_exact_mut(QUANTILES).zip(slope.chunks_exact(QUANTILES));
    for (change, (error, slope)) in change.iter_mut().zip(channels) {
        let product = |a: &[f64]| -> f64 { a.iter().zip(slope).map(|(a, b)| a * b).sum() };
        *change = product(error) / product(slope).max(f64::MIN_POSITIVE);
        for (error, slope) in error.iter_mut().zip(slope) {
            *error -= *change * slope;
        }
    }
    DVec3::from_array(change)
}

/// Differences of several pictures' quantiles from their mean, scaled so that the sum of their squares is the
/// variance of the mean times `factor`²; empty for a single picture.
fn from_mean(pictures: &[Quantiles], factor: f64) -> Vec<Vec<f64>> {
    let n = pictures.len() as f64;
    if n < 2.0 {
        return vec![];
    }
    let scale = factor / (n * (n - 1.0)).sqrt();
    let values = |picture: &Quantiles| -> Vec<f64> { picture.iter().flatten().map(|q| f64::from(*q)).collect() };
    let pictures: Vec<Vec<f64>> = pictures.iter().map(values).collect();
    let mean = |i: usize| pictures.iter().map(|p| p[i]).sum::<f64>() / n;
    let means: Vec<f64> = (0..3 * QUANTILES).map(mean).collect();
    let from = |picture: &Vec<f64>| {
        let pairs = picture.iter().zip(&means);
        pairs.map(|(value, mean)| scale * (value - mean)).collect()
    };
    pictures.iter().map(from).collect()
}

/// Smooth errors along the quantiles, common to all channels and per channel, because a few pictures do not show
/// every possible difference. Both groups have about this deviation everywhere.
fn waves(deviation: f64) -> Vec<Vec<f64>> {
    const WAVES: usize = 6;
    let part = |wave: usize, channels: Range<usize>| {
        let value = move |i: usize| {
            let at = ((i % QUANTILES) as f64 + 0.5) / QUANTILES as f64;
            let height = (std::f64::consts::PI * wave as f64 * at).cos();
            let is_in = channels.contains(&(i / QUANTILES));
            f64::from(u8::from(is_in)) * height * deviation / (WAVES as f64).sqrt()
        };
        (0..3 * QUANTILES).map(value).collect()
    };
    (0..WAVES).flat_map(|wave| [0..3, 0..1, 1..2, 2..3].map(|channels| part(wave, channels))).collect()
}
