//! Cell-by-cell comparison of pictures.

use evaluation::metrics::Compared;
use imaging::{Image, Mask, Raster};
use rayon::prelude::*;

/// Cells along each side of the predicted square.
pub const SIDE: usize = 16;
/// Coverage above which a cell shows the subject.
const COVERED: f32 = 0.5;

/// True for each cell that shows the subject.
pub fn covered(mask: &Mask) -> Vec<bool> {
    let means = mean_of_cells(mask, |alpha| f64::from(*alpha));
    means.iter().map(|mean| *mean > f64::from(COVERED)).collect()
}

/// Mean of a picture's values over each cell.
pub fn mean_of_cells<T: Copy>(picture: &Raster<T>, value: impl Fn(&T) -> f64) -> Vec<f64> {
    let (w, h) = picture.size();
    let (mut sums, mut counts) = (vec![0.0; SIDE * SIDE], vec![0usize; SIDE * SIDE]);
    for (i, pixel) in picture.pixels.iter().enumerate() {
        let cell = (i / w * SIDE / h) * SIDE + i % w * SIDE / w;
        sums[cell] += value(pixel);
        counts[cell] += 1;
    }
    let pairs = sums.into_iter().zip(counts);
    pairs.map(|(sum, count)| sum / count.max(1) as f64).collect()
}

/// Squared differences of encoded values, clip(e·x, 0, 1)^(1/2.2), between pictures of one subject under each lamp.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Differences {
    /// Mean over lamps and channels, for each of [`SIDE`] × [`SIDE`] cells.
    pub cells: Vec<f64>,
    /// Mean over the subject and channels, for each lamp.
    pub lamps: Vec<f64>,
}

impl Differences {
    /// Compares pictures with their references at the exposure e that `evaluate` uses, after one common factor has made
    /// the sums equal. Pixels outside the matte count as equal.
    pub fn new(pictures: &[Image], others: &[Image], mask: &Mask) -> Self {
        let compared = Compared { pictures, truths: others, mask };
        let exposure = compared.exposure();
        let sum = |images: &[Image]| -> f64 {
            let pixels = images.par_iter().map(|image| {
                let pairs = image.pixels.iter().zip(&mask.pixels);
                pairs.map(|(p, alpha)| f64::from(alpha * p.iter().sum::<f32>())).sum::<f64>()
            });
            pixels.collect::<Vec<_>>().iter().sum()
        };
        let ratio = sum(others) / sum(pictures);
        let scale = if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 };
        let code = |v: f64| (exposure * v).clamp(0.0, 1.0).powf(1.0 / 2.2);
        let alpha = mean_of_cells(mask, |alpha| f64::from(*alpha));
        let covered = alpha.iter().sum::<f64>().max(1e-6);
        let maps = pictures.par_iter().zip(others).map(|(picture, other)| {
            let errors = Raster::from_fn(mask.width, mask.height, |x, y| {
                let (p, t) = (picture.at(x, y), other.at(x, y));
                let off = |c: usize| code(scale * f64::from(p[c])) - code(f64::from(t[c]));
                let square = (0..3).map(|c| off(c).powi(2)).sum::<f64>() / 3.0;
                f64::from(mask.at(x, y)) * if square.is_finite() { square } else { 1.0 }
            });
            mean_of_cells(&errors, |square| *square)
        });
        let maps: Vec<Vec<f64>> = maps.collect();
        let count = maps.len().max(1) as f64;
        let cells = alpha.iter().enumerate().map(|(cell, alpha)| {
            let sum: f64 = maps.iter().map(|map| map[cell]).sum();
            sum / count / alpha.max(1e-6)
        });
        Self { cells: cells.collect(), lamps: (maps.iter()).map(|map| map.iter().sum::<f64>() / covered).collect() }
    }
}
