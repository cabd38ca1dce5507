//! SSIM: structural similarity of two pictures.
//!
//! Wang, Bovik, Sheikh and Simoncelli, "Image Quality Assessment: From Error Visibility to Structural Similarity" (IEEE
//! TIP 2004), with their window, a Gaussian of 11 × 11 pixels and standard deviation 1.5, and their constants K1 = 0.01
//! and K2 = 0.03, on the luma of the codes.

use super::filter::{Kernel, filtered};
use super::metrics::check_pair;
use base::error::Result;
use imaging::color::{luminance, unit};
use imaging::{Encoded, Raster};

const RADIUS: usize = 5;
const DEVIATION: f64 = 1.5;
/// (K · L)² with codes from 0 to 1.
const C1: f32 = 0.01 * 0.01;
const C2: f32 = 0.03 * 0.03;

/// Similarity of each pixel, from −1 to 1 for identical surroundings. Edge pixels are repeated beyond the border;
/// values are clipped to `[0, 1]`, and NaN counts as 0.
///
/// # Errors
/// When the pictures differ in size or have no pixels.
pub fn ssim(reference: &Encoded, test: &Encoded) -> Result<Raster<f32>> {
    check_pair(reference, test)?;
    let window = Kernel::gaussian(RADIUS, DEVIATION);
    let luma = |picture: &Encoded| picture.0.map(|p| luminance(p.map(unit)));
    let (a, b) = (luma(reference), luma(test));
    let mean = |plane: &Raster<f32>| filtered(plane, &window, &window).pixels;
    let mean_of_product = |a: &Raster<f32>, b: &Raster<f32>| {
        let pixels = a.pixels.iter().zip(&b.pixels).map(|(x, y)| x * y).collect();
        mean(&Raster { pixels, ..*a })
    };
    let (mean_a, mean_b) = (mean(&a), mean(&b));
    let (squares_a, squares_b) = (mean_of_product(&a, &a), mean_of_product(&b, &b));
    let products = mean_of_product(&a, &b);
    let pixels = (0..products.len())
        .map(|i| {
            let (x, y) = (mean_a[i], mean_b[i]);
            let variance = |squares: f32, mean: f32| (squares - mean * mean).max(0.0);
            let (xx, yy) = (variance(squares_a[i], x), variance(squares_b[i], y));
            let xy = products[i] - x * y;
            (2.0 * x * y + C1) * (2.0 * xy + C2) / ((x * x + y * y + C1) * (xx + yy + C2))
        })
        .collect();
    Ok(Raster { width: a.width, height: a.height, pixels })
}

#[cfg(test)]
mod tests {
    use super::super::flip::tests::pattern;
    use super::*;

    #[test]
    fn equal_pictures_are_alike_and_a_negative_is_not() {
        let a = pattern(30, 20, 1);
        let same = ssim(&a, &a).unwrap();
        assert!(same.pixels.iter().all(|s| (s - 1.0).abs() < 1e-5));
        let negative = Encoded(a.0.map(|p| p.map(|v| 1.0 - v)));
        let opposite = ssim(&a, &negative).unwrap();
        assert!(opposite.pixels.iter().sum::<f32>() < 0.0);
        assert!(ssim(&a, &pattern(30, 21, 1)).is_err());
    }

    /// Figures of scikit-image 0.26 with its Gaussian window, away from the edges, where its border handling differs.
    #[test]
    fn values_are_those_of_scikit_image() {
        let a = pattern(48, 32, 1);
        let blend = |share: f32| {
            let other = pattern(48, 32, 2).0;
            let pairs = a.0.pixels.iter().zip(&other.pixels);
            let mix = |(p, q): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| p[c] + share * (q[c] - p[c]));
            let pixels = pairs.map(mix).collect();
            Encoded(Raster { pixels, ..other })
        };
        let cases = [
            (0.1, [0.985_551, 0.992_017, 0.996_028]),
            (0.5, [0.710_164, 0.726_374, 0.899_116]),
            (1.0, [0.182_342, -0.073_710, 0.643_657]),
        ];
        for (share, wanted) in cases {
            let map = ssim(&a, &blend(share)).unwrap();
            let inner = (5..27).flat_map(|y| (5..43).map(move |x| (x, y)));
            let values: Vec<f64> = inner.map(|(x, y)| f64::from(map.at(x, y))).collect();
            let found =
                [values.iter().sum::<f64>() / values.len() as f64, f64::from(map.at(24, 16)), f64::from(map.at(7, 9))];
            for (found, wanted) in found.into_iter().zip(wanted) {
                assert!((found - wanted).abs() < 1e-4, "{share}: {found}, not {wanted}");
            }
        }
    }
}
