//! Non-negative least squares: light only adds.
//!
//! The usual active-set method (Lawson and Hanson 1974) in the linear-algebra crates does not fit: it needs the
//! full matrix, ten thousand pixels by forty lamps, for every candidate response, and of several lamps that look
//! alike it lights one and switches off the others.

/// Normal equations AᵀA·x = Aᵀy of a system with non-negative coefficients.
pub(super) struct NormalEquations {
    unknowns: usize,
    gram: Vec<f64>,
    target: Vec<f64>,
}

impl NormalEquations {
    /// A system without equations.
    pub fn new(unknowns: usize) -> Self {
        Self { unknowns, gram: vec![0.0; unknowns * unknowns], target: vec![0.0; unknowns] }
    }

    /// A system from its matrix AᵀA, row by row, and AᵀY.
    pub fn from_gram(gram: Vec<f64>, target: Vec<f64>) -> Self {
        Self { unknowns: target.len(), gram, target }
    }

    /// Adds the equation Σ coefficient·x = y, given by its non-zero terms.
    pub fn add(&mut self, terms: &[(usize, f64)], y: f64) {
        for &(i, a) in terms {
            self.target[i] += a * y;
            for &(j, b) in terms {
                self.gram[i * self.unknowns + j] += a * b;
            }
        }
    }

    /// Solution x ≥ 0 with the least squared error. Among equally good solutions (two lamps with one footprint) it
    /// shares equally; an unknown in no equation is 0. Always finite.
    pub fn solve(&self) -> Vec<f64> {
        let n = self.unknowns;
        let trace: f64 = (0..n).map(|i| self.gram[i * n + i]).sum();
        let (all_gram, all_target): (f64, f64) = (self.gram.iter().sum(), self.target.iter().map(|t| t.max(0.0)).sum());
        if !(trace > 0.0 && all_target > 0.0) {
            return vec![0.0; n];
        }
        // A billionth of the mean square keeps divisions finite and changes no significant weight.
        let ridge = 1e-9 * trace / n as f64;
        let row = |i: usize, x: &[f64]| -> f64 {
            ridge * x[i] + self.gram[i * n..(i + 1) * n].iter().zip(x).map(|(g, x)| g * x).sum::<f64>()
        };
        // Multiplicative updates (Daube-Witherspoon and Muehllehner 1986) approach from equal weights and treat
        // equal unknowns equally.
        let mut x = vec![all_target / all_gram; n];
        for _ in 0..50 {
            let product: Vec<f64> = (0..n).map(|i| row(i, &x)).collect();
            for i in 0..n {
                x[i] = if product[i] > 0.0 { x[i] * self.target[i].max(0.0) / product[i] } else { 0.0 };
            }
        }
        // Coordinate descent then reaches the minimum: each step is exact in one unknown.
        for _ in 0..500 {
            let (mut change, mut largest) = (0.0f64, 0.0f64);
            for i in 0..n {
                let step = (self.target[i] - row(i, &x)) / (self.gram[i * n + i] + ridge);
                let next = (x[i] + step).max(0.0);
                change = change.max((next - x[i]).abs());
                largest = largest.max(next);
                x[i] = next;
            }
            if change <= 1e-7 * largest {
                break;
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn system(rows: &[Vec<f64>], y: &[f64]) -> NormalEquations {
        let mut equations = NormalEquations::new(rows[0].len());
        for (row, y) in rows.iter().zip(y) {
            let terms: Vec<_> = row.iter().copied().enumerate().filter(|(_, a)| *a != 0.0).collect();
            equations.add(&terms, *y);
        }
        equations
    }

    proptest! {
        #[test]
        fn overlapping_footprints_are_told_apart(truth in proptest::collection::vec(0.0f64..5.0, 2..40)) {
            let n = truth.len();
            let rows: Vec<Vec<f64>> = (0..3 * n)
                .map(|p| (0..n).map(|i| (-((p as f64 / 3.0 - i as f64) / 0.8).powi(2)).exp()).collect())
                .collect();
            let y: Vec<f64> = rows.iter().map(|row| row.iter().zip(&truth).map(|(a, x)| a * x).sum()).collect();
            for (found, is) in system(&rows, &y).solve().iter().zip(&truth) {
                prop_assert!((found - is).abs() < 1e-3, "{found} is not {is}");
            }
        }
    }

    #[test]
    fn what_would_be_negative_is_zero() {
        let x = system(&[vec![1.0, 1.0], vec![0.0, 1.0]], &[1.0, 2.0]).solve();
        // The unconstrained solution is (−1, 2); with x₀ = 0 the best x₁ is (1 + 2)/2.
        assert!(x[0] == 0.0 && (x[1] - 1.5).abs() < 1e-6, "{x:?}");
    }

    #[test]
    fn forty_one_equal_lamps_share() {
        let x = system(&[vec![2.0; 41]], &[8.2]).solve();
        assert!(x.iter().all(|x| (x - 0.1).abs() < 1e-6), "{x:?}");
        test_support::shown!(Light, "41 equal lamps: a singular system", bound: "each a 41st, to 1e-6",
 measured: format!("{:.1e}", x.iter().map(|x| (x - 0.1).abs()).fold(0.0, f64::max)));
    }

    #[test]
    fn nothing_seen_is_nothing_found() {
        assert_eq!(NormalEquations::new(3).solve(), [0.0; 3]);
        assert_eq!(system(&[vec![1.0, 0.0]], &[1.0]).solve()[1], 0.0);
    }
}
