//! Covariance of related errors.

use crate::cholesky::Cholesky;

/// A covariance of errors, factored for use.
pub(super) struct Covariance {
    factor: Cholesky,
    size: usize,
    /// Factor on the deviations.
    wider: f64,
}

/// Degrees of freedom of the errors' size, which is only known from about this many.
const FREEDOM: f64 = 20.0;

impl Covariance {
    /// Covariance of `size` errors: the sum of the outer products of `parts`, plus an independent error of
    /// deviation `own` in each. `None` if a part is NaN or infinite.
    pub fn new(size: usize, parts: &[Vec<f64>], own: f64) -> Option<Self> {
        let mut covariance = vec![0.0; size * size];
        for row in 0..size {
            for column in 0..=row {
                covariance[row * size + column] = parts.iter().map(|part| part[row] * part[column]).sum();
            }
        }
        let trace: f64 = (0..size).map(|i| covariance[i * size + i]).sum();
        // Next to far larger errors, an independent error is at least as large as their rounding.
        let own = (own * own).max(1e-12 * trace);
        for i in 0..size {
            covariance[i * size + i] += own;
        }
        Some(Self { factor: Cholesky::new(covariance, size)?, size, wider: 1.0 })
    }

    /// Independent combinations of the errors, each divided by its deviation.
    pub fn whitened(&self, errors: &[f64]) -> Vec<f64> {
        let mut whitened = self.factor.forward(errors);
        for error in &mut whitened {
            *error /= self.wider;
        }
        whitened
    }

    /// Widens the covariance until it explains the observed errors: by Birge's ratio of χ² to their number.
    pub fn widen(&mut self, errors: &[f64]) {
        let square: f64 = self.whitened(errors).iter().map(|w| w * w).sum();
        self.wider *= (square / self.size as f64).max(1.0).sqrt();
    }

    /// −2·ln of the probability of errors whose whitened squares add up to `square`, up to a constant, and its
    /// slope. Errors larger than the parts can explain come from effects outside the model and carry less
    /// information: Student's distribution, ν·ln(1 + χ²/ν).
    pub fn cost(&self, square: f64) -> [f64; 2] {
        [FREEDOM * (square / FREEDOM).ln_1p(), 1.0 / (1.0 + square / FREEDOM)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(covariance: &Covariance, errors: &[f64]) -> f64 {
        covariance.whitened(errors).iter().map(|w| w * w).sum()
    }

    #[test]
    fn errors_along_a_part_cost_less_than_across_it() {
        let covariance = Covariance::new(2, &[vec![3.0, 3.0]], 1.0).unwrap();
        // The inverse of [[10, 9], [9, 10]] is [[10, −9], [−9, 10]] / 19.
        assert!((square(&covariance, &[1.0, 1.0]) - 2.0 / 19.0).abs() < 1e-12);
        assert!((square(&covariance, &[1.0, -1.0]) - 38.0 / 19.0).abs() < 1e-12);
        assert!(Covariance::new(2, &[vec![f64::NAN, 0.0]], 1.0).is_none());
    }

    #[test]
    fn small_errors_cost_their_square_and_large_ones_less() {
        let covariance = Covariance::new(2, &[], 1.0).unwrap();
        let cost = |errors: &[f64]| covariance.cost(square(&covariance, errors))[0];
        assert!((cost(&[0.1, 0.0]) - 0.01).abs() < 1e-4);
        assert!(cost(&[30.0, 0.0]) < 100.0);
    }
}
