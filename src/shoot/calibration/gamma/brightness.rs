//! Brightness of the interview per channel, relative to the sum of lamps from the mirror balls.
//!
//! The exposure may have been changed. The balls also measure brightness and colour with limited accuracy: small
//! glints lose colour in a JPEG file and light to clipping, and light between lamps is distributed by expectation.
//! The subject shows both, so three factors are fitted to it under each response.

use glam::{DMat3, DVec3};

/// An assumption about the exposure between the photographs of the balls and the filming.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ExposurePrior {
    /// The usual case: untouched cameras, with a few hundredths of a stop of variation.
    LeftAlone,
    /// The exposure was changed, by about half a stop.
    Changed,
}

impl ExposurePrior {
    /// Prior probability of the assumption.
    const fn chance(self) -> f64 {
        match self {
            Self::LeftAlone => 0.9,
            Self::Changed => 0.1,
        }
    }

    /// Standard deviation of ln exposure under the assumption.
    pub const fn deviation(self) -> f64 {
        match self {
            Self::LeftAlone => 0.03,
            Self::Changed => 0.4,
        }
    }
}

/// One component of the balls' brightness error: a probability, and a normal distribution of the error of ln light
/// per channel. Together the components have long tails: mostly small errors, sometimes large ones.
pub(super) struct BallError {
    chance: f64,
    middle: DVec3,
    covariance: DMat3,
}

/// Errors of balls, besides the `expected` errors of their lamps' weights. Clipped balls lose light, so their
/// lamps' weights come out too large.
pub(super) fn ball_errors(is_clipped: bool, expected: DMat3) -> Vec<BallError> {
    // Probability, mean and deviation of the common part of all channels; probability and deviation of each
    // channel.
    let common: &[(f64, [f64; 2])] = if is_clipped {
        &[(0.5, [0.0, 0.03]), (0.5, [-0.3, 0.4])]
    } else {
        &[(0.95, [0.0, 0.03]), (0.05, [0.0, 0.25])]
    };
    let own = [(0.6, 0.01f64), (0.2, 0.06), (0.2, 0.3)];
    let all = common.iter().flat_map(|common| own.map(|own| (*common, own)));
    all.map(|((often, [mean, deviation]), (chance, own))| BallError {
        chance: often * chance,
        middle: DVec3::splat(mean),
        covariance: expected + DMat3::IDENTITY * own.powi(2) + ONES * deviation.powi(2),
    })
    .collect()
}

/// The common part of all channels, as a covariance.
pub(super) const ONES: DMat3 = DMat3::from_cols(DVec3::ONE, DVec3::ONE, DVec3::ONE);

/// Cost of the subject's pictures near some ln factors on its light: −2·ln of their probability, half its gradient,
/// and half its curvature (Gauss–Newton).
pub(super) struct LocalCost {
    pub cost: f64,
    pub gradient: DVec3,
    pub curvature: DMat3,
}

/// Brightness of the interview relative to the sum of lamps, under one response.
#[derive(Clone, Copy, Debug)]
pub(super) struct Brightness {
    /// −2·ln of the probability of the pictures, over all brightnesses.
    pub cost: f64,
    /// ln of the factors on the sum of the lamps, per channel.
    pub log_factors: DVec3,
    /// The exposure part of the factors, and its standard deviation.
    pub log_exposure: f64,
    pub exposure_deviation: f64,
}

impl Brightness {
    /// The brightness that explains the pictures best, with the total probability over all brightnesses.
    pub fn find(exposure: ExposurePrior, errors: &[BallError], pictures: impl Fn(DVec3) -> LocalCost) -> Self {
        /// From this distance on, ln light may have two minima.
        const FAR: f64 = 0.2;
        // The optimum of the pictures alone is one start for each account, the account's own middle another.
        let free = Account::new(
            ExposurePrior::Changed,
            &BallError { chance: 1.0, middle: DVec3::ZERO, covariance: DMat3::IDENTITY * 0.25 },
        );
        let start = free.climb(&pictures, DVec3::ZERO).at;
        let found: Vec<(Account, Place)> = errors
            .iter()
            .map(|error| {
                let account = Account::new(exposure, error);
                let mut best = account.climb(&pictures, start);
                if (best.at - account.middle).length() > FAR {
                    let other = account.climb(&pictures, account.middle);
                    if other.cost < best.cost {
                        best = other;
                    }
                }
                (account, best)
            })
            .collect();
        let least = found.iter().map(|(_, place)| place.cost).fold(f64::INFINITY, f64::min);
        let shares: Vec<f64> = found.iter().map(|(_, place)| (-0.5 * (place.cost - least)).exp()).collect();
        let all: f64 = shares.iter().sum();
        let exposures: Vec<[f64; 2]> = found.iter().map(|(a, place)| a.exposure(place)).collect();
        let mean = |value: &dyn Fn(usize) -> f64| -> f64 {
            let terms = shares.iter().enumerate();
            terms.map(|(i, share)| share * value(i)).sum::<f64>() / all
        };
        let log_exposure = mean(&|i| exposures[i][0]);
        let variance = mean(&|i| (exposures[i][0] - log_exposure).powi(2) + exposures[i][1]);
        Self {
            cost: least - 2.0 * all.ln(),
            log_factors: DVec3::from_array([0, 1, 2].map(|c| mean(&|i| found[i].1.at[c]))),
            log_exposure,
            exposure_deviation: variance.sqrt(),
        }
    }
}

/// A normal distribution of the three ln factors.
struct Account {
    /// −2·ln of its probability and of its density's norm.
    norm: f64,
    middle: DVec3,
    precision: DMat3,
    /// Variance of ln exposure.
    exposure: f64,
}

/// Most probable place of an account, and −2·ln of the probability of the pictures under it.
struct Place {
    at: DVec3,
    cost: f64,
    covariance: DMat3,
}

impl Account {
    fn new(exposure: ExposurePrior, error: &BallError) -> Self {
        let variance = exposure.deviation().powi(2);
        let covariance = error.covariance + ONES * variance;
        Self {
            norm: covariance.determinant().ln() - 2.0 * (exposure.chance() * error.chance).ln(),
            middle: error.middle,
            precision: covariance.inverse(),
            exposure: variance,
        }
    }

    /// Place of least cost reached by Gauss–Newton steps from a start.
    fn climb(&self, pictures: &impl Fn(DVec3) -> LocalCost, start: DVec3) -> Place {
        /// Step of ln light below which a further step would be invisible.
        const STILL: f64 = 2e-3;
        let total = |local: &LocalCost, at: DVec3| {
            let off = at - self.middle;
            local.cost + off.dot(self.precision * off)
        };
        let mut at = start;
        let mut local = pictures(at);
        for _ in 0..12 {
            let slope = local.gradient + self.precision * (at - self.middle);
            let mut step = -((local.curvature + self.precision).inverse() * slope);
            step = step.clamp_length_max(0.7);
            let here = total(&local, at);
            let mut moved = None;
            for _ in 0..6 {
                let there = pictures(at + step);
                if total(&there, at + step) <= here {
                    moved = Some(there);
                    break;
                }
                step *= 0.4;
            }
            let Some(there) = moved else { break };
            (at, local) = (at + step, there);
            if step.length() < STILL {
                break;
            }
        }
        let certainty = local.curvature + self.precision;
        Place {
            at,
            // Laplace approximation.
            cost: total(&local, at) + certainty.determinant().ln() + self.norm,
            covariance: certainty.inverse(),
        }
    }

    /// Mean and variance of ln exposure: its share of the common part of the channels.
    fn exposure(&self, place: &Place) -> [f64; 2] {
        let along = self.precision * DVec3::splat(self.exposure);
        let off = place.at - self.middle;
        [along.dot(off), self.exposure - self.exposure * along.dot(DVec3::ONE) + along.dot(place.covariance * along)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pictures that indicate `log_factors`, with a standard deviation.
    fn pictures(log_factors: [f64; 3], deviation: f64) -> impl Fn(DVec3) -> LocalCost {
        move |at| {
            let off = at - DVec3::from_array(log_factors);
            let certainty = deviation.powi(-2);
            LocalCost {
                cost: certainty * off.length_squared(),
                gradient: certainty * off,
                curvature: DMat3::IDENTITY * certainty,
            }
        }
    }

    #[test]
    fn an_exposure_that_the_pictures_insist_on_is_taken() {
        let usual = ball_errors(false, DMat3::ZERO);
        let found = |deviation: f64| Brightness::find(ExposurePrior::Changed, &usual, pictures([0.2; 3], deviation));
        let (sure, unsure) = (found(0.001), found(10.0));
        assert!((sure.log_exposure - 0.2).abs() < 0.03, "{sure:?}");
        assert!((sure.log_factors - DVec3::splat(0.2)).length() < 0.005);
        assert!(unsure.log_exposure.abs() < 0.01 && unsure.log_factors.length() < 0.01);
        assert!(unsure.exposure_deviation > 0.39);
    }

    #[test]
    fn colour_is_the_balls_error_and_no_exposure() {
        let usual = ball_errors(false, DMat3::ZERO);
        let colour = pictures([0.3, 0.0, -0.3], 0.01);
        let found = Brightness::find(ExposurePrior::LeftAlone, &usual, &colour);
        assert!((found.log_factors - DVec3::new(0.3, 0.0, -0.3)).length() < 0.02);
        assert!(found.log_exposure.abs() < 0.01 && found.exposure_deviation < 0.04);
        // Pictures without a colour error are more probable. A pure brightness error indicates a changed exposure.
        let plain = Brightness::find(ExposurePrior::LeftAlone, &usual, pictures([0.0; 3], 0.01));
        assert!(plain.cost + 2.0 < found.cost);
        let [alone, changed] = [ExposurePrior::LeftAlone, ExposurePrior::Changed]
            .map(|prior| Brightness::find(prior, &usual, pictures([-0.7; 3], 0.01)));
        assert!(changed.cost < alone.cost);
    }
}
