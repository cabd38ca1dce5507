//! Gradients by weights and biases of large pictures.

use super::band::{Band, SCRATCH};
use super::chunks::arch;
use super::shape::{Shape, Sources};
use super::tile::{self, ROWS};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Gradients by weights and biases for large pictures: each weight is the correlation of an output's
/// gradient with a shifted input. Groups of bands are summed separately and then added in order, so that the
/// sums do not depend on the number of threads.
pub fn correlate(
    shape: &Shape,
    x: Sources,
    before: impl Fn(usize, usize, usize, &mut [f32]) + Sync,
) -> (Vec<f32>, Vec<f32>) {
    let rows = shape.band_rows();
    let bands: Vec<(usize, usize)> = (0..shape.batch)
        .flat_map(|picture| (0..shape.height).step_by(rows).map(move |from| (picture, from)))
        .collect();
    let columns = shape.columns();
    let groups = (shape.plane() / 4096).clamp(1, 16);
    let groups: Vec<_> = bands.chunks(bands.len().div_ceil(groups)).collect();
    // With fewer groups than threads, each group is divided by output channels.
    let parts = rayon::current_num_threads().div_ceil(groups.len());
    let part = shape.outputs.div_ceil(parts).next_multiple_of(ROWS);
    let length = shape.outputs * columns;
    let mut weights = vec![0.0; groups.len() * length];
    let mut biases = vec![0.0; groups.len() * shape.outputs];
    let tasks = weights.chunks_mut(length).zip(biases.chunks_mut(shape.outputs)).zip(&groups);
    let tasks = tasks.flat_map(|((weight, bias), bands)| {
        let shares = weight.chunks_mut(part * columns).zip(bias.chunks_mut(part));
        shares.enumerate().map(move |(p, (weight, bias))| (p * part, weight, bias, *bands))
    });
    let tasks: Vec<_> = tasks.collect();
    tasks.into_par_iter().for_each(|(first, weight, bias, bands)| {
        for &(picture, from) in bands {
            let band = Band::new(shape, from, rows.min(shape.height - from));
            let own = from..from + band.rows;
            let (mut left, mut right) = SCRATCH.take();
            band.fill(shape, bias.len(), &mut left, |c, y, into| {
                // Pixels around the band belong to other bands.
                if own.contains(&y) {
                    before(picture, first + c, y, into);
                } else {
                    into.fill(0.0);
                }
            });
            band.fill(shape, shape.inputs, &mut right, |c, y, into| {
                into.copy_from_slice(shape.input_row(x, picture, c, y));
            });
            arch().dispatch(Correlation {
                shape,
                band: &band,
                left: &left,
                right: &right,
                weight,
                bias,
            });
            SCRATCH.set((left, right));
        }
    });
    for group in 1..groups.len() {
        let (total, rest) = weights.split_at_mut(length);
        add(total, &rest[(group - 1) * length..][..length]);
        let (total, rest) = biases.split_at_mut(shape.outputs);
        add(total, &rest[(group - 1) * shape.outputs..][..shape.outputs]);
    }
    weights.truncate(length);
    biases.truncate(shape.outputs);
    (weights, biases)
}

pub fn add(into: &mut [f32], from: &[f32]) {
    for (into, from) in into.iter_mut().zip(from) {
        *into += from;
    }
}

/// Adds a band's share to the gradients by weights and biases.
struct Correlation<'a> {
    shape: &'a Shape,
    band: &'a Band,
    left: &'a [f32],
    right: &'a [f32],
    weight: &'a mut [f32],
    bias: &'a mut [f32],
}

impl WithSimd for Correlation<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (shape, band) = (self.shape, self.band);
        let columns = shape.columns();
        let length = band.positions().next_multiple_of(16);
        let place =
            |column: usize| column / shape.taps() * band.plane + band.taps[column % shape.taps()];
        // In the left factor the pixel itself comes after the border; between rows it is zero.
        let inner = shape.radius() * (band.stride + 1);
        for first in (0..self.bias.len()).step_by(ROWS) {
            let used = ROWS.min(self.bias.len() - first);
            let rows = core::array::from_fn(|r| (first + r.min(used - 1)) * band.plane + inner);
            for (r, row) in rows.into_iter().take(used).enumerate() {
                let sum: f32 = self.left[row..][..length]
                    .chunks_exact(16)
                    .fold([0.0f32; 16], |mut sums, chunk| {
                        for (sum, v) in sums.iter_mut().zip(chunk) {
                            *sum += v;
                        }
                        sums
                    })
                    .iter()
                    .sum();
                self.bias[first + r] += sum;
            }
            let mut block = Block {
                left: self.left,
                rows,
                right: self.right,
                length,
                columns,
                weight: &mut self.weight[first * columns..(first + used) * columns],
            };
            // Narrow vectors come with few registers.
            let whole = match S::F32_LANES {
                8 => block.add_tiles::<S, 3>(simd, 0, place),
                _ => block.add_tiles::<S, 6>(simd, 0, place),
            };
            block.add_tiles::<S, 1>(simd, whole, place);
        }
    }
}

/// A block of output channels.
struct Block<'a> {
    left: &'a [f32],
    rows: [usize; ROWS],
    right: &'a [f32],
    length: usize,
    columns: usize,
    /// `[channels, columns]`
    weight: &'a mut [f32],
}

impl Block<'_> {
    /// Adds to the columns from `column` on, `T` at a time, and returns the first remaining one; a
    /// column's input begins at `place(column)` of the right factor.
    #[inline(always)]
    fn add_tiles<S: Simd, const T: usize>(
        &mut self,
        simd: S,
        mut column: usize,
        place: impl Fn(usize) -> usize,
    ) -> usize {
        while column + T <= self.columns {
            let taps: [usize; T] = core::array::from_fn(|t| place(column + t));
            let sums = tile::correlation(simd, self.left, self.rows, self.right, taps, self.length);
            for (weight, sums) in self.weight.chunks_exact_mut(self.columns).zip(&sums) {
                add(&mut weight[column..][..T], sums);
            }
            column += T;
        }
        column
    }
}
