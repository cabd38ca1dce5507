//! Guided filter that aligns a matte's edges with the picture's.

use super::window;
use rayon::prelude::*;

/// Largest variance of the guide, in squared light, of a flat window. Light is in `[0, 1]`: a standard deviation of
/// one in a hundred, about the noise of a camera.
pub const FLAT: f32 = 1e-4;

/// `alpha` as a local linear function of the colour `guide` in windows of `radius` (He, Sun and Tang 2013, equations 11 to
/// 16).
pub fn guided(guide: &[[f32; 3]], alpha: &[f32], size: (usize, usize), radius: usize) -> Vec<f32> {
    // 3 sums of the guide, 6 of its products, 1 of alpha, 3 of guide times alpha.
    let terms: Vec<[f32; 13]> = (guide.par_iter().zip(alpha))
        .map(|(&[r, g, b], &a)| {
            let products = [r * r, r * g, r * b, g * g, g * b, b * b];
            let [rr, rg, rb, gg, gb, bb] = products;
            [r, g, b, rr, rg, rb, gg, gb, bb, a, r * a, g * a, b * a]
        })
        .collect();
    let count = window::counts(size, radius);
    let fits: Vec<[f32; 4]> = window::sums(&terms, size, radius)
        .into_par_iter()
        .enumerate()
        .map(|(i, sum)| fit(sum.map(|v| f64::from(v / count(i)))))
        .collect();
    window::sums(&fits, size, radius)
        .into_par_iter()
        .enumerate()
        .map(|(i, sum)| {
            let [a, b, c, d] = sum.map(|v| v / count(i));
            let [r, g, bl] = guide[i];
            (a * r + b * g + c * bl + d).clamp(0.0, 1.0)
        })
        .collect()
}

/// Slopes and offset of a window's linear function, from the means of its terms.
fn fit(mean: [f64; 13]) -> [f32; 4] {
    let [r, g, b, rr, rg, rb, gg, gb, bb, a, ra, ga, ba] = mean;
    let flat = f64::from(FLAT);
    let (xx, yy, zz) = (rr - r * r + flat, gg - g * g + flat, bb - b * b + flat);
    let (xy, xz, yz) = (rg - r * g, rb - r * b, gb - g * b);
    let [u, v, w] = [ra - r * a, ga - g * a, ba - b * a];
    // Cramer's rule: the matrix is symmetric and, by `flat`, never singular.
    let minors = [
        yy * zz - yz * yz,
        xz * yz - xy * zz,
        xy * yz - xz * yy,
        xx * zz - xz * xz,
        xy * xz - xx * yz,
        xx * yy - xy * xy,
    ];
    let [m00, m01, m02, m11, m12, m22] = minors;
    let det = xx * m00 + xy * m01 + xz * m02;
    let slopes =
        [(m00 * u + m01 * v + m02 * w) / det, (m01 * u + m11 * v + m12 * w) / det, (m02 * u + m12 * v + m22 * w) / det];
    let offset = a - slopes[0] * r - slopes[1] * g - slopes[2] * b;
    [slopes[0], slopes[1], slopes[2], offset].map(|v| v as f32)
}
