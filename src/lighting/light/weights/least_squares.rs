//! Non-negative least squares for a few hundred unknowns.

/// Normal equations of a least-squares problem: minimise ½·xᵀGx − rᵀx.
pub struct Normal {
    n: usize,
    /// G row by row; only the lower triangle is filled until [`Self::least`].
    gram: Vec<f64>,
    right: Vec<f64>,
    /// Weight of the square of Σx − 1. Kept apart because only this term couples distant unknowns.
    sum: f64,
}

impl Normal {
    /// A problem of `n` unknowns without equations.
    pub fn new(n: usize) -> Self {
        Self { n, gram: vec![0.0; n * n], right: vec![0.0; n], sum: 0.0 }
    }

    /// Adds an equation row · x = value with weight `weight` on its square.
    pub fn add(&mut self, row: &[f64], value: f64, weight: f64) {
        for (i, &at) in row.iter().enumerate() {
            let scaled = weight * at;
            self.right[i] += scaled * value;
            let gram = &mut self.gram[i * self.n..][..=i];
            for (gram, other) in gram.iter_mut().zip(row) {
                *gram += scaled * other;
            }
        }
    }

    /// Adds a sparse row, given by its non-zero unknowns in ascending order.
    pub fn add_sparse(&mut self, row: &[(u16, f64)], value: f64, weight: f64) {
        for (at, &(i, first)) in row.iter().enumerate() {
            let (i, scaled) = (usize::from(i), weight * first);
            self.right[i] += scaled * value;
            let gram = &mut self.gram[i * self.n..][..=i];
            for &(j, other) in &row[..=at] {
                gram[usize::from(j)] += scaled * other;
            }
        }
    }

    /// Adds the equation Σx = 1.
    pub fn add_sum(&mut self, weight: f64) {
        self.sum += weight;
    }

    /// Adds another problem's equations with weight `weight`.
    pub fn add_all(&mut self, other: &Self, weight: f64) {
        let pairs = self.gram.iter_mut().zip(&other.gram);
        pairs.for_each(|(gram, other)| *gram += weight * other);
        let pairs = self.right.iter_mut().zip(&other.right);
        pairs.for_each(|(right, other)| *right += weight * other);
        self.sum += weight * other.sum;
    }

    /// Improves `x` ≥ 0 towards the minimum by exact steps along one unknown at a time. Each step is a continuous
    /// function of the problem, and so is a fixed number of them.
    pub fn least(&mut self, x: &mut [f64]) {
        const SWEEPS: usize = 40;
        let n = self.n;
        for i in 0..n {
            for j in 0..i {
                self.gram[j * n + i] = self.gram[i * n + j];
            }
        }
        // Where most unknowns are uncoupled, a step visits only the coupled ones.
        let joined = self.gram.iter().filter(|g| **g != 0.0).count();
        let rows: Option<Vec<Vec<(u32, f64)>>> = (joined < n * n / 3).then(|| {
            let rows = self.gram.chunks_exact(n).map(|row| {
                let joined = row.iter().enumerate().filter(|(_, g)| **g != 0.0);
                joined.map(|(j, g)| (j as u32, *g)).collect()
            });
            rows.collect()
        });
        // Slope without the sum term, which is the same for all.
        let mut slope: Vec<f64> = (self.gram.chunks_exact(n.max(1)).zip(&self.right))
            .map(|(row, right)| right - row.iter().zip(&*x).map(|(g, x)| g * x).sum::<f64>())
            .collect();
        for _ in 0..SWEEPS {
            let mut sum: f64 = x.iter().sum();
            for i in 0..n {
                let row = &self.gram[i * n..(i + 1) * n];
                let curvature = row[i] + self.sum;
                if curvature <= 0.0 {
                    continue;
                }
                let step = ((slope[i] + self.sum * (1.0 - sum)) / curvature).max(-x[i]);
                if step == 0.0 {
                    continue;
                }
                x[i] += step;
                sum += step;
                match &rows {
                    Some(rows) => {
                        for &(j, g) in &rows[i] {
                            slope[j as usize] -= step * g;
                        }
                    }
                    None => {
                        let pairs = slope.iter_mut().zip(row);
                        pairs.for_each(|(slope, g)| *slope -= step * g);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_unknown_is_left_to_better(
            (n, cells) in (1usize..12).prop_flat_map(|n| (Just(n), proptest::collection::vec(-1.0f64..1.0, n * 30))),
            values in proptest::collection::vec(-1.0f64..2.0, 30), stops in -20i32..20,
        ) {
            // Units of the unknowns may differ by a million. In equal units a curvature is at least 59², and an
            // unknown is coupled to the others by at most 10·150: each sweep more than halves the remaining error.
            let unit = |i: usize| 2f64.powi(stops * i as i32 / n as i32);
            let mut normal = Normal::new(n);
            let row = |p: usize| -> Vec<f64> {
                (0..n).map(|i| unit(i) * (cells[i * 30 + p] + if p == i { 60.0 } else { 0.0 })).collect()
            };
            (0..30).for_each(|p| normal.add(&row(p), values[p], 1.0));
            let mut x = vec![0.0; n];
            normal.least(&mut x);
            for i in 0..n {
                let slope: f64 = (0..30)
                    .map(|p| {
                        let row = row(p);
                        row[i] * (values[p] - row.iter().zip(&x).map(|(a, x)| a * x).sum::<f64>())
                    })
                    .sum();
                prop_assert!(x[i] >= 0.0 && slope <= 1e-6 * unit(i));
                prop_assert!(x[i] == 0.0 || slope.abs() <= 1e-6 * unit(i));
            }
        }

        #[test]
        fn unknowns_that_do_not_meet_are_solved_alike(
            values in proptest::collection::vec(-1.0f64..2.0, 24), weight in 0.0f64..1.0,
        ) {
            // A chain of unknowns coupled only to neighbours, and their sum: once separate and once as an equation.
            let n = values.len();
            let (mut apart, mut equation) = (Normal::new(n), Normal::new(n));
            for normal in [&mut apart, &mut equation] {
                for (i, value) in values.iter().enumerate() {
                    let next = (i + 1) % n;
                    let mut row = [(i as u16, 1.0), (next as u16, 0.4)];
                    row.sort_by_key(|(i, _)| *i);
                    normal.add_sparse(&row, *value, 1.0);
                }
            }
            apart.add_sum(weight);
            equation.add(&vec![1.0; n], 1.0, weight);
            let (mut x, mut y) = (vec![0.5; n], vec![0.5; n]);
            apart.least(&mut x);
            equation.least(&mut y);
            for (x, y) in x.iter().zip(&y) {
                prop_assert!((x - y).abs() < 1e-9, "{} is not {}", x, y);
            }
        }

        #[test]
        fn a_sparse_row_is_a_row(
            row in proptest::collection::vec(prop_oneof![Just(0.0), -1.0f64..1.0], 1..9), value in -1.0f64..1.0,
        ) {
            let (mut full, mut sparse) = (Normal::new(row.len()), Normal::new(row.len()));
            full.add(&row, value, 2.0);
            let parts: Vec<(u16, f64)> = row.iter().enumerate().filter(|(_, v)| **v != 0.0)
                .map(|(i, v)| (i as u16, *v)).collect();
            sparse.add_sparse(&parts, value, 2.0);
            prop_assert_eq!(full.gram, sparse.gram);
            prop_assert_eq!(full.right, sparse.right);
        }
    }
}
