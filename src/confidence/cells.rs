//! What the network's encoder makes of a picture, cell by cell.

use base::error::Result;
use evaluation::metrics::Compared;
use footage::Frame;
use imaging::{Image, Mask, Raster};
use rayon::prelude::*;
use reflectance::Predictor;

/// Cells on each side of the square that the network sees.
pub const SIDE: usize = 16;
/// Coverage above which a cell shows the subject.
const COVERED: f32 = 0.5;

/// A picture as the network's encoder sees it: features for each of [`SIDE`] × [`SIDE`] cells, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Cells {
    /// Features of a cell.
    pub channels: usize,
    /// `[SIDE · SIDE, channels]`.
    values: Vec<f32>,
    /// Whether a cell shows the subject.
    covered: Vec<bool>,
}

impl Cells {
    /// The cells of a frame.
    ///
    /// # Errors
    /// When the device fails.
    pub fn of(predictor: &Predictor, frame: &Frame) -> Result<Self> {
        let found = predictor.features(frame, SIDE)?;
        // The finest features that have at least a value for each cell; a small network has fewer cells than that.
        let (side, channels) = (found.side, found.channels);
        let at = |x: usize| (x * side / SIDE, ((x + 1) * side).div_ceil(SIDE));
        let mut values = Vec::with_capacity(SIDE * SIDE * channels);
        for cell in 0..SIDE * SIDE {
            let (rows, columns) = (at(cell / SIDE), at(cell % SIDE));
            let count = ((rows.1 - rows.0) * (columns.1 - columns.0)) as f32;
            for channel in 0..channels {
                let plane = &found.values[channel * side * side..][..side * side];
                let sum: f32 = (rows.0..rows.1)
                    .map(|y| plane[y * side..][columns.0..columns.1].iter().sum::<f32>())
                    .sum();
                values.push(sum / count);
            }
        }
        Ok(Self {
            channels,
            values,
            covered: covered(&frame.mask),
        })
    }

    /// Features for tests.
    #[cfg(test)]
    pub(crate) fn from_values(channels: usize, values: Vec<f32>, covered: Vec<bool>) -> Self {
        Self {
            channels,
            values,
            covered,
        }
    }

    /// Numbers of the cells that show the subject, with their features.
    pub fn subject(&self) -> impl Iterator<Item = (usize, &[f32])> {
        let cells = self.values.chunks_exact(self.channels.max(1)).enumerate();
        cells.filter(|(cell, _)| self.covered[*cell])
    }

    /// How many cells show the subject.
    pub fn count(&self) -> usize {
        self.covered.iter().filter(|covered| **covered).count()
    }
}

/// Whether each cell shows the subject.
pub fn covered(mask: &Mask) -> Vec<bool> {
    let means = mean_of_cells(mask, |alpha| f64::from(*alpha));
    means
        .iter()
        .map(|mean| *mean > f64::from(COVERED))
        .collect()
}

/// The mean of a picture's values over each cell.
pub fn mean_of_cells<T: Copy>(picture: &Raster<T>, value: impl Fn(&T) -> f64) -> Vec<f64> {
    let (w, h) = picture.size();
    let (mut sums, mut counts) = (vec![0.0; SIDE * SIDE], vec![0usize; SIDE * SIDE]);
    for (i, pixel) in picture.pixels.iter().enumerate() {
        let cell = (i / w * SIDE / h) * SIDE + i % w * SIDE / w;
        sums[cell] += value(pixel);
        counts[cell] += 1;
    }
    let pairs = sums.into_iter().zip(counts);
    pairs
        .map(|(sum, count)| sum / count.max(1) as f64)
        .collect()
}

/// The frame as it is, and moved by half a cell to the right, down, and both: a pose is known wherever its cells begin.
pub fn moved(frame: &Frame) -> Vec<Frame> {
    let half = (frame.mask.width / (2 * SIDE)).max(1);
    let steps = [(0, 0), (half, 0), (0, half), (half, half)];
    let shifted = |by: &(usize, usize)| Frame {
        index: frame.index,
        plate: shifted(&frame.plate, *by, [0.0; 3]),
        mask: shifted(&frame.mask, *by, 0.0),
    };
    steps.par_iter().map(shifted).collect()
}

fn shifted<T: Copy>(picture: &Raster<T>, (dx, dy): (usize, usize), outside: T) -> Raster<T> {
    Raster::from_fn(picture.width, picture.height, |x, y| {
        match (x.checked_sub(dx), y.checked_sub(dy)) {
            (Some(x), Some(y)) => picture.at(x, y),
            _ => outside,
        }
    })
}

/// Squared differences of encoded values, clip(e·x, 0, 1)^(1/2.2), between pictures of one subject under each lamp.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Differences {
    /// Of each of [`SIDE`] × [`SIDE`] cells the mean over lamps and channels.
    pub cells: Vec<f64>,
    /// Of each lamp the mean over the subject and channels.
    pub lamps: Vec<f64>,
}

impl Differences {
    /// Compares pictures with others, one factor for all making the sums equal, at the exposure e at which `evaluate`
    /// compares. Pixels outside the matte count as equal.
    pub fn of(pictures: &[Image], others: &[Image], mask: &Mask) -> Self {
        let compared = Compared {
            pictures,
            truths: others,
            mask,
        };
        let exposure = compared.exposure();
        let sum = |images: &[Image]| -> f64 {
            let pixels = images.par_iter().map(|image| {
                let pairs = image.pixels.iter().zip(&mask.pixels);
                pairs
                    .map(|(p, alpha)| f64::from(alpha * p.iter().sum::<f32>()))
                    .sum::<f64>()
            });
            pixels.collect::<Vec<_>>().iter().sum()
        };
        let ratio = sum(others) / sum(pictures);
        let scale = if ratio.is_finite() && ratio > 0.0 {
            ratio
        } else {
            1.0
        };
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
        Self {
            cells: cells.collect(),
            lamps: (maps.iter())
                .map(|map| map.iter().sum::<f64>() / covered)
                .collect(),
        }
    }
}
