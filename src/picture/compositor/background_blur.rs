//! Pass `background_blur`: the background out of focus, through a lens focused on the subject. Every point
//! becomes a disc, in linear light, so that lamps become bright discs. The subject is laid over it later.

use super::descriptor::{Descriptor, LightStep, needs_background};
use super::facts::key;
use super::passes::{GpuPicture, Recording, Shader};
use super::pyramid::{Rgba, double_onto, halve, mirrored, rgba};
use base::error::Result;
use imaging::{Image, Raster};
use rayon::prelude::*;
use reflectance::kernels::chunks::vectorized;
use scene::Pass;

const SHADER: Shader = Shader::new("background_blur", include_str!("../../../shaders/background_blur.wgsl"));

pub(crate) const BACKGROUND_BLUR: Descriptor = Descriptor {
    fixed: needs_background,
    settings: |context| key(context.effects.background_blur.to_bits()),
    shader: Some(&SHADER),
    ..Descriptor::new(Pass::BackgroundBlur, |context| {
        context.asked(Pass::BackgroundBlur)?;
        context.behind()?;
        let percent = 100.0 * context.effects.background_blur;
        Ok(format!("blurred by a disc with a radius of {percent:.1} % of the picture's height"))
    })
};

/// Blurs the background before the subject is laid over it.
pub(crate) const STEP: LightStep = LightStep {
    in_memory: |context, behind| {
        let radius = context.effects.background_blur * behind.height as f32;
        background_blur(behind, radius);
    },
    on_gpu: |context, recording, behind| {
        let radius = context.effects.background_blur * behind.height as f32;
        recording.background_blur(behind, radius)
    },
    cached: true,
};

/// Radius in pixels from which discs are drawn at half the size, recursively: the cost of a disc grows with
/// its area, and a disc of a few pixels is round enough after enlarging.
const LARGEST_RADIUS: f32 = 4.0;

/// Number of pixels summed at once.
const BLOCK: usize = 8;
const ZERO: [[f32; 4]; BLOCK] = [[0.0; 4]; BLOCK];

/// Blurs a picture by a disc of `radius` pixels. Edges are mirrored, so that no light is lost. A radius
/// that is not above 0 leaves the picture unchanged.
pub fn background_blur(picture: &mut Image, radius: f32) {
    if radius.is_nan() || radius <= 0.0 || picture.pixels.is_empty() {
        return;
    }
    let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
    if radius < LARGEST_RADIUS {
        let light = |i: usize| {
            let [r, g, b] = picture.pixels[i].map(finite);
            [r, g, b, 1.0]
        };
        *picture = disc(picture.size(), radius, light, |[r, g, b, _]| [r, g, b]);
        return;
    }
    let blurred = defocused(rgba(picture, |_, [r, g, b]| [r, g, b, 1.0]), radius);
    let pairs = picture.pixels.par_iter_mut().zip(&blurred.pixels);
    pairs.with_min_len(4096).for_each(|(pixel, &[r, g, b, _])| *pixel = [r, g, b]);
}

/// Four values per pixel, blurred by a disc of `radius` pixels.
pub(super) fn defocused(picture: Rgba, radius: f32) -> Rgba {
    if picture.pixels.is_empty() {
        return picture;
    }
    if radius < LARGEST_RADIUS || picture.pixels.len() <= 1 {
        return disc(picture.size(), radius, |i| picture.pixels[i], |sum| sum);
    }
    let small = defocused(halve(&picture), halved(radius));
    let mut large = picture;
    double_onto(&small, &mut large, 0.0);
    large
}

impl Recording<'_> {
    /// [`background_blur`] of all four values on the GPU, by a disc of `radius` pixels.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn background_blur(&mut self, picture: &GpuPicture, radius: f32) -> Result<GpuPicture> {
        if radius < LARGEST_RADIUS || picture.width * picture.height <= 1 {
            let values = [radius.max(0.0).to_bits(), 0];
            return self.plain((&SHADER, "disc"), values, picture, None);
        }
        let half = self.halve(picture, 1.0)?;
        let small = self.background_blur(&half, halved(radius))?;
        self.double_onto(&small, picture, 0.0, 1.0)
    }
}

/// Radius at half the size that gives the same width. A disc has the variance radius² / 4 along an
/// axis; halving and doubling add 0.75 pixels² each.
fn halved(radius: f32) -> f32 {
    (radius * radius - 6.0).max(0.0).sqrt() / 2.0
}

/// Mean of `pixel` over a disc with a one-pixel rim, so that fractional radii differ. `done` makes a
/// pixel of the result.
fn disc<T: Send>(
    (width, height): (usize, usize),
    radius: f32,
    pixel: impl Fn(usize) -> [f32; 4] + Sync,
    done: impl Fn([f32; 4]) -> T + Sync,
) -> Raster<T> {
    let taps = disc_taps(radius);
    let margin = reach(radius) as usize;
    // Each row once, mirrored on both sides; the last block of a row may read past it.
    let wide = width + 2 * margin + BLOCK;
    let mut rows = vec![[0f32; 4]; wide * height];
    let padded = rows.par_chunks_mut(wide).enumerate();
    padded.with_min_len(16).for_each(|(y, row)| {
        let inner = row[margin..].iter_mut().zip(y * width..(y + 1) * width);
        inner.for_each(|(value, i)| *value = pixel(i));
        for i in (0..margin).chain(margin + width..2 * margin + width) {
            row[i] = row[margin + mirrored(i as isize - margin as isize, width)];
        }
    });
    let lines = (0..height).into_par_iter().with_min_len(16);
    let lines = lines.flat_map_iter(|y| {
        let start = |tap: &DiscTap| {
            let row = mirrored(y as isize + tap.dy, height) * wide;
            (row + (tap.dx + margin as isize) as usize, tap.share)
        };
        let taps: Vec<(usize, f32)> = taps.iter().map(start).collect();
        let mut sums = vec![[0f32; 4]; width];
        vectorized(
            #[inline(always)]
            || weigh(&rows, &taps, &mut sums),
        );
        sums.into_iter().map(&done)
    });
    Raster { width, height, pixels: lines.collect() }
}

/// A row of sums over taps; each tap gives the offset of its first pixel in `rows`. A few pixels at a time,
/// whose sums stay in registers.
#[inline(always)]
fn weigh(rows: &[[f32; 4]], taps: &[(usize, f32)], out: &mut [[f32; 4]]) {
    for (block, out) in out.chunks_mut(BLOCK).enumerate() {
        let mut sums = [[0f32; 4]; BLOCK];
        for &(start, weight) in taps {
            let source = rows[start + block * BLOCK..].first_chunk().unwrap_or(&ZERO);
            for (sum, value) in sums.as_flattened_mut().iter_mut().zip(source.as_flattened()) {
                *sum += weight * value;
            }
        }
        out.copy_from_slice(&sums[..out.len()]);
    }
}

/// Number of pixels on either side that a disc can touch.
fn reach(radius: f32) -> isize {
    (radius + 0.5).ceil() as isize
}

/// Pixel under a disc: its offset from the middle, and its share of the sum.
struct DiscTap {
    dx: isize,
    dy: isize,
    share: f32,
}

/// Pixels under a disc, row by row. The sum of the shares is 1.
fn disc_taps(radius: f32) -> Vec<DiscTap> {
    let reach = reach(radius);
    let cover = |dx: isize, dy: isize| {
        let distance = ((dx * dx + dy * dy) as f32).sqrt();
        (radius + 0.5 - distance).clamp(0.0, 1.0)
    };
    let square = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)));
    let taps = square.map(|(dx, dy)| DiscTap { dx, dy, share: cover(dx, dy) });
    let mut taps: Vec<DiscTap> = taps.filter(|tap| tap.share > 0.0).collect();
    let total: f32 = taps.iter().map(|tap| tap.share).sum();
    taps.iter_mut().for_each(|tap| tap.share /= total);
    taps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(picture: &Image) -> f64 {
        picture.pixels.iter().map(|p| f64::from(p[0])).sum()
    }

    fn lamp(width: usize, height: usize, at: (usize, usize)) -> Image {
        Image::from_fn(width, height, |x, y| [if (x, y) == at { 1e6 } else { 0.1 }; 3])
    }

    #[test]
    fn no_light_is_lost_and_none_is_made() {
        for (width, height, at) in [(64, 64, (20, 30)), (64, 32, (0, 0)), (128, 64, (127, 63))] {
            for radius in [0.3, 1.0, 4.0, 5.0, 13.0] {
                let sharp = lamp(width, height, at);
                let mut blurred = sharp.clone();
                background_blur(&mut blurred, radius);
                let change = sum(&blurred) / sum(&sharp) - 1.0;
                assert!(change.abs() < 1e-5, "{width} × {height}, {radius}: {change}");
            }
        }
    }

    #[test]
    fn a_lamp_becomes_an_even_disc_of_the_radius() {
        let mut blurred = lamp(65, 65, (32, 32));
        background_blur(&mut blurred, 3.5);
        // Spread evenly, its light is its brightness times the area.
        let lit = 1e6 / blurred.at(32, 32)[0];
        let area = std::f32::consts::PI * 3.5 * 3.5;
        assert!((lit / area - 1.0).abs() < 0.05, "{lit} pixels");
        assert!((blurred.at(32, 32)[0] / blurred.at(35, 32)[0] - 1.0).abs() < 1e-4);
        assert!(blurred.at(37, 32)[0] < 1.0);
    }

    #[test]
    fn the_radius_acts_without_steps() {
        // A spot keeps growing evenly across the radius from which discs are drawn smaller.
        let spread = |radius: f32| {
            let mut spot = lamp(64, 64, (31, 31)).map(|p| p.map(|v| v - 0.1));
            background_blur(&mut spot, radius);
            let second: f64 =
                (0..64 * 64).map(|i| ((i % 64) as f64 - 31.0).powi(2) * f64::from(spot.pixels[i][0])).sum();
            (second / sum(&spot)).sqrt()
        };
        let (before, after) = (spread(LARGEST_RADIUS - 0.01), spread(LARGEST_RADIUS + 0.01));
        assert!((after / before - 1.0).abs() < 0.1, "{before} then {after}");
    }

    #[test]
    fn hard_pictures_stay_finite() {
        for (width, height) in [(1, 1), (2, 1), (3, 7), (16, 16)] {
            for value in [f32::NAN, f32::INFINITY, 0.0, 1e6] {
                for radius in [0.01, 1.0, 40.0, f32::NAN, -1.0, 0.0] {
                    let mut picture = Image::filled(width, height, [0.5; 3]);
                    picture.pixels[0] = [value; 3];
                    let sharp = picture.clone();
                    background_blur(&mut picture, radius);
                    if radius > 0.0 {
                        assert!(picture.pixels.iter().flatten().all(|v| v.is_finite()));
                    } else if value.is_finite() {
                        assert_eq!(picture, sharp);
                    }
                }
            }
        }
        background_blur(&mut Image::filled(0, 0, [0.0; 3]), 3.0);
    }
}
