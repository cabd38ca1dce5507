//! The cost of a response: how far, under it, the relit poses are from the interview, and the sum of the lamps'
//! balls is from the interview's ball.

use super::super::code_values::{ResponseTable, STEPS};
use super::super::probe::{NeighbourDifferences, Probes, Profile};
use super::covariance::Covariance;
use super::frame_match::MatchedPixel;
use super::subject::{Pose, QUANTILES, Quantiles, Subject, quantiles};
use super::{ExposurePrior, GAMMA_PRIOR};
use imaging::{DualGamma, Response};

/// The root-mean-square distance that rounding to 8 bits leaves; nothing smaller can be measured.
pub(super) fn rounding() -> f64 {
    1.0 / 255.0 / 12f64.sqrt()
}

/// All pictures linearised by one response, before the exposure is chosen.
pub(super) struct LinearPictures {
    pub table: ResponseTable,
    pub weights: Vec<[f32; 3]>,
    /// Pairs of the relit poses' light and the interview's encoded value: quantiles, channel by channel, or the
    /// channels of pixels.
    pub pairs: Vec<(f32, f32)>,
    /// The balls, pixel by pixel.
    pub ball: Profile,
}

impl LinearPictures {
    /// The subject's encoded values at an exposure.
    pub fn encoded(&self, log_exposure: f64) -> Vec<f64> {
        encoded(&self.table, &self.pairs, log_exposure).collect()
    }

    /// How far they are from the interview's.
    fn errors(&self, log_exposure: f64) -> impl Iterator<Item = f64> {
        let is = self.pairs.iter().map(|(_, is)| f64::from(*is));
        encoded(&self.table, &self.pairs, log_exposure)
            .zip(is)
            .map(|(found, is)| found - is)
    }

    /// Mean squared distance of the encoded subject at an exposure.
    pub fn subject_square(&self, log_exposure: f64) -> f64 {
        let square: f64 = self.errors(log_exposure).map(|error| error * error).sum();
        square / self.pairs.len().max(1) as f64
    }
}

/// How good a response is, at its best exposure.
#[derive(Clone, Copy, Debug)]
pub(super) struct Score {
    /// −2·ln of its probability, up to a constant and without the priors of the exponents.
    pub cost: f64,
    pub log_exposure: f64,
    /// The standard deviation of ln exposure under this response.
    pub exposure_deviation: f64,
    /// Root-mean-square distances in encoded values.
    pub subject: f64,
    pub ball: f64,
}

/// What responses are compared by.
pub(super) struct Objective<'a> {
    pub subject: &'a Subject,
    pub probes: &'a Probes,
    /// Poses that are compared with their frames pixel by pixel; empty if distributions are compared.
    pub matched: Vec<&'a Pose>,
    /// What is known of the errors of the pairs; `None` if pixels are compared.
    errors: Option<Covariance>,
    /// How many independent errors there are among the compared pixels, and on the balls.
    pixel_count: f64,
    ball_count: f64,
    /// The variance of the light on the interview's ball that is no sum of lamps, see [`Probes::profile`].
    pub remainder: f64,
    /// What is assumed of the exposure.
    pub exposure: ExposurePrior,
}

impl<'a> Objective<'a> {
    /// Compares a subject and its probes: by the pixels of `matched`, poses that a frame shows, or by distributions
    /// if there are none.
    pub fn new(subject: &'a Subject, probes: &'a Probes, matched: Vec<&'a Pose>) -> Self {
        let mut objective = Self {
            subject,
            probes,
            errors: None,
            pixel_count: BLOCKS as f64,
            ball_count: subject.lamps as f64,
            remainder: 0.0,
            exposure: ExposurePrior::LeftAlone,
            matched,
        };
        if objective.matched.is_empty() {
            let middle = DualGamma {
                gamma1: GAMMA_PRIOR.0 as f32,
                gamma2: GAMMA_PRIOR.0 as f32,
            };
            let table = ResponseTable::new(&middle);
            let weights = probes.weights(&table);
            let differences = objective.differences(&table, &weights, 1.0);
            objective.errors = Covariance::new(3 * QUANTILES, &differences, MODEL_ERROR);
        }
        objective
    }

    /// Learns from the best response so far which errors to expect. As far as noise explains the distance on the
    /// balls, each pixel is an independent error. The rest, such as a ball that was moved, is one error for each
    /// lamp; if the interview's light is no sum of the lamps, it says nothing about the response. Likewise for the
    /// pixels of a pose and its frame, where the rest is one error for each of [`BLOCKS`].
    pub fn weigh(&mut self, best: &LinearPictures) {
        let noise_share = |square: f64, noise: f64| {
            let noise = noise.max(rounding().powi(2));
            noise / square.max(noise)
        };
        self.remainder = best.ball.remainder();
        let ball = self.probes.profile(&best.table, self.remainder);
        let pixels = self.probes.profile_pixels() as f64;
        let others = if self.remainder > 0.0 {
            0.0
        } else {
            pixels.min(self.subject.lamps as f64)
        };
        // Part of the misfit looks like noise. With this power, measured on random shoots, intervals hold what they say.
        let own = noise_share(self.ball_square(&ball), ball.noise).powf(1.5);
        self.ball_count = own * pixels + (1.0 - own) * others;
        let x = self.score(best).log_exposure;
        if self.matched.is_empty() {
            let mut differences = self.differences(&best.table, &best.weights, x.exp() as f32);
            differences.extend(self.weight_errors(best, x));
            self.errors = Covariance::new(3 * QUANTILES, &differences, MODEL_ERROR);
        } else {
            let own = noise_share(best.subject_square(x), self.matched_noise(best, x));
            let pixels = (best.pairs.len() / 3) as f64;
            self.pixel_count = own * pixels + (1.0 - own) * pixels.min(BLOCKS as f64);
        }
    }

    /// Mean square of the noise between poses and their frames.
    fn matched_noise(&self, linear: &LinearPictures, log_exposure: f64) -> f64 {
        let mut channels: [NeighbourDifferences; 3] = Default::default();
        let errors: Vec<f64> = linear.errors(log_exposure).collect();
        let pixels = self
            .matched
            .iter()
            .flat_map(|pose| self.matched_pixels(pose));
        for (pixel, errors) in pixels.zip(errors.chunks_exact(3)) {
            for (channel, error) in channels.iter_mut().zip(errors) {
                channel.add(pixel.place as usize, *error);
            }
        }
        channels
            .iter()
            .map(NeighbourDifferences::noise)
            .sum::<f64>()
            / 3.0
    }

    /// The pixels by which a pose is compared with its frame: two thousand in all are enough.
    fn matched_pixels(&self, pose: &'a Pose) -> impl Iterator<Item = &'a MatchedPixel> {
        let pixels = pose
            .frame_match
            .as_ref()
            .map_or(&[][..], |frame_match| &frame_match.pixels);
        let step = (pixels.len() * self.matched.len())
            .div_ceil(MATCHED_PIXELS)
            .max(1);
        let kept = pixels
            .iter()
            .enumerate()
            .filter(move |(i, _)| (i / 2) % step == 0);
        kept.map(|(_, pixel)| pixel)
    }

    /// Pairs of a pose's light and its frame's encoded value, by pixel and channel.
    fn matched_pairs(
        &self,
        pose: &'a Pose,
        table: &ResponseTable,
        weights: &[[f32; 3]],
    ) -> Vec<(f32, f32)> {
        let encoded = |code: u16| f32::from(code) / f32::from(STEPS);
        self.matched_pixels(pose)
            .flat_map(|pixel| {
                let light = self
                    .subject
                    .relit_sample(pose, pixel.sample as usize, table, weights);
                [0, 1, 2].map(|c| (light[c], encoded(pixel.here[c])))
            })
            .collect()
    }

    /// Root-mean-square encoded distances of the subject and on the balls.
    pub fn distances(&self, response: &Response, exposure: f32) -> [f32; 2] {
        let linear = self.linearize_by(response);
        let subject = linear.subject_square(f64::from(exposure).ln());
        [subject, self.ball_square(&linear.ball)].map(|square| square.sqrt() as f32)
    }

    /// The pictures under two exponents; `None` if no camera can have their curve.
    pub fn linearize(&self, [gamma1, gamma2]: [f64; 2]) -> Option<LinearPictures> {
        let curve = DualGamma::new(gamma1 as f32, gamma2 as f32).ok()?;
        Some(self.linearize_by(&Response::Dual(curve)))
    }

    /// The pictures under any response.
    pub fn linearize_by(&self, response: &Response) -> LinearPictures {
        let table = ResponseTable::of(response);
        let (weights, ball) = rayon::join(
            || self.probes.weights(&table),
            || self.probes.profile(&table, self.remainder),
        );
        LinearPictures {
            pairs: self.pairs(&table, &weights),
            weights,
            table,
            ball,
        }
    }

    /// Compares the balls of pictures again, under the remainder that was last found.
    pub fn profile_again(&self, grid: &mut [([f64; 2], LinearPictures)]) {
        for (_, linear) in grid {
            linear.ball = self.probes.profile(&linear.table, self.remainder);
        }
    }

    /// Pairs of the relit subject's light and the interview's encoded values: quantiles, channel by channel, or the
    /// channels of pixels.
    pub fn pairs(&self, table: &ResponseTable, weights: &[[f32; 3]]) -> Vec<(f32, f32)> {
        if !self.matched.is_empty() {
            let pairs = |pose: &&'a Pose| self.matched_pairs(pose, table, weights);
            return self.matched.iter().flat_map(pairs).collect();
        }
        let relit = self.subject.all_relit(table, weights);
        (0..3)
            .flat_map(|c| {
                let light = quantiles(relit.iter().map(|p| p[c]).collect());
                light.into_iter().zip(self.subject.interview[c])
            })
            .collect()
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

    /// −2·ln of the probability of the subject's pictures at an exposure, up to a constant: of errors of known
    /// covariance, or of independent errors of unknown size between pixels.
    fn subject_cost(&self, linear: &LinearPictures, log_exposure: f64) -> f64 {
        match &self.errors {
            Some(errors) => errors.cost(&linear.errors(log_exposure).collect::<Vec<_>>()),
            None => {
                let square = linear.subject_square(log_exposure) + rounding().powi(2);
                self.pixel_count * square.ln()
            }
        }
    }

    /// The same for the balls: independent errors of unknown size.
    fn ball_cost(&self, linear: &LinearPictures) -> f64 {
        self.ball_count * (self.ball_square(&linear.ball) + rounding().powi(2)).ln()
    }

    /// The score at the best exposure.
    pub fn score(&self, linear: &LinearPictures) -> Score {
        self.score_under(self.exposure, linear)
    }

    /// The same with another prior of the exposure.
    pub fn score_under(&self, prior: ExposurePrior, linear: &LinearPictures) -> Score {
        let cost = |x: f64| self.subject_cost(linear, x) + prior.cost(x);
        let log_exposure = best_exposure(cost, |x| linear.subject_square(x));
        let least = cost(log_exposure);
        // The probability of all exposures nearby, not of the best alone (Laplace's approximation).
        let step = 0.3 * prior.deviation().min(0.1);
        let curvature =
            (cost(log_exposure - step) + cost(log_exposure + step) - 2.0 * least) / step.powi(2);
        let exposure_deviation = (2.0 / curvature.max(1e-12))
            .sqrt()
            .clamp(1e-4, prior.deviation());
        Score {
            cost: least - 2.0 * exposure_deviation.ln() + self.ball_cost(linear),
            log_exposure,
            exposure_deviation,
            subject: linear.subject_square(log_exposure).sqrt(),
            ball: self.ball_square(&linear.ball).sqrt(),
        }
    }

    /// The encoded quantiles of each relit pose.
    pub fn pose_quantiles(
        &self,
        table: &ResponseTable,
        weights: &[[f32; 3]],
        exposure: f32,
    ) -> Vec<Quantiles> {
        let poses = self.subject.poses.iter();
        poses
            .map(|pose| {
                let relit = self.subject.relit(pose, table, weights);
                let encoded = |c: usize| relit.iter().map(move |p| table.encode(exposure * p[c]));
                [0, 1, 2].map(|c| quantiles(encoded(c).collect()))
            })
            .collect()
    }
}

/// Independent errors of encoded quantiles that nothing else explains: a third of an 8-bit code.
const MODEL_ERROR: f64 = 0.0015;
/// Pixels by which all poses and their frames are compared.
const MATCHED_PIXELS: usize = 2000;
/// Parts of the compared pixels whose errors are taken to be independent.
pub(super) const BLOCKS: usize = 20;

/// −2·ln of the weak prior of both exponents.
pub(super) fn gamma_prior(gammas: [f64; 2]) -> f64 {
    let prior = |gamma: f64| ((gamma - GAMMA_PRIOR.0) / GAMMA_PRIOR.1).powi(2);
    gammas.into_iter().map(prior).sum()
}

/// The exposure of least cost. The prior is lowest at 1, the pictures where `distance` is least; the minimum of the
/// cost is at one of them or between.
fn best_exposure(cost: impl Fn(f64) -> f64, distance: impl Fn(f64) -> f64) -> f64 {
    const WIDEST: f64 = 1.0;
    let free = valley(distance, [-WIDEST, WIDEST], 1e-2);
    let reach = 4.0 * ExposurePrior::LeftAlone.deviation();
    if free.abs() < 2.0 * reach {
        // Both minima lie in one valley.
        let range = [free.min(0.0) - reach, free.max(0.0) + reach];
        return valley(&cost, range, 1e-4);
    }
    [
        [free.min(0.0), free.max(0.0)],
        [-reach, reach],
        [free - reach, free + reach],
    ]
    .map(|range| valley(&cost, range, 1e-4))
    .into_iter()
    .min_by(|a, b| cost(*a).total_cmp(&cost(*b)))
    .unwrap_or(0.0)
}

/// The minimum between two places, to an `accuracy` (golden section search, Kiefer 1953).
fn valley(height: impl Fn(f64) -> f64, [mut low, mut high]: [f64; 2], accuracy: f64) -> f64 {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let inner = |low: f64, high: f64| [high - golden * (high - low), low + golden * (high - low)];
    let mut places = inner(low, high);
    let mut heights = places.map(&height);
    while high - low > accuracy {
        if heights[0] < heights[1] {
            high = places[1];
            places = [inner(low, high)[0], places[0]];
            heights = [height(places[0]), heights[0]];
        } else {
            low = places[0];
            places = [places[1], inner(low, high)[1]];
            heights = [heights[1], height(places[1])];
        }
    }
    0.5 * (low + high)
}

/// The encoded values of pairs of light and something at an exposure.
pub(super) fn encoded(
    table: &ResponseTable,
    pairs: &[(f32, f32)],
    log_exposure: f64,
) -> impl Iterator<Item = f64> {
    let exposure = log_exposure.exp() as f32;
    let lights = pairs.iter().map(|(light, _)| light);
    lights.map(move |light| f64::from(table.encode(exposure * light)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bottom_of_a_valley_is_found_even_at_its_edge() {
        assert!((valley(|x| (x - 0.3).powi(2), [-1.0, 1.0], 1e-4) - 0.3).abs() < 1e-4);
        assert!((valley(|x| x, [-1.0, 1.0], 1e-4) + 1.0).abs() < 1e-4);
        assert_eq!(valley(|x| x, [0.5, 0.5], 1e-4), 0.5);
    }

    #[test]
    fn an_exposure_that_the_pictures_insist_on_is_taken() {
        let pictures = |strength: f64| move |x: f64| strength * (x - 0.2).powi(2);
        let cost =
            |strength: f64| move |x: f64| pictures(strength)(x) + ExposurePrior::LeftAlone.cost(x);
        let found = |strength: f64| best_exposure(cost(strength), pictures(strength));
        assert!((found(1e6) - 0.2).abs() < 0.005 && found(10.0).abs() < 0.01);
    }
}
