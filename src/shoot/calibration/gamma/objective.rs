//! Cost of a response: the distance from the relit poses to the interview, and from the sum of the lamps' balls to
//! the interview's ball.

use super::super::code_values::{self, ResponseTable, STEPS};
use super::super::probe::{NeighbourDifferences, Probes, Profile};
use super::brightness::{Brightness, ExposurePrior, LocalCost, ball_errors};
use super::covariance::Covariance;
use super::expected_errors::LightErrors;
use super::exponents::{GAMMA_PRIOR, gamma_prior};
use super::frame_match::MatchedPixel;
use super::subject::{Pose, QUANTILES, Quantiles, Subject, quantiles};
use glam::{DMat3, DVec3};
use imaging::{DualGamma, Response};

/// Pairs of the relit poses' light and the interview's encoded value: quantiles, channel by channel, or the channels of
/// pixels.
pub(super) struct Pairs {
    values: Vec<(f32, f32)>,
    are_pixels: bool,
}

impl Pairs {
    /// The channel of a pair.
    fn channel(&self, i: usize) -> usize {
        if self.are_pixels { i % 3 } else { i / QUANTILES }
    }

    /// Encoded values of the light times factors, given by their logarithms.
    pub fn encoded(&self, table: &ResponseTable, log_factors: DVec3) -> Vec<f64> {
        let factors = log_factors.to_array().map(|x| x.exp() as f32);
        let lights = self.values.iter().enumerate();
        lights.map(|(i, (light, _))| f64::from(table.encode(factors[self.channel(i)] * light))).collect()
    }
}

/// All pictures linearised by one response, before the exposure is chosen.
pub(super) struct LinearPictures {
    pub table: ResponseTable,
    pub weights: Vec<[f32; 3]>,
    pub pairs: Pairs,
    /// The balls, pixel by pixel.
    pub ball: Profile,
}

impl LinearPictures {
    /// Encoded values of the subject under ln factors on its light.
    pub fn encoded(&self, log_factors: DVec3) -> Vec<f64> {
        self.pairs.encoded(&self.table, log_factors)
    }

    /// Differences from the interview's values.
    fn errors(&self, log_factors: DVec3) -> Vec<f64> {
        let is = self.pairs.values.iter().map(|(_, is)| f64::from(*is));
        let found = self.encoded(log_factors).into_iter();
        found.zip(is).map(|(found, is)| found - is).collect()
    }

    /// Mean squared distance of the encoded subject.
    fn subject_square(&self, log_factors: DVec3) -> f64 {
        let errors = self.errors(log_factors);
        let square: f64 = errors.iter().map(|error| error * error).sum();
        square / errors.len().max(1) as f64
    }
}

/// Score of a response over all brightnesses of the interview.
#[derive(Clone, Copy, Debug)]
pub(super) struct Score {
    /// −2·ln of its probability, up to a constant and without the priors of the exponents.
    pub cost: f64,
    pub brightness: Brightness,
    /// Root-mean-square distances in encoded values.
    pub subject: f64,
    pub ball: f64,
}

impl Score {
    /// Factors on the lamps' weights, without the exposure.
    fn gains(&self) -> [f32; 3] {
        let Brightness { log_factors, log_exposure, .. } = self.brightness;
        (log_factors - log_exposure).to_array().map(|gain| gain.exp() as f32)
    }

    /// Lamp weights with the brightness and colour of the subject.
    pub fn weights(&self, linear: &LinearPictures) -> Vec<[f32; 3]> {
        let gains = self.gains();
        let mended = |weight: &[f32; 3]| [0, 1, 2].map(|c| gains[c] * weight[c]);
        linear.weights.iter().map(mended).collect()
    }
}

/// Cost function for comparing responses.
pub(super) struct Objective<'a> {
    pub subject: &'a Subject,
    pub probes: &'a Probes,
    /// Poses compared pixel by pixel with their frames; empty if distributions are compared.
    pub matched: Vec<&'a Pose>,
    /// Covariance of the errors of the pairs; `None` if pixels are compared.
    errors: Option<Covariance>,
    /// Covariance of ln light per channel from errors of the lamps' weights.
    light_error: DMat3,
    /// Number of independent errors among the compared pixels, and on the balls.
    pixel_count: f64,
    ball_count: f64,
    /// Variance of the light on the interview's ball that is not a sum of lamps; see [`Probes::profile`].
    pub remainder: f64,
    /// Assumption about the exposure.
    pub exposure: ExposurePrior,
    /// Mean square of the rounding errors of the interview's codes.
    rounding: f64,
}

/// The interview's light under a response that is not fitted.
pub(super) struct KnownLight {
    /// Weights of the lamps.
    pub weights: Vec<[f32; 3]>,
    /// Root-mean-square encoded distances of the subject and on the balls.
    pub distances: [f32; 2],
    pub exposure: f32,
}

impl<'a> Objective<'a> {
    /// Compares a subject and its probes by the pixels of `matched` (poses shown by a frame), or by distributions
    /// if `matched` is empty.
    pub fn new(subject: &'a Subject, probes: &'a Probes, matched: Vec<&'a Pose>) -> Self {
        let mut objective = Self {
            subject,
            probes,
            errors: None,
            light_error: DMat3::ZERO,
            pixel_count: BLOCKS as f64,
            ball_count: subject.lamps as f64,
            remainder: 0.0,
            exposure: ExposurePrior::LeftAlone,
            rounding: code_values::rounding(subject.frames.iter().flatten()),
            matched,
        };
        if objective.matched.is_empty() {
            let middle = DualGamma { gamma1: GAMMA_PRIOR.0 as f32, gamma2: GAMMA_PRIOR.0 as f32 };
            let table = ResponseTable::new(&middle);
            let weights = probes.weights(&table);
            let differences = objective.differences(&table, &weights, DVec3::ZERO);
            objective.errors = Covariance::new(3 * QUANTILES, &differences, MODEL_ERROR);
        }
        objective
    }

    /// Learns the expected errors from the best response so far. On the balls, the part of the distance explained
    /// by noise counts as an independent error per pixel. The rest, such as a moved ball, is one error per lamp, and
    /// fewer beyond [`MISFIT`]; beside a remainder it carries no information about the response. The pixels of
    /// a pose and its frame are treated likewise, with one error for each of [`BLOCKS`].
    pub fn weigh(&mut self, best: &LinearPictures) {
        let noise_share = |square: f64, noise: f64, rounding: f64| {
            let noise = noise.max(rounding);
            noise / square.max(noise)
        };
        self.remainder = best.ball.remainder();
        let ball = self.probes.profile(&best.table, self.remainder);
        let pixels = self.probes.profile_pixels() as f64;
        let noise = noise_share(self.ball_square(&ball), ball.noise, ball.rounding);
        let others = if self.remainder > 0.0 { 0.0 } else { pixels.min(self.subject.lamps as f64) };
        let others = (MISFIT * noise).min(1.0) * others;
        // Part of the misfit looks like noise. With this power, measured on random shoots, intervals have their
        // stated probability.
        let own = noise.powf(1.5);
        let count = own * pixels + (1.0 - own) * others;
        let shared = NOISE_BIAS * ball.noise.sqrt();
        self.ball_count = count / (1.0 + shared.powi(2) * count);
        let x = self.score(best).brightness.log_factors;
        if self.matched.is_empty() {
            let mut differences = self.differences(&best.table, &best.weights, x);
            let LightErrors { quantiles, brightness } = self.light_errors(best, x);
            differences.extend(quantiles);
            self.light_error = brightness;
            self.errors = Covariance::new(3 * QUANTILES, &differences, MODEL_ERROR);
            if let Some(errors) = &mut self.errors {
                errors.widen(&best.errors(x));
            }
        } else {
            let own = noise_share(best.subject_square(x), self.matched_noise(best, x), self.rounding);
            // Light beside the lamps errs alike in neighbouring pixels, and fine detail makes its error look like noise.
            let own = if self.remainder > 0.0 { 0.0 } else { own };
            let pixels = (best.pairs.values.len() / 3) as f64;
            self.pixel_count = own * pixels + (1.0 - own) * pixels.min(BLOCKS as f64);
        }
    }

    /// Mean square of the noise between poses and their frames.
    fn matched_noise(&self, linear: &LinearPictures, log_factors: DVec3) -> f64 {
        let mut channels: [NeighbourDifferences; 3] = Default::default();
        let errors = linear.errors(log_factors);
        let pixels = self.matched.iter().flat_map(|pose| self.matched_pixels(pose));
        for (pixel, errors) in pixels.zip(errors.chunks_exact(3)) {
            for (channel, error) in channels.iter_mut().zip(errors) {
                channel.add(pixel.place as usize, *error);
            }
        }
        channels.iter().map(NeighbourDifferences::noise).sum::<f64>() / 3.0
    }

    /// Pixels that compare a pose with its frame; two thousand in total are enough.
    fn matched_pixels(&self, pose: &'a Pose) -> impl Iterator<Item = &'a MatchedPixel> {
        let pixels = pose.frame_match.as_ref().map_or(&[][..], |frame_match| &frame_match.pixels);
        let step = (pixels.len() * self.matched.len()).div_ceil(MATCHED_PIXELS).max(1);
        let kept = pixels.iter().enumerate().filter(move |(i, _)| (i / 2) % step == 0);
        kept.map(|(_, pixel)| pixel)
    }

    /// Pairs of a pose's light and its frame's encoded value, by pixel and channel.
    fn matched_pairs(&self, pose: &'a Pose, table: &ResponseTable, weights: &[[f32; 3]]) -> Vec<(f32, f32)> {
        let encoded = |code: u16| f32::from(code) / f32::from(STEPS);
        self.matched_pixels(pose)
            .flat_map(|pixel| {
                let light = self.subject.relit_sample(pose, pixel.sample as usize, table, weights);
                [0, 1, 2].map(|c| (light[c], encoded(pixel.here[c])))
            })
            .collect()
    }

    /// The interview's light under a response that is not fitted, at an exposure or the best one.
    pub fn known_light(
        subject: &'a Subject,
        probes: &'a Probes,
        response: &Response,
        exposure: Option<f32>,
    ) -> KnownLight {
        let mut objective = Self::new(subject, probes, vec![]);
        let linear = objective.linearize_by(response);
        objective.weigh(&linear);
        let [alone, changed] =
            [ExposurePrior::LeftAlone, ExposurePrior::Changed].map(|prior| objective.score_under(prior, &linear));
        let score = if changed.cost < alone.cost { changed } else { alone };
        let exposure = exposure.unwrap_or(score.brightness.log_exposure.exp() as f32);
        let gains = score.gains().map(|gain| f64::from(gain * exposure).ln());
        let distances = [linear.subject_square(DVec3::from_array(gains)), objective.ball_square(&linear.ball)];
        let distances = distances.map(|square| square.sqrt() as f32);
        KnownLight { weights: score.weights(&linear), distances, exposure }
    }

    /// Pictures under two exponents; `None` if their curve is invalid.
    pub fn linearize(&self, [gamma1, gamma2]: [f64; 2]) -> Option<LinearPictures> {
        let curve = DualGamma::new(gamma1 as f32, gamma2 as f32).ok()?;
        Some(self.linearize_by(&Response::Dual(curve)))
    }

    /// Pictures under any response.
    pub fn linearize_by(&self, response: &Response) -> LinearPictures {
        let table = ResponseTable::from_response(response);
        let (weights, ball) =
            rayon::join(|| self.probes.weights(&table), || self.probes.profile(&table, self.remainder));
        LinearPictures { pairs: self.pairs(&table, &weights), weights, table, ball }
    }

    /// Compares the balls of the pictures again, under the latest remainder.
    pub fn profile_again(&self, grid: &mut [([f64; 2], LinearPictures)]) {
        for (_, linear) in grid {
            linear.ball = self.probes.profile(&linear.table, self.remainder);
        }
    }

    /// The relit subject paired with the interview.
    pub fn pairs(&self, table: &ResponseTable, weights: &[[f32; 3]]) -> Pairs {
        if !self.matched.is_empty() {
            let pairs = |pose: &&'a Pose| self.matched_pairs(pose, table, weights);
            return Pairs { values: self.matched.iter().flat_map(pairs).collect(), are_pixels: true };
        }
        let relit = self.subject.all_relit(table, weights);
        let channel_pairs = |c: usize| {
            let light = quantiles(relit.iter().map(|p| p[c]).collect());
            light.into_iter().zip(self.subject.interview[c])
        };
        Pairs { values: (0..3).flat_map(channel_pairs).collect(), are_pixels: false }
    }

    /// The 1 % and the 99 % quantile of the compared values: OLATs, frames and balls, encoded in `[0, 1]`.
    pub fn extent(&self) -> [f32; 2] {
        let subject = self.subject;
        let poses = subject.poses.iter().flat_map(|pose| &pose.codes);
        let codes = poses.chain(subject.frames.iter().flatten());
        let mut counts = vec![0u64; usize::from(STEPS) + 1];
        for code in codes.chain(self.probes.profile_codes()).flatten() {
            counts[usize::from(*code)] += 1;
        }
        let all: u64 = counts.iter().sum();
        [1, 99].map(|hundredths| {
            let mut below = 0;
            let code = counts.iter().position(|count| {
                below += count;
                100 * below >= hundredths * all
            });
            code.unwrap_or(0) as f32 / f32::from(STEPS)
        })
    }

    /// Mean squared distance on the balls.
    pub fn ball_square(&self, ball: &Profile) -> f64 {
        ball.square / self.probes.profile_pixels().max(1) as f64
    }

    /// Cost of the subject's pictures under ln factors on its light: from errors of known covariance, or from
    /// independent pixel errors of unknown size.
    fn subject_cost(&self, linear: &LinearPictures, log_factors: DVec3) -> LocalCost {
        /// Step of ln light for slopes.
        const STEP: f64 = 0.01;
        let errors = linear.errors(log_factors);
        let brighter = linear.encoded(log_factors + STEP);
        let darker = linear.encoded(log_factors - STEP);
        let slopes = [0, 1, 2].map(|c| -> Vec<f64> {
            let slope = brighter.iter().zip(&darker).enumerate();
            slope
                .map(|(i, (b, d))| {
                    let is_own = f64::from(u8::from(linear.pairs.channel(i) == c));
                    is_own * (b - d) / (2.0 * STEP)
                })
                .collect()
        });
        let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let (errors, slopes, cost, certainty) = match &self.errors {
            Some(covariance) => {
                let errors = covariance.whitened(&errors);
                let slopes = slopes.map(|slope| covariance.whitened(&slope));
                let [cost, certainty] = covariance.cost(product(&errors, &errors));
                (errors, slopes, cost, certainty)
            }
            None => {
                let count = errors.len().max(1) as f64;
                let square = product(&errors, &errors) / count + self.rounding;
                let certainty = self.pixel_count / (count * square);
                (errors, slopes, self.pixel_count * square.ln(), certainty)
            }
        };
        let row = |a: &[f64]| DVec3::from_array([0, 1, 2].map(|c: usize| product(a, &slopes[c])));
        LocalCost {
            cost,
            gradient: certainty * row(&errors),
            curvature: certainty * DMat3::from_cols(row(&slopes[0]), row(&slopes[1]), row(&slopes[2])),
        }
    }

    /// Cost of the balls: independent errors of unknown size.
    fn ball_cost(&self, linear: &LinearPictures) -> f64 {
        self.ball_count * (self.ball_square(&linear.ball) + linear.ball.rounding).ln()
    }

    /// Cost of two exponents at their best exposure, with all priors; +∞ if they make no valid curve.
    pub fn total(&self, gammas: [f64; 2]) -> f64 {
        self.linearize(gammas).map_or(f64::INFINITY, |linear| self.score(&linear).cost + gamma_prior(gammas))
    }

    /// Score over all brightnesses.
    pub fn score(&self, linear: &LinearPictures) -> Score {
        self.score_under(self.exposure, linear)
    }

    /// Score under another prior of the exposure.
    pub fn score_under(&self, prior: ExposurePrior, linear: &LinearPictures) -> Score {
        let is_clipped = self.probes.clipped_pixels() > 0;
        let errors = ball_errors(is_clipped, self.light_error);
        let pictures = |factors| self.subject_cost(linear, factors);
        let brightness = Brightness::find(prior, &errors, pictures);
        Score {
            cost: brightness.cost + self.ball_cost(linear),
            brightness,
            subject: linear.subject_square(brightness.log_factors).sqrt(),
            ball: self.ball_square(&linear.ball).sqrt(),
        }
    }

    /// Encoded quantiles of each relit pose.
    pub fn pose_quantiles(&self, table: &ResponseTable, weights: &[[f32; 3]], log_factors: DVec3) -> Vec<Quantiles> {
        let factors = log_factors.to_array().map(|x| x.exp() as f32);
        let poses = self.subject.poses.iter();
        poses
            .map(|pose| {
                let relit = self.subject.relit(pose, table, weights);
                let encoded = |c: usize| relit.iter().map(move |p| table.encode(factors[c] * p[c]));
                [0, 1, 2].map(|c| quantiles(encoded(c).collect()))
            })
            .collect()
    }
}

/// Unexplained independent error of encoded quantiles: a third of an 8-bit code.
const MODEL_ERROR: f64 = 0.0015;
/// Bias from noise. Noise of deviation σ makes codes I decode brighter, by about (γ − 1)/2·σ²/I in the code. All
/// pixels of the balls share that error, so their number does not average it out. The factor on σ² holds at I =
/// 0.2.
const NOISE_BIAS: f64 = 3.0;
/// Squared distance on the balls, in squares of the noise, up to which a misfit counts as errors of the lamps. A larger
/// one is mostly light that no sum of lamps gives, which bends the curve. From shoots drawn at random (seeds 1 to 54).
const MISFIT: f64 = 30.0;
/// Number of pixels that compare all poses with their frames.
const MATCHED_PIXELS: usize = 2000;
/// Number of groups of compared pixels with independent errors.
pub(super) const BLOCKS: usize = 20;
