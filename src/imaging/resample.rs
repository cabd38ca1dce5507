//! Change of size with an area filter: every output pixel is the mean of what it covers, so the
//! mean of the picture is kept exactly.

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

/// For one axis: which source pixels each target pixel covers, and their shares (each list sums to 1).
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

/// Resizes by area: exact box coverage with fractional edges. Enlarging repeats pixels.
/// Average light only in linear values. Neither raster may be empty.
pub fn resize_area<T: Blend>(source: &Raster<T>, width: usize, height: usize) -> Raster<T> {
    if source.size() == (width, height) {
        return source.clone();
    }
    let columns = coverage(source.width, width);
    let rows = coverage(source.height, height);
    let narrow: Vec<T> = source
        .pixels
        .par_chunks(source.width)
        .flat_map_iter(|row| columns.iter().map(|c| blend(c, |x| row[x])))
        .collect();
    let pixels = (0..height)
        .into_par_iter()
        .flat_map_iter(|y| {
            let (rows, narrow) = (&rows, &narrow);
            (0..width).map(move |x| blend(&rows[y], |sy| narrow[sy * width + x]))
        })
        .collect();
    Raster {
        width,
        height,
        pixels,
    }
}

fn blend<T: Blend>(shares: &[(usize, f32)], pixel: impl Fn(usize) -> T) -> T {
    shares
        .iter()
        .fold(T::ZERO, |sum, &(i, share)| sum.add_scaled(pixel(i), share))
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
}
