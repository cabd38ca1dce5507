//! Gaussian blur of grey pictures.

use imaging::Raster;
use imaging::resample::{resize, resize_area};
use rayon::prelude::*;
use reflectance::kernels::chunks::vectorized;

/// Deviations at which the kernel is cut off.
const REACH: f32 = 4.0;

/// Deviation in pixels up to which pictures are blurred at their own size; wider blurs are made of fewer pixels.
const FULL_SIZE: f32 = 4.0;

/// A picture blurred by a Gaussian of `deviation` pixels, mirrored at its borders. The sum of each row and column has one
/// order, so the result does not depend on the number of threads.
pub fn blur(picture: &Raster<f32>, deviation: f32) -> Raster<f32> {
    let (width, height) = picture.size();
    if width == 0 || height == 0 || deviation <= 0.0 {
        return picture.clone();
    }
    let fewer = (deviation / FULL_SIZE).floor().max(1.0);
    let side = |length: usize| ((length as f32 / fewer).round() as usize).max(1);
    let (w, h) = (side(width), side(height));
    let small = resize_area(picture, w, h);
    let along = |small: usize, full: usize| kernel(deviation * small as f32 / full as f32);
    let blurred = convolved(&small, &along(w, width), &along(h, height));
    resize(&blurred, width, height)
}

/// A picture convolved by a kernel along its rows and one along its columns.
fn convolved(picture: &Raster<f32>, row: &[f32], column: &[f32]) -> Raster<f32> {
    let (width, height) = picture.size();
    let radius = row.len() / 2;
    let mut rows = vec![0.0; width * height];
    rows.par_chunks_exact_mut(width).zip(picture.pixels.par_chunks_exact(width)).for_each(|(out, pixels)| {
        let padded: Vec<f32> = (0..width + 2 * radius).map(|i| pixels[mirrored(i, radius, width)]).collect();
        vectorized(
            #[inline(always)]
            || {
                for (k, weight) in row.iter().enumerate() {
                    add_scaled(out, *weight, &padded[k..]);
                }
            },
        );
    });
    let radius = column.len() / 2;
    let mut pixels = vec![0.0; width * height];
    pixels.par_chunks_exact_mut(width).enumerate().for_each(|(y, out)| {
        vectorized(
            #[inline(always)]
            || {
                for (k, weight) in column.iter().enumerate() {
                    let above = &rows[mirrored(y + k, radius, height) * width..];
                    add_scaled(out, *weight, above);
                }
            },
        );
    });
    Raster { width, height, pixels }
}

#[inline(always)]
fn add_scaled(out: &mut [f32], weight: f32, values: &[f32]) {
    for (out, value) in out.iter_mut().zip(values) {
        *out += weight * value;
    }
}

/// Weights of a Gaussian, which sum to 1.
fn kernel(deviation: f32) -> Vec<f32> {
    let radius = (REACH * deviation).ceil() as usize;
    let weight = |k: usize| (-0.5 * ((k as f32 - radius as f32) / deviation).powi(2)).exp();
    let kernel: Vec<f32> = (0..=2 * radius).map(weight).collect();
    let sum: f32 = kernel.iter().sum();
    kernel.iter().map(|w| w / sum).collect()
}

/// The index `i - radius` of a row of `length`, mirrored about its first and last pixel as often as needed.
fn mirrored(i: usize, radius: usize, length: usize) -> usize {
    if length == 1 {
        return 0;
    }
    let period = 2 * (length - 1);
    let at = (i + radius * (period - 1)) % period;
    at.min(period - at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_picture_stays_as_it_is() {
        for (width, height, deviation) in [(1, 1, 3.0), (7, 1, 20.0), (16, 9, 2.0), (40, 30, 5.0)] {
            let blurred = blur(&Raster::filled(width, height, 0.5), deviation);
            assert!(blurred.pixels.iter().all(|v| (v - 0.5).abs() < 1e-5), "{width} × {height}");
        }
    }

    #[test]
    fn a_point_becomes_a_gaussian() {
        let mut point = Raster::filled(65, 65, 0.0);
        point.pixels[32 * 65 + 32] = 1.0;
        let blurred = blur(&point, 3.0);
        for (x, y) in [(32, 32), (35, 32), (32, 38), (30, 29)] {
            let (dx, dy) = (x as f32 - 32.0, y as f32 - 32.0);
            let expected = (-(dx * dx + dy * dy) / 18.0).exp() / (18.0 * std::f32::consts::PI);
            assert!((blurred.at(x, y) - expected).abs() < 1e-4);
        }
    }

    #[test]
    fn borders_are_mirrored() {
        assert_eq!((0..7).map(|i| mirrored(i, 2, 3)).collect::<Vec<_>>(), [2, 1, 0, 1, 2, 1, 0]);
    }
}
