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

/// For one axis: the source pixels under each target pixel, and their shares (each list sums to 1).
fn coverage(source: usize, target: usize) -> Vec<Vec<(usize, f32)>> {
    let ratio = source as f64 / target as f64;
    (0..target)
        .map(|t| {
            let (from, to) = (t as f64 * ratio, (t + 1) as f64 * ratio);
            let last = (to.ceil() as usize).min(source);
            ((from.floor() as usize)..last)
                .filter_map(|s| {
                    let share = (to.min(s as f64 + 1.0) - from.max(s as f64)) / ratio;
                    (share > 1e-9).then_some((s, share as f32))
                })
                .collect()
        })
        .collect()
}

/// For one axis: the two source pixels whose centres enclose each target pixel's centre, and their shares. Beyond
/// the outer centres the outer pixel is repeated.
fn interpolation(source: usize, target: usize) -> Vec<Vec<(usize, f32)>> {
    let ratio = source as f64 / target as f64;
    (0..target)
        .map(|t| {
            let at = ((t as f64 + 0.5) * ratio - 0.5).clamp(0.0, source as f64 - 1.0);
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
    let columns = coverage(source.width, width);
    let rows = coverage(source.height, height);
    resampled(source, &columns, &rows)
}

/// Resizes by area when shrinking, and bilinearly when enlarging. Resize light only in linear values. Neither
/// raster may be empty.
pub fn resize<T: Blend>(source: &Raster<T>, width: usize, height: usize) -> Raster<T> {
    if source.size() == (width, height) {
        return source.clone();
    }
    let along = |source: usize, target: usize| {
        if target < source { coverage(source, target) } else { interpolation(source, target) }
    };
    let columns = along(source.width, width);
    let rows = along(source.height, height);
    resampled(source, &columns, &rows)
}

/// Applies each axis's shares to make the target's pixels.
fn resampled<T: Blend>(
    source: &Raster<T>,
    columns: &[Vec<(usize, f32)>],
    rows: &[Vec<(usize, f32)>],
) -> Raster<T> {
    let (width, height) = (columns.len(), rows.len());
    let narrow: Vec<T> = source
        .pixels
        .par_chunks(source.width)
        .flat_map_iter(|row| columns.iter().map(|c| blend(c, |x| row[x])))
        .collect();
    let pixels = (0..height)
        .into_par_iter()
        .flat_map_iter(|y| {
            let narrow = &narrow;
            (0..width).map(move |x| blend(&rows[y], |sy| narrow[sy * width + x]))
        })
        .collect();
    Raster { width, height, pixels }
}

fn blend<T: Blend>(shares: &[(usize, f32)], pixel: impl Fn(usize) -> T) -> T {
    shares.iter().fold(T::ZERO, |sum, &(i, share)| sum.add_scaled(pixel(i), share))
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
}
