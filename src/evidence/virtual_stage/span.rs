//! Share of the interview's light outside the span of the banks.

use imaging::{Image, Mask};

/// Sum of banks nearest to a picture under the interview's light.
pub struct NearestSum {
    /// Weights per bank and channel, not negative.
    pub weights: Vec<[f32; 3]>,
    /// Root-mean-square difference of both pictures on the subject, relative to the picture under the interview's
    /// light.
    pub residual: f32,
}

impl NearestSum {
    /// Non-negative least squares per channel, over the pixels that the subject covers: coordinate descent on the
    /// normal equations (Franc, Hlaváč and Navara, "Sequential coordinate-wise algorithm for non-negative least
    /// squares", 2005).
    pub fn fit(banks: &[Image], interview: &Image, coverage: &Mask) -> Self {
        const SWEEPS: usize = 2000;
        let n = banks.len();
        let covered: Vec<usize> = (0..coverage.pixels.len()).filter(|&i| coverage.pixels[i] > 0.98).collect();
        let mut weights = vec![[0.0; 3]; n];
        let (mut error, mut power) = (0.0f64, 0.0f64);
        for c in 0..3 {
            let light = |bank: usize, i: usize| f64::from(banks[bank].pixels[i][c]);
            let is = |i: usize| f64::from(interview.pixels[i][c]);
            // Normal equations: a row for each bank, and its product with the picture.
            let mut rows = vec![(vec![0.0f64; n], 0.0f64); n];
            for &i in &covered {
                for (a, (row, common)) in rows.iter_mut().enumerate() {
                    *common += light(a, i) * is(i);
                    for (b, product) in row.iter_mut().enumerate() {
                        *product += light(a, i) * light(b, i);
                    }
                }
                power += is(i).powi(2);
            }
            let mut x = vec![0.0f64; n];
            for _ in 0..SWEEPS {
                for (a, (row, common)) in rows.iter().enumerate() {
                    let sum: f64 = row.iter().zip(&x).map(|(product, x)| product * x).sum();
                    if row[a] > 0.0 {
                        x[a] = (x[a] - (sum - common) / row[a]).max(0.0);
                    }
                }
            }
            for &i in &covered {
                let sum: f64 = (0..n).map(|bank| x[bank] * light(bank, i)).sum();
                error += (sum - is(i)).powi(2);
            }
            for (weight, x) in weights.iter_mut().zip(x) {
                weight[c] = x as f32;
            }
        }
        Self { weights, residual: (error / power.max(f64::MIN_POSITIVE)).sqrt() as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Raster;

    #[test]
    fn a_sum_of_the_banks_is_found_and_other_light_leaves_a_residual() {
        let bank = |k: usize| Raster::from_fn(8, 8, |x, y| [0.1 + ((x * (k + 1) + y * y * k) % 5) as f32; 3]);
        let banks: Vec<Image> = (0..4).map(bank).collect();
        let weights = [0.5, 0.0, 2.0, 1.0];
        let mut sum =
            Raster::from_fn(8, 8, |x, y| [0, 1, 2].map(|c| (0..4).map(|b| weights[b] * banks[b].at(x, y)[c]).sum()));
        let coverage = Raster::filled(8, 8, 1.0);
        let found = NearestSum::fit(&banks, &sum, &coverage);
        assert!(found.residual < 1e-3);
        for (found, is) in found.weights.iter().zip(weights) {
            assert!((found[0] - is).abs() < 5e-3, "{found:?} for {is}");
        }
        sum.pixels[9] = [40.0; 3];
        assert!(NearestSum::fit(&banks, &sum, &coverage).residual > 0.1);
    }
}
