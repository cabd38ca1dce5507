//! What is known of the errors of several numbers that belong together.

/// A covariance of errors, ready for use.
pub(super) struct Covariance {
    /// The lower triangle of its Cholesky factor, row by row.
    factor: Vec<f64>,
    size: usize,
}

/// Degrees of freedom of the errors' size: how large they are is only known from about so many.
const FREEDOM: f64 = 20.0;

impl Covariance {
    /// The covariance of `size` errors: the sum of the squares of `parts`, and an independent error of deviation
    /// `own` in each. `None` if a part is NaN or infinite.
    pub fn new(size: usize, parts: &[Vec<f64>], own: f64) -> Option<Self> {
        let mut factor = vec![0.0; size * size];
        for row in 0..size {
            for column in 0..=row {
                let sum: f64 = parts.iter().map(|part| part[row] * part[column]).sum();
                factor[row * size + column] = sum + if row == column { own * own } else { 0.0 };
            }
        }
        for row in 0..size {
            for column in 0..=row {
                let known: f64 = (0..column)
                    .map(|i| factor[row * size + i] * factor[column * size + i])
                    .sum();
                let left = factor[row * size + column] - known;
                factor[row * size + column] = if row == column {
                    left.max(1e-3 * own * own).sqrt()
                } else {
                    left / factor[column * size + column]
                };
            }
        }
        let is_sound = factor.iter().all(|value| value.is_finite());
        is_sound.then_some(Self { factor, size })
    }

    /// Independent combinations of the errors, each over its deviation.
    pub fn whitened(&self, errors: &[f64]) -> Vec<f64> {
        let mut whitened = vec![0.0; self.size];
        for row in 0..self.size {
            let factor = &self.factor[row * self.size..=row * self.size + row];
            let known: f64 = factor
                .iter()
                .zip(&whitened[..row])
                .map(|(l, w)| l * w)
                .sum();
            whitened[row] = (errors[row] - known) / factor[row];
        }
        whitened
    }

    /// Widens the covariance until it explains errors that are seen: by Birge's ratio of χ² to their number.
    pub fn widen(&mut self, errors: &[f64]) {
        let square: f64 = self.whitened(errors).iter().map(|w| w * w).sum();
        let ratio = (square / self.size as f64).max(1.0);
        for value in &mut self.factor {
            *value *= ratio.sqrt();
        }
    }

    /// −2·ln of how probable errors are whose whitened squares add up to `square`, up to a constant, and its slope.
    /// Errors that are larger than all parts together explain come from something that the model leaves out, and tell
    /// less: Student's distribution, ν·ln(1 + χ²/ν).
    pub fn cost(&self, square: f64) -> [f64; 2] {
        [
            FREEDOM * (square / FREEDOM).ln_1p(),
            1.0 / (1.0 + square / FREEDOM),
        ]
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
