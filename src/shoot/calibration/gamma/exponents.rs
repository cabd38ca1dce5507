//! Exponents of the dual gamma: their prior, their bounds and the search over both.

use super::super::minimizer::{self, Search};
use base::error::Result;
use imaging::DualGamma;

/// Mean and deviation of the weak prior on each exponent: video cameras are near 2.2.
pub(super) const GAMMA_PRIOR: (f64, f64) = (2.2, 0.6);

/// −2·ln of the weak prior of both exponents.
pub(super) fn gamma_prior(gammas: [f64; 2]) -> f64 {
    let prior = |gamma: f64| ((gamma - GAMMA_PRIOR.0) / GAMMA_PRIOR.1).powi(2);
    gammas.into_iter().map(prior).sum()
}

/// [`DualGamma::BOUNDS`] for both exponents.
pub(super) fn bounds() -> (f64, f64) {
    let bounds = DualGamma::BOUNDS;
    (f64::from(*bounds.start()), f64::from(*bounds.end()))
}

/// Minimum near `start` of a cost over two exponents, within [`DualGamma::BOUNDS`], and the cost there.
pub(super) fn minimise(cost: impl Fn([f64; 2]) -> f64, start: [f64; 2]) -> Result<([f64; 2], f64)> {
    let (low, high) = bounds();
    let search = Search {
        start,
        low: [low; 2],
        high: [high; 2],
        // From half the grid spacing to a tenth of the resolution of any picture.
        first_step: 0.2,
        last_step: 5e-4,
        evaluations: 120,
    };
    minimizer::minimise(cost, &search)
}
