//! Separable filters over planes, with repeated edges.

use imaging::Raster;
use rayon::prelude::*;

/// One dimension of a filter: an odd number of weights, centred on the pixel. Not mirrored: the first weight belongs to
/// the leftmost or topmost neighbour.
pub struct Kernel(Vec<f32>);

impl Kernel {
    /// Weights at offsets −`radius` to `radius`.
    pub fn new(radius: usize, weight: impl Fn(f64) -> f64) -> Self {
        let places = (0..=2 * radius).map(|i| i as f64 - radius as f64);
        Self(places.map(|x| weight(x) as f32).collect())
    }

    /// [`Self::new`], scaled so that the positive weights add up to 1 and the negative ones to −1.
    pub fn normalized(radius: usize, weight: impl Fn(f64) -> f64) -> Self {
        let sum = |sign: f64| -> f64 {
            let places = (0..=2 * radius).map(|i| weight(i as f64 - radius as f64));
            places.map(|w| (sign * w).max(0.0)).sum()
        };
        let (positive, negative) = (sum(1.0), sum(-1.0));
        Self::new(radius, |x| {
            let w = weight(x);
            let all = if w > 0.0 { positive } else { negative };
            if w == 0.0 { 0.0 } else { w / all }
        })
    }

    /// Gaussian of a standard deviation in pixels, with weights that sum to 1.
    pub fn gaussian(radius: usize, deviation: f64) -> Self {
        Self::normalized(radius, |x| (-0.5 * (x / deviation).powi(2)).exp())
    }

    fn radius(&self) -> usize {
        self.0.len() / 2
    }
}

/// Filters the plane along rows by `across`, then along columns by `down`.
pub fn filtered(plane: &Raster<f32>, across: &Kernel, down: &Kernel) -> Raster<f32> {
    let (width, height) = plane.size();
    let mut rows = Raster::filled(width, height, 0.0);
    if plane.pixels.is_empty() {
        return rows;
    }
    let edge = across.radius();
    let row = |(out, line): (&mut [f32], &[f32])| {
        let last = width - 1;
        let padded: Vec<f32> = (0..width + 2 * edge).map(|x| line[x.saturating_sub(edge).min(last)]).collect();
        for (x, value) in out.iter_mut().enumerate() {
            let window = padded[x..].iter().zip(&across.0);
            *value = window.map(|(v, w)| v * w).sum();
        }
    };
    let lines = plane.pixels.par_chunks(width);
    (rows.pixels.par_chunks_mut(width).zip(lines)).for_each(row);
    let mut both = Raster::filled(width, height, 0.0);
    let column = |(y, out): (usize, &mut [f32])| {
        for (i, &weight) in down.0.iter().enumerate() {
            let from = (y + i).saturating_sub(down.radius()).min(height - 1);
            let line = &rows.pixels[from * width..][..width];
            for (value, v) in out.iter_mut().zip(line) {
                *value += weight * v;
            }
        }
    };
    (both.pixels.par_chunks_mut(width).enumerate()).for_each(column);
    both
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_fall_where_they_belong_and_edges_repeat() {
        // A point right of and below the middle, with a kernel that looks one pixel left and one up.
        let point = Raster::from_fn(5, 4, |x, y| if (x, y) == (3, 2) { 1.0 } else { 0.0 });
        let before = Kernel::new(1, |x| if x < 0.0 { 2.0 } else { 0.0 });
        let found = filtered(&point, &before, &before);
        assert_eq!(found.at(4, 3), 4.0);
        assert_eq!(found.pixels.iter().sum::<f32>(), 4.0);
        let even = Raster::filled(7, 3, 0.3);
        let blurred = filtered(&even, &Kernel::gaussian(9, 3.0), &Kernel::gaussian(9, 3.0));
        assert!(blurred.pixels.iter().all(|v| (v - 0.3).abs() < 1e-6));
    }

    #[test]
    fn a_derivative_is_normalised_on_either_side() {
        let Kernel(weights) = Kernel::normalized(4, |x| -x * (-0.1 * x * x).exp());
        let sum = |sign: f32| weights.iter().map(|w| (sign * w).max(0.0)).sum::<f32>();
        assert!((sum(1.0) - 1.0).abs() < 1e-6 && (sum(-1.0) - 1.0).abs() < 1e-6);
        assert_eq!(weights[4], 0.0);
        assert!(weights[3] > 0.0 && weights[5] < 0.0);
    }
}
