//! Fill of the unseen part of a panorama with the smoothest continuation of the seen light around it.

use imaging::Image;
use std::f64::consts::PI;

/// Sweeps on each level of detail. Each level starts from the solution of the next coarser one.
const SWEEPS: usize = 40;
/// Over-relaxation (Young 1954).
const RELAXATION: f64 = 1.6;

/// Fills the texels of a lat-long panorama that are not `seen` with the solution of Laplace's equation on the
/// sphere whose border is the seen texels. The fill stays within the range of its border and has no jumps. If
/// nothing is seen, everything is black.
pub(super) fn fill(panorama: &mut Image, seen: &[bool]) {
    if seen.iter().all(|&s| s) {
        return;
    }
    let (width, height) = panorama.size();
    if width * height > 1 {
        let (coarse, coarse_seen) = halved(panorama, seen);
        let mut coarse = coarse;
        fill(&mut coarse, &coarse_seen);
        for (i, _) in seen.iter().enumerate().filter(|(_, seen)| !**seen) {
            panorama.pixels[i] = coarse.at(i % width / 2, i / width / 2);
        }
    } else {
        panorama.pixels[0] = [0.0; 3];
    }
    relax(panorama, seen);
}

/// The panorama at half the size: the mean of the seen texels by solid angle.
fn halved(panorama: &Image, seen: &[bool]) -> (Image, Vec<bool>) {
    let (width, height) = panorama.size();
    let size = (width.div_ceil(2), height.div_ceil(2));
    let mut weights = vec![0.0f64; size.0 * size.1];
    let mut sums = vec![[0.0f64; 3]; weights.len()];
    for (i, pixel) in panorama.pixels.iter().enumerate().filter(|(i, _)| seen[*i]) {
        let (x, y) = (i % width, i / width);
        let weight = (PI * (y as f64 + 0.5) / height as f64).sin();
        let to = y / 2 * size.0 + x / 2;
        weights[to] += weight;
        for c in 0..3 {
            sums[to][c] += weight * f64::from(pixel[c]);
        }
    }
    let mean = |(sum, &weight): (&[f64; 3], &f64)| {
        if weight > 0.0 { sum.map(|v| (v / weight) as f32) } else { [0.0; 3] }
    };
    let image = Image { width: size.0, height: size.1, pixels: sums.iter().zip(&weights).map(mean).collect() };
    (image, weights.iter().map(|w| *w > 0.0).collect())
}

/// Sweeps over the unseen texels, each towards its neighbours' mean on the sphere.
fn relax(panorama: &mut Image, seen: &[bool]) {
    let (width, height) = panorama.size();
    let (across, down) = (2.0 * PI / width as f64, PI / height as f64);
    let holes: Vec<usize> = (0..seen.len()).filter(|&i| !seen[i]).collect();
    for _ in 0..SWEEPS {
        for &i in &holes {
            let (x, y) = (i % width, i / width);
            // Laplace–Beltrami operator: ∂²/∂φ² / sin²θ + (1/sin θ)·∂/∂θ (sin θ · ∂/∂θ).
            let sine = |rows: f64| (down * rows).sin();
            let middle = sine(y as f64 + 0.5);
            let sides = 1.0 / (across * middle).powi(2);
            let above = sine(y as f64) / (middle * down * down);
            let below = sine(y as f64 + 1.0) / (middle * down * down);
            let neighbours = [
                (y * width + (x + 1) % width, sides),
                (y * width + (x + width - 1) % width, sides),
                (if y > 0 { i - width } else { i }, above),
                (if y + 1 < height { i + width } else { i }, below),
            ];
            let all: f64 = neighbours.iter().map(|(_, weight)| weight).sum();
            for c in 0..3 {
                let mean =
                    neighbours.iter().map(|(j, weight)| weight * f64::from(panorama.pixels[*j][c])).sum::<f64>() / all;
                let old = f64::from(panorama.pixels[i][c]);
                panorama.pixels[i][c] = (old + RELAXATION * (mean - old)).max(0.0) as f32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use light::latlong::texel_direction;
    use proptest::prelude::*;

    /// A panorama with a hole around `axis`, filled, and the ground truth.
    fn filled(value: impl Fn(Vec3) -> f32, axis: Vec3, radius: f32) -> (Image, Image, Vec<bool>) {
        let (width, height) = (128, 64);
        let at = |i: usize| texel_direction(i % width, i / width, width, height);
        let truth = Image::from_fn(width, height, |x, y| [value(at(y * width + x)); 3]);
        let seen: Vec<bool> = (0..width * height).map(|i| at(i).angle_between(axis) > radius).collect();
        let mut image = truth.clone();
        for (pixel, seen) in image.pixels.iter_mut().zip(&seen) {
            if !seen {
                *pixel = [77.0; 3];
            }
        }
        fill(&mut image, &seen);
        (image, truth, seen)
    }

    #[test]
    fn a_harmonic_light_is_continued_exactly() {
        // Stereographic projection is conformal, so its coordinates are harmonic on the sphere.
        for axis in [Vec3::NEG_Z, Vec3::Z, Vec3::Y, Vec3::new(0.5, -0.8, 0.1).normalize()] {
            let side = axis.any_orthonormal_vector();
            let value = |d: Vec3| 2.0 + d.dot(side) / (1.0 + d.dot(axis)).max(0.1);
            let (image, truth, _) = filled(value, axis, 0.6);
            let worst = image.pixels.iter().zip(&truth.pixels);
            let worst = worst.map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f32::max);
            println!("{axis}: {worst}");
            assert!(worst < 0.02, "{axis}: {worst}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn nothing_is_brighter_or_darker_than_what_is_seen(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..1.0, radius in 0.05f32..2.8) {
            let axis = Vec3::new(x, y, z).normalize_or(Vec3::X);
            let (image, truth, seen) = filled(|d| 2.0 + (5.0 * d.x).sin() * (3.0 * d.y).cos(), axis, radius);
            let shown = truth.pixels.iter().zip(&seen).filter(|(_, seen)| **seen).map(|(p, _)| p[0]);
            let (low, high) = shown.fold((f32::MAX, 0.0f32), |(l, h), v| (l.min(v), h.max(v)));
            for pixel in &image.pixels {
                prop_assert!(pixel[0] >= low - 0.02 && pixel[0] <= high + 0.02, "{} in {low} to {high}", pixel[0]);
            }
        }
    }

    #[test]
    fn where_nothing_is_seen_everything_is_black() {
        let mut image = Image::filled(5, 3, [f32::NAN; 3]);
        fill(&mut image, &[false; 15]);
        assert!(image.pixels.iter().all(|p| *p == [0.0; 3]));
    }
}
