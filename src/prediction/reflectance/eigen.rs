//! Eigenvectors of a small symmetric matrix.

use super::kernels::chunks::vectorized;

/// A full symmetric matrix, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Symmetric {
    rows: Vec<Vec<f64>>,
}

impl Symmetric {
    /// A matrix of zeros.
    pub fn zeros(size: usize) -> Self {
        Self { rows: vec![vec![0.0; size]; size] }
    }

    pub fn add(&mut self, other: &Self) {
        let values = self.rows.iter_mut().flatten();
        (values.zip(other.rows.iter().flatten())).for_each(|(a, b)| *a += b);
    }

    /// Adds the inner products of all pairs of `vectors`, one vector per row.
    pub fn add_products<const N: usize>(&mut self, vectors: &[[f64; N]]) {
        vectorized(
            #[inline(always)]
            || {
                for a in 0..vectors.len() {
                    for b in 0..=a {
                        let product = dot(&vectors[a], &vectors[b]);
                        self.rows[a][b] += product;
                        if a != b {
                            self.rows[b][a] += product;
                        }
                    }
                }
            },
        );
    }
}

/// As many partial sums as keep a vector unit busy.
#[inline(always)]
fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sums = [0f64; 32];
    let (a, a_rest) = a.as_chunks::<32>();
    let (b, b_rest) = b.as_chunks::<32>();
    for (a, b) in a.iter().zip(b) {
        for i in 0..32 {
            sums[i] += a[i] * b[i];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Eigenvalues in descending order with their unit eigenvectors, by Jacobi's cyclic rotations (Golub and
/// Van Loan, Matrix Computations, section 8.5): slow for large matrices, exact for all. Values are finite.
pub fn eigenvectors(matrix: Symmetric) -> (Vec<f64>, Vec<Vec<f64>>) {
    /// Most sweeps. Rotations shrink off-diagonal elements quadratically: six to ten sweeps suffice for hundreds of
    /// rows.
    const SWEEPS: usize = 40;
    let mut rows = matrix.rows;
    let size = rows.len();
    // In the end the rows are the eigenvectors.
    let mut vectors: Vec<Vec<f64>> =
        (0..size).map(|i| (0..size).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    // Smaller elements move no eigenvalue beyond the rounding so far.
    let magnitudes = rows.iter().flatten().map(|value| value.abs());
    let negligible = f64::EPSILON * magnitudes.fold(0.0, f64::max);
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for p in 0..size {
            for q in p + 1..size {
                let (a, b, off) = (rows[p][p], rows[q][q], rows[p][q]);
                if off.abs() <= negligible {
                    continue;
                }
                rotated = true;
                let tau = (b - a) / (2.0 * off);
                let tan = 1f64.copysign(tau) / (tau.abs() + tau.hypot(1.0));
                let cos = 1.0 / tan.hypot(1.0);
                let sin = tan * cos;
                rotate(&mut rows, p, q, cos, sin);
                for row in &mut rows {
                    let (x, y) = (row[p], row[q]);
                    (row[p], row[q]) = (cos * x - sin * y, sin * x + cos * y);
                }
                (rows[p][q], rows[q][p]) = (0.0, 0.0);
                rotate(&mut vectors, p, q, cos, sin);
            }
        }
        if !rotated {
            break;
        }
    }
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|&a, &b| rows[b][b].total_cmp(&rows[a][a]));
    let values = order.iter().map(|&i| rows[i][i]).collect();
    let sorted = order.iter().map(|&i| std::mem::take(&mut vectors[i]));
    (values, sorted.collect())
}

/// Rotates rows `p` < `q` in their plane.
fn rotate(rows: &mut [Vec<f64>], p: usize, q: usize, cos: f64, sin: f64) {
    let (head, tail) = rows.split_at_mut(q);
    for (x, y) in head[p].iter_mut().zip(&mut tail[0]) {
        (*x, *y) = (cos * *x - sin * *y, sin * *x + cos * *y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(size: usize, value: impl Fn(usize, usize) -> f64) -> Symmetric {
        let row = |i: usize| (0..size).map(|j| value(i.max(j), i.min(j))).collect();
        Symmetric { rows: (0..size).map(row).collect() }
    }

    /// The largest |A·v − λ·v| and the largest |v·w − δ|, in units of the largest eigenvalue and 1.
    fn errors(matrix: &Symmetric, values: &[f64], vectors: &[Vec<f64>]) -> [f64; 2] {
        let inner = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (mut residual, mut skew) = (0f64, 0f64);
        for (i, (value, vector)) in values.iter().zip(vectors).enumerate() {
            for (row, v) in matrix.rows.iter().zip(vector) {
                residual = residual.max((inner(row, vector) - value * v).abs());
            }
            for (j, other) in vectors.iter().enumerate() {
                let wanted = f64::from(u8::from(i == j));
                skew = skew.max((inner(vector, other) - wanted).abs());
            }
        }
        [residual / values[0].abs().max(f64::MIN_POSITIVE), skew]
    }

    #[test]
    fn known_eigenvalues_are_found() {
        let (values, vectors) = eigenvectors(matrix(2, |i, j| if i == j { 2.0 } else { 1.0 }));
        assert!((values[0] - 3.0).abs() < 1e-14 && (values[1] - 1.0).abs() < 1e-14);
        assert!((vectors[0][0] - vectors[0][1]).abs() < 1e-14);
        // Second differences: 2 − 2 cos(kπ / (n + 1)).
        let chain = matrix(40, |i, j| [2.0, -1.0, 0.0][(i - j).min(2)]);
        for (k, value) in eigenvectors(chain).0.into_iter().rev().enumerate() {
            let wanted = 2.0 - 2.0 * ((k + 1) as f64 * std::f64::consts::PI / 41.0).cos();
            assert!((value - wanted).abs() < 1e-13, "{value} is not {wanted}");
        }
    }

    #[test]
    fn eigenvectors_are_orthonormal_even_where_values_meet() {
        let noise = |i: usize, j: usize| ((i * 7919 + j * 104_729) % 1000) as f64 - 500.0;
        for case in [
            matrix(123, noise),
            matrix(41, |_, _| 1.0),
            matrix(41, |i, j| f64::from(u8::from(i == j))),
            matrix(5, |_, _| 0.0),
            matrix(3, |i, j| 1e60 * noise(i, j)),
        ] {
            let (values, vectors) = eigenvectors(case.clone());
            assert!(values.is_sorted_by(|a, b| a >= b));
            let [residual, skew] = errors(&case, &values, &vectors);
            assert!(residual < 1e-12 && skew < 1e-12, "{residual} {skew}");
        }
        assert_eq!(eigenvectors(Symmetric::zeros(0)), (vec![], vec![]));
    }
}
