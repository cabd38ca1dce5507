//! Positive definite systems of a few hundred unknowns.

/// Lower triangle L of L·Lᵀ = `matrix` (n × n, row by row, positive definite).
pub struct Cholesky {
    lower: Vec<f64>,
    n: usize,
}

impl Cholesky {
    /// Factors a matrix; `None` if it is not positive definite.
    pub fn new(mut matrix: Vec<f64>, n: usize) -> Option<Self> {
        for i in 0..n {
            for j in 0..=i {
                let (row_i, row_j) = (&matrix[i * n..i * n + j], &matrix[j * n..j * n + j]);
                let dot: f64 = row_i.iter().zip(row_j).map(|(a, b)| a * b).sum();
                let rest = matrix[i * n + j] - dot;
                matrix[i * n + j] = if i == j {
                    if !(rest > 0.0 && rest.is_finite()) {
                        return None;
                    }
                    rest.sqrt()
                } else {
                    rest / matrix[j * n + j]
                };
            }
        }
        Some(Self { lower: matrix, n })
    }

    /// L⁻¹·y.
    pub fn forward(&self, y: &[f64]) -> Vec<f64> {
        let mut x = y.to_vec();
        for i in 0..self.n {
            let row = &self.lower[i * self.n..i * self.n + i];
            let dot: f64 = row.iter().zip(&x).map(|(a, b)| a * b).sum();
            x[i] = (x[i] - dot) / self.lower[i * self.n + i];
        }
        x
    }

    /// Solves matrix·x = y for x.
    pub fn solve(&self, y: &[f64]) -> Vec<f64> {
        let mut x = self.forward(y);
        for i in (0..self.n).rev() {
            let dot: f64 = (i + 1..self.n).map(|j| self.lower[j * self.n + i] * x[j]).sum();
            x[i] = (x[i] - dot) / self.lower[i * self.n + i];
        }
        x
    }

    /// The matrix's inverse.
    pub fn inverse(&self) -> Vec<f64> {
        let unit = |i: usize| (0..self.n).map(|j| f64::from(i == j)).collect::<Vec<_>>();
        (0..self.n).flat_map(|i| self.solve(&unit(i))).collect()
    }

    /// Half the logarithm of the determinant.
    pub fn half_log_determinant(&self) -> f64 {
        (0..self.n).map(|i| self.lower[i * self.n + i].ln()).sum()
    }
}

/// Inverse of a symmetric positive matrix of `n` × `n`, regularised if slightly indefinite; `None` if it is 0, NaN
/// or infinite.
pub(super) fn inverse(matrix: &[f64], n: usize) -> Option<Vec<f64>> {
    let trace: f64 = (0..n).map(|i| matrix[i * n + i]).sum();
    let mut positive = matrix.to_vec();
    for i in 0..n {
        positive[i * n + i] += 1e-6 * trace / n as f64;
    }
    Some(Cholesky::new(positive, n)?.inverse())
}
