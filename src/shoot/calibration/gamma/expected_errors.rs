//! Expected distance between the quantiles of the relit poses and of the interview, even under the right
//! response: poses are not frames, and the weights that the poses are relit with are not exact.

use super::brightness::ONES;
use super::objective::{LinearPictures, Objective};
use super::subject::{QUANTILES, Quantiles};
use crate::code_values::ResponseTable;
use glam::{DMat3, DVec3};
use std::ops::Range;

/// The smallest relative error of a lamp's weight: what 8 bits and the blur of the comparison leave where the truth
/// is known.
const WEIGHT_ERROR: f32 = 0.005;
/// The largest where the light is no sum of lamps, so that pixels one by one say little about a weight.
const WEIGHT_ERROR_BESIDE_REMAINDER: f32 = 0.1;
/// Light between several lamps makes errors of all of them alike. They make the subject too bright or too dark by so many
/// times as much as errors that are independent would, beside these: measured on random shoots at the true response.
const SHARED_BRIGHTNESS: f64 = 1.5;
/// A step of ln exposure.
const BRIGHTER: f64 = 0.02;
/// By how much the spread of a handful of poses and frames underestimates that of all: the deviation of Student's
/// distribution of five degrees of freedom, to which the covariance is widened.
const FEW_PICTURES: f64 = 1.3;
/// Differences between poses and frames that those at hand do not show, relative to those that they show.
const UNSEEN_DIFFERENCE: f64 = 0.4;
/// Distance between encoded quantiles of one pose and one frame, where no others tell: heads that are turned by 20°.
const ONE_POSE_AND_FRAME: f64 = 0.02;

impl Objective<'_> {
    /// Expected distance between quantiles, even under the right response, because poses and frames
    /// differ: the differences of each from their mean, as parts of the error of that mean.
    pub fn differences(
        &self,
        table: &ResponseTable,
        weights: &[[f32; 3]],
        log_factors: DVec3,
    ) -> Vec<Vec<f64>> {
        let frames = &self.subject.frame_quantiles;
        let poses = self.pose_quantiles(table, weights, log_factors);
        // A single picture is assumed to vary as much as a single one of the others does.
        let of = |pictures: &[Quantiles], others: &[Quantiles]| match pictures.len() {
            0 | 1 => from_mean(others, (others.len() as f64).sqrt()),
            _ => from_mean(pictures, 1.0),
        };
        let mut differences = of(frames, &poses);
        differences.extend(of(&poses, frames));
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

    /// Errors of the interview's light, which all pixels share: what the lamps leave unexplained on the ball (see
    /// [`Probes::weight_errors`]), and each lamp's own error, the difference between the weight from its whole light and
    /// the weight from its pixels one by one.
    pub fn light_errors(&self, linear: &LinearPictures, log_factors: DVec3) -> LightErrors {
        let here = linear.encoded(log_factors);
        let moved = |change: &[[f32; 3]]| -> Vec<f64> {
            let weights: Vec<[f32; 3]> = (linear.weights.iter().zip(change))
                .map(|(w, change)| [0, 1, 2].map(|c| w[c] + change[c]))
                .collect();
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
                // A lamp without pixels of its own has no weight there.
                let is_known = weight > 0.0 && other[c] > 0.0;
                let difference = if is_known { other[c] / weight - 1.0 } else { 0.0 };
                weight * difference.abs().clamp(WEIGHT_ERROR, largest)
            });
            errors.add(moved(&change), &slope);
        }
        errors
    }
}

/// Errors of the interview's light, and what they do to the subject's encoded quantiles. What they do to the brightness
/// of each channel is fitted with the subject, so it is taken out of them.
pub(super) struct LightErrors {
    /// Independent errors of the quantiles.
    pub quantiles: Vec<Vec<f64>>,
    /// The covariance of ln light that they make together.
    pub brightness: DMat3,
}

impl LightErrors {
    /// Adds an error, given what a step of ln light does.
    fn add(&mut self, mut error: Vec<f64>, slope: &[f64]) {
        let brighter = take_brightness(&mut error, slope);
        self.brightness +=
            DMat3::from_cols(brighter * brighter.x, brighter * brighter.y, brighter * brighter.z);
        self.quantiles.push(error);
    }
}

/// Takes out of an error of encoded quantiles what is a change of each channel's brightness, given what a step of ln light
/// does to them, and returns that change.
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

/// The differences of several pictures' quantiles from their mean, such that the sum of their squares is the
/// variance of the mean times `factor`²; nothing for a single picture.
fn from_mean(pictures: &[Quantiles], factor: f64) -> Vec<Vec<f64>> {
    let n = pictures.len() as f64;
    if n < 2.0 {
        return vec![];
    }
    let scale = factor / (n * (n - 1.0)).sqrt();
    let values = |picture: &Quantiles| -> Vec<f64> {
        picture.iter().flatten().map(|q| f64::from(*q)).collect()
    };
    let pictures: Vec<Vec<f64>> = pictures.iter().map(values).collect();
    let mean = |i: usize| pictures.iter().map(|p| p[i]).sum::<f64>() / n;
    let means: Vec<f64> = (0..3 * QUANTILES).map(mean).collect();
    let from = |picture: &Vec<f64>| {
        let pairs = picture.iter().zip(&means);
        pairs.map(|(value, mean)| scale * (value - mean)).collect()
    };
    pictures.iter().map(from).collect()
}

/// Smooth errors along the quantiles, of all channels together and of each: so few pictures do not show all ways in
/// which they can differ. Together they have about this deviation everywhere, twice.
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
    (0..WAVES)
        .flat_map(|wave| [0..3, 0..1, 1..2, 2..3].map(|channels| part(wave, channels)))
        .collect()
}
