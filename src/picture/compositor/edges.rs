//! Edge extension: every partly covered pixel takes the colour of the solid subject next to it.

use imaging::{Image, Mask};
use rayon::prelude::*;

/// Coverage from which a pixel counts as pure subject, without its former background.
pub const SOLID: f32 = 0.98;

/// Gives every partly covered pixel the colour of the solid subject next to it, ring by ring, so that
/// the subject can be laid over any background: photographs on black are dark at the matte's edge, and a
/// network learns little there; either would show as a fringe. NaN and infinite pixels are filled
/// likewise. If no solid pixel can be reached the colour stays (NaN and infinite values become 0). Returns
/// the number of subject pixels that were NaN or infinite. Both rasters have the same size.
pub fn extend_edges(subject: &mut Image, mask: &Mask) -> usize {
    let finite = |pixel: &[f32; 3]| pixel.iter().all(|v| v.is_finite());
    let pairs = || subject.pixels.iter().zip(&mask.pixels);
    let lost = pairs().filter(|&(p, &a)| a > 0.0 && !finite(p)).count();
    let solid = |(p, &a): (&[f32; 3], &f32)| a >= SOLID && finite(p);
    let mut known: Vec<bool> = pairs().map(solid).collect();
    for ring in rings(known.clone(), mask) {
        // A ring reads only earlier rings: the result does not depend on the order within it.
        let colors: Vec<[f32; 3]> = ring
            .par_iter()
            .with_min_len(256)
            .map(|&i| {
                let (mut sum, mut count) = ([0f32; 3], 0f32);
                for n in neighbours(i, mask.size()).filter(|&n| known[n]) {
                    (0..3).for_each(|c| sum[c] += subject.pixels[n][c]);
                    count += 1.0;
                }
                sum.map(|s| s / count)
            })
            .collect();
        for (i, color) in ring.into_iter().zip(colors) {
            subject.pixels[i] = color;
            known[i] = true;
        }
    }
    for pixel in subject.pixels.iter_mut().filter(|pixel| !finite(pixel)) {
        *pixel = [0.0; 3];
    }
    lost
}

/// The pixels of a matte that are not `known`, in rings around the known ones: each pixel of a ring touches
/// a pixel of the ring before. Unreachable pixels are left out.
pub(super) fn rings(mut known: Vec<bool>, mask: &Mask) -> Vec<Vec<usize>> {
    let covered = |i: usize| mask.pixels[i] > 0.0;
    let mut ring: Vec<usize> =
        (0..known.len()).filter(|&i| !known[i] && covered(i) && neighbours(i, mask.size()).any(|n| known[n])).collect();
    let mut rings = Vec::new();
    while !ring.is_empty() {
        ring.iter().for_each(|&i| known[i] = true);
        let mut next: Vec<usize> =
            ring.iter().flat_map(|&i| neighbours(i, mask.size())).filter(|&n| !known[n] && covered(n)).collect();
        next.sort_unstable();
        next.dedup();
        rings.push(std::mem::replace(&mut ring, next));
    }
    rings
}

/// The pixel itself and its neighbours.
fn neighbours(i: usize, (width, height): (usize, usize)) -> impl Iterator<Item = usize> {
    let (x, y) = (i % width, i / width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    rows.flat_map(move |ny| (x.saturating_sub(1)..(x + 2).min(width)).map(move |nx| ny * width + nx))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::{relight, tests::noise_field};

    #[test]
    fn nan_and_infinity_stay_in_their_pixel_and_are_mended() {
        let mut field = noise_field(9, 9, 3);
        field.values[40] = f32::NAN;
        field.values[7] = f32::INFINITY;
        let weights = [[1.0; 3]; 3];
        let mut relit = relight(&field, &weights, &[0, 1, 2]);
        let bad =
            |image: &Image| (0..81).filter(|&i| image.pixels[i].iter().any(|v| !v.is_finite())).collect::<Vec<_>>();
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
        for (pixel, &alpha) in subject.pixels.iter().zip(&mask.pixels).filter(|&(_, &a)| a > 0.0) {
            let wanted = [0.8, 0.4, 0.2];
            assert!((0..3).all(|c| (pixel[c] / wanted[c] - 1.0).abs() < 0.03), "{alpha}: {pixel:?}");
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
}
