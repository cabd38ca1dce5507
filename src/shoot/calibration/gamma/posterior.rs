//! Probability of each pair of exponents under one assumption about the exposure.
//!
//! The cost is a parabola only near its minimum, so it is sampled: first its curvature, then a grid along and
//! across its valley, over the range left open by the pictures.

use super::exponents::{GAMMA_PRIOR, bounds, gamma_prior, minimise};
use super::objective::Objective;
use base::error::Result;
use glam::{DMat2, DVec2};

/// Steps of the exponents for the curvature: the first, and the smallest and largest later. Smaller steps show the
/// roughness of 8-bit data; with larger ones the cost is not a parabola.
const STEPS: [f64; 3] = [0.03, 0.01, 0.3];
/// Places of the grid on either side of the middle, and their spacing in deviations.
const REACH: i32 = 2;
const SPACING: f64 = 1.25;
/// Distance from a bound of the exponents at which a minimum lies on it: more than the search's last step.
const AT_BOUND: f64 = 0.01;

/// The exponents and ln exposure under one assumption about the exposure.
#[derive(Clone, Copy, Debug)]
pub(super) struct Posterior {
    /// Most probable place, and ln exposure there.
    pub gammas: [f64; 2],
    pub log_exposure: f64,
    /// Mean and standard deviation of γ1, γ2 and ln exposure.
    pub mean: [f64; 3],
    pub deviation: [f64; 3],
    /// −2·ln of the probability of the pictures under the assumption, up to a constant, including the assumption's
    /// prior.
    pub cost: f64,
}

/// A place of the grid.
struct Place {
    gammas: DVec2,
    cost: f64,
    log_exposure: f64,
    exposure_deviation: f64,
}

impl Posterior {
    /// Explores the surroundings of the best start place under the objective's assumption.
    ///
    /// # Errors
    /// When the search cannot start.
    pub fn find(objective: &Objective, start: [f64; 2]) -> Result<Self> {
        let (found, _) = minimise(|gammas| objective.total(gammas), start)?;
        let mut axes = DMat2::from_diagonal(DVec2::splat(STEPS[0]));
        let mut middle = DVec2::from_array(found);
        for _ in 0..2 {
            axes =
                curvature(objective, middle, axes).unwrap_or(DMat2::from_diagonal(DVec2::splat(0.5 * GAMMA_PRIOR.1)));
        }
        let mut posterior = None;
        // Where the valley is longer than its curvature implies, the grid grows along it.
        for _ in 0..3 {
            let places = grid(objective, middle, axes);
            let Some((found, covariance)) = Self::new(&places, axes) else { break };
            posterior = Some(found);
            middle = DVec2::new(found.mean[0], found.mean[1]);
            let (turned, variances) = principal(covariance);
            let wider = DMat2::from_cols(turned.x_axis * variances.x.sqrt(), turned.y_axis * variances.y.sqrt());
            let is_settled = |old: f64, new: f64| new < 1.3 * old && new > 0.6 * old;
            let (old, new) = (axes.determinant().abs(), wider.determinant().abs());
            axes = wider;
            if is_settled(old.sqrt(), new.sqrt()) {
                break;
            }
        }
        let prior = GAMMA_PRIOR.1;
        let mut posterior = posterior.unwrap_or(Self {
            gammas: found,
            log_exposure: 0.0,
            mean: [found[0], found[1], 0.0],
            deviation: [prior, prior, objective.exposure.deviation()],
            cost: f64::INFINITY,
        });
        posterior.gammas = found;
        posterior.doubt_bounds();
        if let Some(linear) = objective.linearize(posterior.gammas) {
            posterior.log_exposure = objective.score(&linear).brightness.log_exposure;
        }
        Ok(posterior)
    }

    /// Replaces an answer at a bound by the prior: pictures that pull beyond the range contradict every curve in it, so they
    /// say nothing about the camera's.
    fn doubt_bounds(&mut self) {
        let (low, high) = bounds();
        if self.gammas.iter().any(|gamma| (gamma - low).min(high - gamma) < AT_BOUND) {
            let (middle, prior) = GAMMA_PRIOR;
            self.gammas = [middle; 2];
            self.mean[..2].fill(middle);
            self.deviation[..2].fill(prior);
        }
    }

    /// Mean, deviation and probability over all places of a grid with these axes, and the exponents' covariance.
    fn new(places: &[Place], axes: DMat2) -> Option<(Self, DMat2)> {
        let best = places.iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).filter(|best| best.cost.is_finite())?;
        let shares: Vec<f64> = places.iter().map(|place| (-0.5 * (place.cost - best.cost)).exp()).collect();
        let all: f64 = shares.iter().sum();
        let mean = |value: &dyn Fn(&Place) -> f64| -> f64 {
            let terms = places.iter().zip(&shares);
            terms.map(|(place, share)| share * value(place)).sum::<f64>() / all
        };
        let gammas = DVec2::new(mean(&|p| p.gammas.x), mean(&|p| p.gammas.y));
        let exposure = mean(&|p| p.log_exposure);
        let square = |x: &dyn Fn(DVec2) -> f64| mean(&|p| x(p.gammas - gammas));
        let mixed = square(&|d| d.x * d.y);
        // A place represents its surroundings, half a spacing wide on either side.
        let own = axes * axes.transpose() * (SPACING * SPACING / 12.0);
        let covariance =
            DMat2::from_cols(DVec2::new(square(&|d| d.x * d.x), mixed), DVec2::new(mixed, square(&|d| d.y * d.y)))
                + own;
        let exposure_variance = mean(&|p| (p.log_exposure - exposure).powi(2) + p.exposure_deviation.powi(2));
        let area = axes.determinant().abs() * SPACING * SPACING;
        let posterior = Self {
            gammas: best.gammas.to_array(),
            log_exposure: best.log_exposure,
            mean: [gammas.x, gammas.y, exposure],
            deviation: [covariance.x_axis.x.sqrt(), covariance.y_axis.y.sqrt(), exposure_variance.sqrt()],
            cost: best.cost - 2.0 * (all * area).ln(),
        };
        Some((posterior, covariance))
    }
}

/// Places around a middle, with axes one deviation long. Invalid curves are left out.
fn grid(objective: &Objective, middle: DVec2, axes: DMat2) -> Vec<Place> {
    let steps = (-REACH..=REACH).flat_map(|i| (-REACH..=REACH).map(move |j| (i, j)));
    steps
        .filter_map(|(i, j)| {
            let gammas = middle + axes * (SPACING * DVec2::new(f64::from(i), f64::from(j)));
            let (low, high) = bounds();
            if gammas.min_element() < low || gammas.max_element() > high {
                return None;
            }
            let score = objective.score(&objective.linearize(gammas.to_array())?);
            Some(Place {
                gammas,
                cost: score.cost + gamma_prior(gammas.to_array()),
                log_exposure: score.brightness.log_exposure,
                exposure_deviation: score.brightness.exposure_deviation,
            })
        })
        .collect()
}

/// Axes of the cost's valley near its minimum, each one deviation long; `None` if the place is not a minimum.
fn curvature(objective: &Objective, at: DVec2, steps: DMat2) -> Option<DMat2> {
    // Near a bound, the neighbourhood moves inside by as much as the steps need.
    let reach = steps.x_axis.abs() + steps.y_axis.abs();
    let (low, high) = bounds();
    let at = at.clamp(DVec2::splat(low) + reach, DVec2::splat(high) - reach);
    let mut costs = [[0.0; 3]; 3];
    for (i, row) in costs.iter_mut().enumerate() {
        for (j, cost) in row.iter_mut().enumerate() {
            let place = at + steps * DVec2::new(i as f64 - 1.0, j as f64 - 1.0);
            *cost = objective.total(place.to_array());
        }
    }
    let c = &costs;
    let first = c[2][1] - 2.0 * c[1][1] + c[0][1];
    let second = c[1][2] - 2.0 * c[1][1] + c[1][0];
    let mixed = (c[2][2] - c[2][0] - c[0][2] + c[0][0]) / 4.0;
    let half = DMat2::from_cols(DVec2::new(first, mixed), DVec2::new(mixed, second)) * 0.5;
    if !(first > 0.0 && second > 0.0 && half.determinant() > 0.0) {
        return None;
    }
    let covariance = steps * half.inverse() * steps.transpose();
    let (turned, variances) = principal(covariance);
    let length = |variance: f64| variance.sqrt().clamp(STEPS[1], STEPS[2]);
    let axes = DMat2::from_cols(turned.x_axis * length(variances.x), turned.y_axis * length(variances.y));
    axes.is_finite().then_some(axes)
}

/// Unit axes and variances of a covariance of two unknowns.
fn principal(covariance: DMat2) -> (DMat2, DVec2) {
    let (a, b, c) = (covariance.x_axis.x, covariance.x_axis.y, covariance.y_axis.y);
    let turn = DVec2::from_angle(0.5 * (2.0 * b).atan2(a - c));
    let axes = DMat2::from_cols(turn, turn.perp());
    let along = |axis: DVec2| axis.dot(covariance * axis).max(0.0);
    (axes, DVec2::new(along(axes.x_axis), along(axes.y_axis)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_at_a_bound_is_none() {
        let (low, high) = bounds();
        let posterior = |gammas: [f64; 2]| {
            let mut posterior = Posterior {
                gammas,
                log_exposure: 0.0,
                mean: [gammas[0], gammas[1], 0.1],
                deviation: [0.01; 3],
                cost: 0.0,
            };
            posterior.doubt_bounds();
            posterior
        };
        let (middle, prior) = GAMMA_PRIOR;
        for gammas in [[high, 3.0], [1.5, high - 1e-3], [low, low]] {
            let found = posterior(gammas);
            assert_eq!((found.gammas, found.mean), ([middle; 2], [middle, middle, 0.1]));
            assert_eq!(found.deviation, [prior, prior, 0.01]);
        }
        let inside = posterior([low + 0.05, high - 0.05]);
        assert_eq!((inside.gammas[0], inside.deviation), (low + 0.05, [0.01; 3]));
    }
}
