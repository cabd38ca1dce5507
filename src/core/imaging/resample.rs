//! Area-filter resizing: every output pixel is the mean of the area that it covers, so the picture's mean is kept
//! exactly.

use super::raster::Raster;
use rayon::prelude::*;

/// A pixel that can be averaged.
pub trait Blend: Copy + Send + Sync {
    /// The additive identity.
    const ZERO: Self;
    /// `self + weight · other`.
    fn add_scaled(self, other: Self, weight: f32) -> Self;
}

impl Blend for f32 {
    const ZERO: Self = 0.0;
    fn add_scaled(self, other: Self, weight: f32) -> Self {
        self + weight * other
    }
}

impl Blend for [f32; 3] {
    const ZERO: Self = [0.0; 3];
    fn add_scaled(self, o: Self, w: f32) -> Self {
        [self[0] + w * o[0], self[1] + w * o[1], self[2] + w * o[2]]
    }
}

/// For one axis: the source pixels under each of `target` pixels, of which the first begins at `start` and each is `ratio`
/// source pixels wide, and their shares (each list sums to 1 within the source).
fn coverage(source: usize, target: usize, start: f64, ratio: f64) -> Vec<Vec<(usize, f32)>> {
    (0..target)
        .map(|t| {
            let (from, to) = (start + t as f64 * ratio, start + (t + 1) as f64 * ratio);
            let last = (to.ceil().max(0.0) as usize).min(source);
            ((from.floor().max(0.0) as usize)..last)
                .filter_map(|s| {
                    let share = (to.min(s as f64 + 1.0) - from.max(s as f64)) / ratio;
                    (share > 1e-9).then_some((s, share as f32))
                })
                .collect()
        })
        .collect()
}

/// For one axis, as [`coverage`]: the two source pixels whose centres enclose each target pixel's centre, and their shares.
/// Beyond the outer centres the outer pixel is repeated, beyond the source there is nothing.
fn interpolation(source: usize, target: usize, start: f64, ratio: f64) -> Vec<Vec<(usize, f32)>> {
    (0..target)
        .map(|t| {
            let centre = start + (t as f64 + 0.5) * ratio;
            if !(0.0..=source as f64).contains(&centre) {
                return Vec::new();
            }
            let at = (centre - 0.5).clamp(0.0, source as f64 - 1.0);
            let (before, share) = (at as usize, at.fract() as f32);
            let after = (before + 1).min(source - 1);
            vec![(before, 1.0 - share), (after, share)]
        })
        .collect()
}

/// Resizes by area: exact box coverage with fractional edges. Enlarging repeats pixels. Average light only in
/// linear values. Neither raster may be empty.
pub fn resize_area<T: Blend>(source: &Raster<T>, width: usize, height: usize) -> Raster<T> {
    if source.size() == (width, height) {
        return source.clone();
    }
    let along = |source, target| coverage(source, target, 0.0, source as f64 / target as f64);
    let (columns, rows) = (along(source.width, width), along(source.height, height));
    resampled(source, &columns, &rows)
}

/// Resizes by area when shrinking, and bilinearly when enlarging. Resize light only in linear values. Neither
/// raster may be empty.
pub fn resize<T: Blend>(source: &Raster<T>, width: usize, height: usize) -> Raster<T> {
    if source.size() == (width, height) {
        return source.clone();
    }
    let ratios = [source.width as f64 / width as f64, source.height as f64 / height as f64];
    resize_part(source, (width, height), [0.0; 2], ratios)
}

/// Resizes a part as [`resize`] does: the first of `size` pixels begins at column and row `start` of the source, and each is
/// `ratios` source pixels wide and high. Pixels beyond the source are 0.
pub fn resize_part<T: Blend>(source: &Raster<T>, size: (usize, usize), start: [f64; 2], ratios: [f64; 2]) -> Raster<T> {
    let along = |source, target, axis: usize| {
        let (start, ratio) = (start[axis], ratios[axis]);
        if ratio > 1.0 { coverage(source, target, start, ratio) } else { interpolation(source, target, start, ratio) }
    };
    resampled(source, &along(source.width, size.0, 0), &along(source.height, size.1, 1))
}

/// Applies each axis's shares to make the target's pixels.
fn resampled<T: Blend>(source: &Raster<T>, columns: &[Vec<(usize, f32)>], rows: &[Vec<(usize, f32)>]) -> Raster<T> {
    let (width, height) = (columns.len(), rows.len());
    let mut narrow = vec![T::ZERO; width * source.height];
    let lines = narrow.par_chunks_mut(width.max(1)).zip(source.pixels.par_chunks(source.width));
    lines.for_each(|(out, row)| {
        for (out, shares) in out.iter_mut().zip(columns) {
            for &(x, share) in shares {
                *out = out.add_scaled(row[x], share);
            }
        }
    });
    let mut pixels = vec![T::ZERO; width * height];
    pixels.par_chunks_mut(width.max(1)).zip(rows).for_each(|(out, shares)| {
        for &(y, share) in shares {
            let row = &narrow[y * width..][..width];
            for (out, pixel) in out.iter_mut().zip(row) {
                *out = out.add_scaled(*pixel, share);
            }
        }
    });
    Raster { width, height, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_mean_is_kept(w in 1usize..40, h in 1usize..40, tw in 1usize..50, th in 1usize..50, seed in 0u32..1000) {
            let source = Raster::from_fn(w, h, |x, y| ((x * 31 + y * 17 + seed as usize) % 97) as f32 / 97.0);
            let target = resize_area(&source, tw, th);
            let mean = |r: &Raster<f32>| r.pixels.iter().map(|&v| f64::from(v)).sum::<f64>() / r.pixels.len() as f64;
            prop_assert!((mean(&source) - mean(&target)).abs() < 1e-5);
        }
    }

    #[test]
    fn enlarging_goes_evenly_from_pixel_to_pixel_and_reducing_averages() {
        let ramp = Raster::from_fn(4, 1, |x, _| x as f32);
        let large = resize(&ramp, 8, 3);
        let row = [0.0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3.0];
        assert_eq!(large.pixels, row.repeat(3));
        assert_eq!(resize(&ramp, 2, 1).pixels, [0.5, 2.5]);
        assert_eq!(resize(&Raster::filled(1, 1, 7.0), 3, 2).pixels, [7.0; 6]);
    }

    #[test]
    fn a_part_begins_anywhere_and_is_black_beyond_the_source() {
        let ramp = Raster::from_fn(4, 1, |x, _| 1.0 + x as f32);
        let part = |start, ratio| resize_part(&ramp, (6, 1), [start, 0.0], [ratio, 1.0]).pixels;
        assert_eq!(part(-1.0, 1.0), [0.0, 1.0, 2.0, 3.0, 4.0, 0.0]);
        assert_eq!(part(1.0, 0.5), [2.0 - 0.25, 2.25, 2.75, 3.25, 3.75, 4.0]);
        assert_eq!(part(-1.0, 2.0), [0.5, 2.5, 2.0, 0.0, 0.0, 0.0]);
        assert_eq!(part(100.0, 1.0), [0.0; 6]);
    }
}
