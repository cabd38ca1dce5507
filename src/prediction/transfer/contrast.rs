//! Pictures of local contrast, in which poses are matched.

use crate::blur::blur;
use crate::shape::quantile;
use imaging::resample::resize;
use imaging::{Mask, Raster};

/// Window of the local contrast of plates, as a share of the picture's side.
pub const WINDOW: f32 = 20.0 / 160.0;
/// Pictures are matched at half as many pixels a side again as the working size has, but at no more than this many.
const MOST_SIDE: usize = 384;
/// Quantile of the subject's light that counts as its bright level.
const BRIGHT: f32 = 0.95;
/// Codes of one local deviation, and of the local mean.
const DEVIATION: f32 = 50.0;
const MEAN: f32 = 128.0;
/// Light below this share of the subject's bright level counts as black.
const BLACK: f32 = 1.4e-3;
/// Least share of a window that the matte counts as covering.
const LEAST_SHARE: f32 = 1e-3;

/// Local contrast in a window of `radius` of the picture's side, at the size at which pictures are matched.
pub fn matched_contrast(light: &Raster<f32>, matte: &Mask, radius: f32) -> Raster<f32> {
    let (width, height) = light.size();
    let longer = width.max(height);
    let contrast = local_contrast(light, matte, bright_level(light, matte), radius * longer as f32);
    if longer == 0 {
        return contrast;
    }
    let side = (longer + longer / 2).min(MOST_SIDE);
    resize(&contrast, (width * side).div_ceil(longer), (height * side).div_ceil(longer))
}

/// The subject's bright level: a high quantile of its light.
pub fn bright_level(light: &Raster<f32>, mask: &Mask) -> f32 {
    let subject =
        light.pixels.iter().zip(&mask.pixels).filter(|(v, m)| **m > 0.5 && v.is_finite()).map(|(v, _)| *v).collect();
    quantile(subject, BRIGHT)
}

/// Texture that light and shade change little, in codes of 0 to 255: the logarithm of `light`, less its local mean, over its
/// local deviation, both in a Gaussian window of `radius` pixels inside the matte. 128 outside. `bright` is the subject's
/// bright level.
fn local_contrast(light: &Raster<f32>, inside: &Mask, bright: f32, radius: f32) -> Raster<f32> {
    let black = (BLACK * bright).max(f32::MIN_POSITIVE);
    // From 0 for black: where the matte covers little of a window, its mean tends to black.
    let log = light.map(|v| (v.max(black) / black).ln());
    let share = blur(inside, radius).map(|v| v.max(LEAST_SHARE));
    let mean = over(&blur(&times(&log, inside), radius), &share);
    let rest =
        times(&Raster { pixels: log.pixels.iter().zip(&mean.pixels).map(|(l, m)| l - m).collect(), ..log }, inside);
    let variance = over(&blur(&times(&rest, &rest), radius), &share);
    let code = |(rest, variance): (&f32, &f32)| (MEAN + DEVIATION * rest / (variance + 1e-3).sqrt()).clamp(0.0, 255.0);
    Raster { pixels: rest.pixels.iter().zip(&variance.pixels).map(code).collect(), ..rest }
}

fn times(a: &Raster<f32>, b: &Raster<f32>) -> Raster<f32> {
    Raster { width: a.width, height: a.height, pixels: a.pixels.iter().zip(&b.pixels).map(|(a, b)| a * b).collect() }
}

fn over(a: &Raster<f32>, b: &Raster<f32>) -> Raster<f32> {
    Raster { width: a.width, height: a.height, pixels: a.pixels.iter().zip(&b.pixels).map(|(a, b)| a / b).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_and_shade_hardly_change_texture() {
        let size = 64;
        let texture = Raster::from_fn(size, size, |x, y| 0.4 + 0.2 * ((x as f32).sin() * (y as f32 * 0.7).cos()));
        let shaded = Raster::from_fn(size, size, |x, y| texture.at(x, y) * (0.1 + x as f32 / size as f32));
        let inside = Raster::filled(size, size, 1.0);
        let [a, b] = [texture, shaded].map(|light| local_contrast(&light, &inside, 0.6, 6.0));
        for (x, y) in (8..56).flat_map(|y| (16..56).map(move |x| (x, y))) {
            let miss = (a.at(x, y) - b.at(x, y)).abs();
            assert!(miss < 0.2 * DEVIATION, "{x} {y}: {miss}");
        }
    }

    #[test]
    fn highlights_far_above_white_stay_codes_and_leave_the_rest() {
        let size = 64;
        let texture = Raster::from_fn(size, size, |x, y| 0.4 + 0.2 * (x as f32 + y as f32).sin());
        let mut glint = texture.clone();
        glint.pixels[8 * size + 8] = 16.0;
        let inside = Raster::filled(size, size, 1.0);
        let [plain, glint] = [texture, glint].map(|l| local_contrast(&l, &inside, 0.6, 4.0));
        assert!(glint.pixels.iter().all(|v| (0.0..=255.0).contains(v)));
        for (x, y) in (32..64).flat_map(|y| (32..64).map(move |x| (x, y))) {
            assert!((plain.at(x, y) - glint.at(x, y)).abs() < 0.01 * DEVIATION, "{x} {y}");
        }
    }

    #[test]
    fn black_and_empty_pictures_are_flat() {
        for (light, matte) in [(0.0, 1.0), (0.5, 0.0), (0.0, 0.0)] {
            let picture = local_contrast(&Raster::filled(9, 5, light), &Raster::filled(9, 5, matte), 0.0, 3.0);
            assert!(picture.pixels.iter().all(|v| (v - 128.0).abs() < 1e-2));
        }
    }
}
