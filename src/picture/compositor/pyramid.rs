//! Halving and doubling of pictures, for cheap wide blurs: the bilinear ×2 with
//! half-pixel centres and its transpose, so that a flat picture stays flat and a point becomes a round
//! spot at any position. Pictures are mirrored at their edges.

use imaging::{Image, Raster};
use rayon::prelude::*;

/// Four values per pixel, as on the GPU: linear RGB and coverage or a weight.
pub type Rgba = Raster<[f32; 4]>;

/// Pixels of a picture with a fourth value, both from `pixel`. NaN and infinite values
/// become 0: a blur would spread them everywhere.
pub fn rgba(image: &Image, pixel: impl Fn(usize, [f32; 3]) -> [f32; 4] + Sync) -> Rgba {
    let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
    let pixels = image.pixels.par_iter().enumerate().with_min_len(4096);
    Rgba {
        width: image.width,
        height: image.height,
        pixels: pixels.map(|(i, p)| pixel(i, p.map(finite)).map(finite)).collect(),
    }
}

/// Half the size, rounded up: ¼, ¾, ¾, ¼ along each axis. Every pixel of the result is a mean.
pub fn halve(fine: &Rgba) -> Rgba {
    let (width, height) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
    let columns: Vec<_> = (0..width).map(|x| taps(x, fine.width)).collect();
    let mut pixels = vec![[0f32; 4]; width * height];
    let rows = pixels.par_chunks_mut(width.max(1)).enumerate();
    rows.with_min_len(8).for_each(|(y, out)| {
        for (row, down) in taps(y, fine.height) {
            let row = &fine.pixels[row * fine.width..][..fine.width];
            for (out, columns) in out.iter_mut().zip(&columns) {
                for &(x, across) in columns {
                    add(out, row[x], down * across);
                }
            }
        }
    });
    Rgba { width, height, pixels }
}

/// The fine pixels averaged by a coarse one, along one axis of `n` fine pixels, and their
/// weights, whose sum is 1.
fn taps(coarse: usize, n: usize) -> [(usize, f32); 4] {
    let at = 2 * coarse;
    let before = at.saturating_sub(1);
    if at + 1 == n {
        // An odd row ends on half a pair.
        return [(before, 0.25), (at, 0.75), (at, 0.0), (at, 0.0)];
    }
    let after = (at + 2).min(n - 1);
    [(before, 0.125), (at, 0.375), (at + 1, 0.375), (after, 0.125)]
}

/// Bilinear doubling of `coarse`, the halved size of `fine`: `fine` · `keep` + doubled.
pub fn double_onto(coarse: &Rgba, fine: &mut Rgba, keep: f32) {
    let width = fine.width;
    let rows = fine.pixels.par_chunks_mut(width.max(1)).enumerate();
    rows.with_min_len(8).for_each(|(y, out)| {
        let row = |y: usize| &coarse.pixels[y * coarse.width..][..coarse.width];
        let near = row(y / 2);
        let far = row(neighbour(y, coarse.height));
        let mixed: Vec<[f32; 4]> = near.iter().zip(far).map(|(&n, &f)| mix(n, f)).collect();
        for (x, out) in out.iter_mut().enumerate() {
            let doubled = mix(mixed[x / 2], mixed[neighbour(x, coarse.width)]);
            *out = std::array::from_fn(|c| keep * out[c] + doubled[c]);
        }
    });
}

/// The coarse pixel that a fine one takes a quarter of, along one axis of `n` coarse ones.
fn neighbour(fine: usize, n: usize) -> usize {
    if fine.is_multiple_of(2) { (fine / 2).saturating_sub(1) } else { (fine / 2 + 1).min(n - 1) }
}

#[inline(always)]
fn mix(near: [f32; 4], far: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|c| 0.75 * near[c] + 0.25 * far[c])
}

#[inline(always)]
pub(super) fn add(sum: &mut [f32; 4], value: [f32; 4], weight: f32) {
    (0..4).for_each(|c| sum[c] += weight * value[c]);
}

/// Index of the pixel at `i` in a row of `n` that is mirrored on both sides.
pub fn mirrored(i: isize, n: usize) -> usize {
    let at = i.rem_euclid(2 * n as isize) as usize;
    at.min(2 * n - 1 - at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_flat_picture_stays_flat(w in 1usize..40, h in 1usize..40) {
            let flat = Rgba::filled(w, h, [0.5, 1.0, 2.0, 1.0]);
            let half = halve(&flat);
            prop_assert_eq!(half.size(), (w.div_ceil(2), h.div_ceil(2)));
            let mut back = Rgba::filled(w, h, [f32::MAX; 4]);
            double_onto(&half, &mut back, 0.0);
            for (a, b) in back.pixels.iter().flatten().zip(flat.pixels.iter().flatten()) {
                prop_assert!((a - b).abs() < 1e-6);
            }
        }

        #[test]
        fn a_mirror_of_a_mirror_is_the_row_again(i in -1000isize..1000, n in 1usize..50) {
            prop_assert!(mirrored(i, n) < n);
            prop_assert_eq!(mirrored(i, n), mirrored(-1 - i, n));
            prop_assert_eq!(mirrored(i, n), mirrored(i + 2 * n as isize, n));
        }
    }
}
