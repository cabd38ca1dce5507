//! Sums and means over square windows.

use rayon::prelude::*;

/// Sums of `values`, `width × height` of them in rows, over the square window of `radius` around each pixel,
/// clipped at the border.
pub fn sums<const N: usize>(values: &[[f32; N]], (width, height): (usize, usize), radius: usize) -> Vec<[f32; N]> {
    let rows = along(values, (width, height), radius);
    along(&rows, (height, width), radius)
}

/// Sums along rows, transposed.
fn along<const N: usize>(values: &[[f32; N]], (width, height): (usize, usize), radius: usize) -> Vec<[f32; N]> {
    let rows: Vec<Vec<[f32; N]>> = values
        .par_chunks(width)
        .map(|row| {
            let mut sum = [0.0_f64; N];
            let mut add = |pixel: &[f32; N], sign: f64| {
                for (sum, v) in sum.iter_mut().zip(pixel) {
                    *sum += sign * f64::from(*v);
                }
                sum
            };
            for pixel in row.iter().take(radius) {
                add(pixel, 1.0);
            }
            let summed = (0..width).map(|x| {
                if let Some(enters) = row.get(x + radius) {
                    add(enters, 1.0);
                }
                let sum = match x.checked_sub(radius + 1) {
                    Some(left) => add(&row[left], -1.0),
                    None => add(&[0.0; N], 1.0),
                };
                sum.map(|v| v as f32)
            });
            summed.collect()
        })
        .collect();
    (0..width * height).into_par_iter().map(|i| rows[i % height][i / height]).collect()
}

/// Number of pixels in each window.
pub fn counts(size: (usize, usize), radius: usize) -> impl Fn(usize) -> f32 + Sync {
    move |place| {
        let (x, y) = (place % size.0, place / size.0);
        let along = |at: usize, length: usize| (at + radius + 1).min(length) - at.saturating_sub(radius);
        (along(x, size.0) * along(y, size.1)) as f32
    }
}

/// Local means of the `certain` values around every pixel, from wide windows down to `radius`: each fills gaps of
/// the smaller ones, starting from `prior`.
pub fn means<const N: usize>(
    value: impl Fn(usize) -> [f32; N] + Sync,
    certain: &[bool],
    size: (usize, usize),
    radius: usize,
    prior: Vec<[f32; N]>,
) -> Vec<[f32; N]> {
    /// Number of certain pixels at which a window counts as much as the next wider one.
    const ENOUGH: f32 = 4.0;
    let weighted: Vec<([f32; N], [f32; 1])> = (0..certain.len())
        .into_par_iter()
        .map(|i| if certain[i] { (value(i), [1.0]) } else { ([0.0; N], [0.0]) })
        .collect();
    let (values, weights): (Vec<_>, Vec<_>) = weighted.into_iter().unzip();
    let mut means = prior;
    for step in (0..4).rev() {
        let radius = radius << step;
        let (sum, weight) = (sums(&values, size, radius), sums(&weights, size, radius));
        means.par_iter_mut().enumerate().for_each(|(i, mean)| {
            for (mean, sum) in mean.iter_mut().zip(&sum[i]) {
                *mean = (sum + ENOUGH * *mean) / (weight[i][0] + ENOUGH);
            }
        });
    }
    means
}
