//! The passes on the CPU, and what the shaders are tested against.

pub use super::relight::{lit_lamps, relight, relight_compressed, relight_half};

use crate::imaging::{Encoded, Image, Mask, Raster, color::srgb_from_linear};
use rayon::prelude::*;

/// Coverage from which a pixel counts as the subject alone, with nothing of what was behind it.
pub const SOLID: f32 = 0.98;

/// Gives every partly covered pixel the colour of the solid subject next to it, ring by ring, so that
/// the subject can be laid over any background: photographs on black are dark at the matte's edge, a
/// network is taught little there, and either would show as a fringe. Pixels that are no numbers are
/// filled likewise. Where no solid pixel can be reached the colour stays (a value that is no number
/// becomes 0). Returns how many pixels of the subject were no numbers. Both rasters have one size.
pub fn extend_edges(subject: &mut Image, mask: &Mask) -> usize {
    let (width, height) = subject.size();
    let finite = |pixel: &[f32; 3]| pixel.iter().all(|v| v.is_finite());
    let mut known: Vec<bool> = subject
        .pixels
        .iter()
        .zip(&mask.pixels)
        .map(|(p, &a)| a >= SOLID && finite(p))
        .collect();
    let lost = subject
        .pixels
        .iter()
        .zip(&mask.pixels)
        .filter(|&(p, &a)| a > 0.0 && !finite(p))
        .count();
    let neighbours = |i: usize| {
        let (x, y) = (i % width, i / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(move |ny| {
            (x.saturating_sub(1)..(x + 2).min(width)).map(move |nx| ny * width + nx)
        })
    };
    let mut open: Vec<usize> = (0..known.len())
        .filter(|&i| !known[i] && mask.pixels[i] > 0.0)
        .collect();
    while !open.is_empty() {
        // A ring reads earlier rings alone: the result does not depend on the order within it.
        let ring: Vec<(usize, [f32; 3])> = open
            .par_iter()
            .with_min_len(256)
            .filter_map(|&i| {
                let (mut sum, mut count) = ([0f32; 3], 0f32);
                for n in neighbours(i).filter(|&n| known[n]) {
                    (0..3).for_each(|c| sum[c] += subject.pixels[n][c]);
                    count += 1.0;
                }
                (count > 0.0).then(|| (i, sum.map(|s| s / count)))
            })
            .collect();
        for &(i, color) in &ring {
            subject.pixels[i] = color;
            known[i] = true;
        }
        open = ring.iter().flat_map(|&(i, _)| neighbours(i)).collect();
        open.retain(|&n| !known[n] && mask.pixels[n] > 0.0);
        open.sort_unstable();
        open.dedup();
    }
    for pixel in subject.pixels.iter_mut().filter(|pixel| !finite(pixel)) {
        *pixel = [0.0; 3];
    }
    lost
}

/// Scales every value.
pub fn scale(picture: &mut Image, factor: f32) {
    picture
        .pixels
        .iter_mut()
        .flatten()
        .for_each(|v| *v *= factor);
}

/// Pass `view`: sRGB codes of linear light, clipped to `[0, 1]`.
pub fn view(linear: &Image) -> Encoded {
    let pixels = linear
        .pixels
        .par_iter()
        .with_min_len(4096)
        .map(|p| p.map(srgb_from_linear))
        .collect();
    Encoded(Raster {
        width: linear.width,
        height: linear.height,
        pixels,
    })
}

/// Pass `dither`: moves each code by less than half a step of 8 bits, by a fixed pattern (interleaved
/// gradient noise, Jimenez, SIGGRAPH 2014) that is the same in every frame, so that a film does not
/// boil. Only what shows through the matte is moved: the subject has grain enough of its own.
pub fn dither(picture: &mut Encoded, mask: &Mask) {
    let width = picture.0.width;
    for (i, (pixel, &alpha)) in picture.0.pixels.iter_mut().zip(&mask.pixels).enumerate() {
        let (x, y) = ((i % width) as f32, (i / width) as f32);
        let noise = (52.982_918 * (0.067_110_56 * x + 0.005_837_15 * y).fract()).fract() - 0.5;
        let step = noise * (1.0 - alpha) / 255.0;
        *pixel = pixel.map(|v| (v + step).clamp(0.0, 1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compositor::relight::tests::noise_field;

    #[test]
    fn a_value_that_is_no_number_stays_in_its_pixel_and_is_mended() {
        let mut field = noise_field(9, 9, 3);
        field.values[40] = f32::NAN;
        field.values[7] = f32::INFINITY;
        let weights = [[1.0; 3]; 3];
        let mut relit = relight(&field, &weights, &[0, 1, 2]);
        let bad = |image: &Image| {
            (0..81)
                .filter(|&i| image.pixels[i].iter().any(|v| !v.is_finite()))
                .collect::<Vec<_>>()
        };
        assert_eq!(bad(&relit), [7, 40]);
        assert_eq!(extend_edges(&mut relit, &Mask::filled(9, 9, 1.0)), 2);
        assert!(bad(&relit).is_empty());
    }

    #[test]
    fn the_edge_takes_the_colour_of_the_solid_subject() {
        // A wedge of coverage; the picture is dark where coverage is partial, as if shot on black.
        let mask = Mask::from_fn(40, 5, |x, _| (1.5 - x as f32 / 20.0).clamp(0.0, 1.0));
        let mut subject = mask.map(|a| [0.8 * a, 0.4 * a, 0.2 * a]);
        extend_edges(&mut subject, &mask);
        for (pixel, &alpha) in subject
            .pixels
            .iter()
            .zip(&mask.pixels)
            .filter(|&(_, &a)| a > 0.0)
        {
            let wanted = [0.8, 0.4, 0.2];
            assert!(
                (0..3).all(|c| (pixel[c] / wanted[c] - 1.0).abs() < 0.03),
                "{alpha}: {pixel:?}"
            );
        }
    }

    #[test]
    fn a_matte_without_solid_pixels_leaves_the_picture() {
        let mut subject = Image::filled(3, 1, [0.25; 3]);
        subject.pixels[1] = [f32::NAN; 3];
        extend_edges(&mut subject, &Mask::filled(3, 1, 0.5));
        assert_eq!(subject.pixels, [[0.25; 3], [0.0; 3], [0.25; 3]]);
        extend_edges(&mut subject, &Mask::filled(3, 1, 0.0));
    }

    #[test]
    fn dither_moves_no_code_by_half_a_step_and_keeps_the_mean() {
        let flat = Encoded(Image::filled(64, 64, [0.4; 3]));
        let mut moved = flat.clone();
        dither(&mut moved, &Mask::filled(64, 64, 0.0));
        let steps: Vec<f32> = moved
            .0
            .pixels
            .iter()
            .map(|p| (p[0] - 0.4) * 255.0)
            .collect();
        assert!(steps.iter().all(|s| s.abs() < 0.501));
        assert!((steps.iter().sum::<f32>() / 4096.0).abs() < 0.01);
        let mut kept = flat.clone();
        dither(&mut kept, &Mask::filled(64, 64, 1.0));
        assert_eq!(kept, flat);
    }
}
