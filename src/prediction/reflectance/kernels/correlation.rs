//! Gradients by weights and biases of large pictures.

use super::band::{Band, SCRATCH};
use super::chunks::{arch, vectorized};
use super::shape::{Shape, Sources};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Outputs side by side in the turned gradient, so that a vector holds the sums of several.
const NARROW: usize = 16;
/// The same where it pads no more.
const WIDE: usize = 2 * NARROW;
/// Rows of the gradient that are turned at once.
const SIDE: usize = 8;

/// Sums of some input channels over some bands, for one task.
struct Share<'a> {
    /// Picture and first row of each band.
    bands: &'a [(usize, usize)],
    /// First input channel.
    first: usize,
    /// `[blocks, columns, lanes]`
    weight: &'a mut [f32],
    /// None while another task adds them.
    bias: Option<&'a mut [f32]>,
}

/// Gradients by weights and biases for large pictures: each weight is the correlation of an output's
/// gradient with a shifted input. Groups of bands are summed separately and then added in order, so that the
/// sums do not depend on the number of threads.
pub fn correlate(
    shape: &Shape,
    x: Sources,
    before: impl Fn(usize, usize, usize, &mut [f32]) + Sync,
) -> (Vec<f32>, Vec<f32>) {
    let rows = shape.band_rows();
    let bands: Vec<(usize, usize)> =
        (0..shape.batch).flat_map(|picture| (0..shape.height).step_by(rows).map(move |from| (picture, from))).collect();
    let columns = shape.columns();
    let groups = (shape.plane() / 4096).clamp(1, 16);
    let groups: Vec<_> = bands.chunks(bands.len().div_ceil(groups)).collect();
    let [narrow, wide] = [NARROW, WIDE].map(|lanes| shape.outputs.next_multiple_of(lanes));
    let (lanes, outputs) = if narrow < wide { (NARROW, narrow) } else { (WIDE, wide) };
    // With fewer groups than threads, each group is divided by input channels.
    let parts = rayon::current_num_threads().div_ceil(groups.len());
    let part = shape.inputs.div_ceil(parts);
    let part_length = part * shape.taps() * outputs;
    let mut weights = vec![0.0; groups.len() * columns * outputs];
    let mut biases = vec![0.0; groups.len() * outputs];
    let sums = weights.chunks_mut(columns * outputs).zip(biases.chunks_mut(outputs));
    let shares: Vec<Share> = sums
        .zip(&groups)
        .flat_map(|((weight, bias), bands)| {
            let mut bias = Some(bias);
            let own = weight.chunks_mut(part_length).enumerate();
            own.map(move |(p, weight)| Share { bands, first: p * part, weight, bias: bias.take() })
        })
        .collect();
    shares.into_par_iter().for_each(|Share { bands, first, weight, bias }| {
        let channels = weight.len() / (shape.taps() * outputs);
        let mut ignored = vec![0.0; outputs];
        let bias = bias.unwrap_or(&mut ignored);
        let mut lines = vec![0.0; lanes * shape.width];
        for &(picture, from) in bands {
            let band = Band::new(shape, from, rows.min(shape.height - from));
            let (mut input, mut gradient) = SCRATCH.take();
            band.fill(shape, channels, &mut input, |c, y, into| {
                into.copy_from_slice(shape.input_row(x, picture, first + c, y));
            });
            gradient.resize(outputs * band.rows * shape.width, 0.0);
            let blocks = gradient.chunks_exact_mut(lanes * band.rows * shape.width);
            for (block, (gradient, bias)) in blocks.zip(bias.chunks_mut(lanes)).enumerate() {
                let used = lanes.min(shape.outputs - block * lanes);
                lines[used * shape.width..].fill(0.0);
                for (y, into) in gradient.chunks_exact_mut(lanes * shape.width).enumerate() {
                    for (c, line) in lines.chunks_exact_mut(shape.width).take(used).enumerate() {
                        before(picture, block * lanes + c, from + y, line);
                    }
                    turn(&lines, shape.width, into, bias);
                }
            }
            arch().dispatch(Correlation {
                shape,
                band: &band,
                input: &input,
                gradient: &gradient,
                lanes,
                outputs,
                weight,
            });
            SCRATCH.set((input, gradient));
        }
    });
    let mut weight = vec![0.0; shape.outputs * columns];
    weight.par_chunks_mut(NARROW * columns).enumerate().for_each(|(tile, weight)| {
        let (block, lane) = (tile * NARROW / lanes, tile * NARROW % lanes);
        for group in weights.chunks_exact(columns * outputs) {
            let parts = group.chunks(part_length).flat_map(|part| {
                let block_length = part.len() / outputs * lanes;
                part[block * block_length..][..block_length].chunks_exact(lanes)
            });
            for (column, sums) in parts.enumerate() {
                for (weight, sum) in weight.chunks_exact_mut(columns).zip(&sums[lane..]) {
                    weight[column] += sum;
                }
            }
        }
    });
    let mut bias = vec![0.0; shape.outputs];
    for group in biases.chunks_exact(outputs) {
        add(&mut bias, group);
    }
    (weight, bias)
}

#[inline(always)]
pub fn add(into: &mut [f32], from: &[f32]) {
    for (into, from) in into.iter_mut().zip(from) {
        *into += from;
    }
}

/// Rows `[lanes, width]` → `into`, `[width, lanes]`; adds each row's sum to `bias`.
fn turn(rows: &[f32], width: usize, into: &mut [f32], bias: &mut [f32]) {
    vectorized(
        #[inline(always)]
        || {
            for (bias, row) in bias.iter_mut().zip(rows.chunks_exact(width)) {
                let (chunks, rest) = row.as_chunks::<16>();
                let mut sums = [0.0f32; 16];
                for chunk in chunks {
                    add(&mut sums, chunk);
                }
                *bias += sums.iter().chain(rest).sum::<f32>();
            }
            let lanes = rows.len() / width;
            for (block, rows) in rows.chunks_exact(SIDE * width).enumerate() {
                let rows: [&[f32]; SIDE] = core::array::from_fn(|r| &rows[r * width..][..width]);
                for (x, into) in into.chunks_exact_mut(lanes).enumerate() {
                    let into: &mut [f32; SIDE] =
                        into[block * SIDE..].first_chunk_mut().expect("lanes are a multiple of it");
                    *into = rows.map(|row| row[x]);
                }
            }
        },
    );
}

/// Adds a band's share to the gradient by weights.
struct Correlation<'a> {
    shape: &'a Shape,
    band: &'a Band,
    /// The input's band, for the channels of `weight`.
    input: &'a [f32],
    /// `[blocks, pixels, lanes]`
    gradient: &'a [f32],
    lanes: usize,
    /// Blocks times lanes.
    outputs: usize,
    /// `[blocks, columns, lanes]`
    weight: &'a mut [f32],
}

impl WithSimd for Correlation<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        // Sums and gradients fit the registers: 32, or 16 with AVX2.
        match (S::F32_LANES, self.lanes, self.shape.kernel) {
            (16, NARROW, 3) => self.add::<S, 1, 6, 3>(simd),
            (16, NARROW, 7) => self.add::<S, 1, 2, 7>(simd),
            (16, _, 7) => self.add::<S, 2, 1, 7>(simd),
            (8, _, 3) => self.add::<S, 2, 2, 3>(simd),
            (_, _, 3) => self.add::<S, 2, 3, 3>(simd),
            (_, _, 7) => self.add::<S, 1, 1, 7>(simd),
            _ => self.add::<S, 1, 8, 1>(simd),
        }
    }
}

impl Correlation<'_> {
    /// Tiles of `N` rows of `K` taps each × `V` vectors of outputs.
    #[inline(always)]
    fn add<S: Simd, const V: usize, const N: usize, const K: usize>(&mut self, simd: S) {
        let lanes = self.lanes;
        let columns = self.weight.len() / self.outputs;
        let pixels = self.band.rows * self.shape.width;
        for column in (0..columns).step_by(N * K) {
            let used = N.min((columns - column) / K);
            let places = core::array::from_fn(|n| self.place(column + K * n.min(used - 1)));
            let weights = self.weight.chunks_exact_mut(columns * lanes);
            for (weight, gradient) in weights.zip(self.gradient.chunks_exact(pixels * lanes)) {
                for lane in (0..lanes).step_by(V * S::F32_LANES) {
                    let tile = Tile::<N> {
                        input: self.input,
                        places,
                        stride: self.band.stride,
                        width: self.shape.width,
                        gradient,
                        lanes,
                        lane,
                    };
                    let sums = tile.sums::<S, V, K>(simd);
                    let weight = weight[column * lanes..].chunks_exact_mut(lanes);
                    for (weight, sums) in weight.zip(sums.as_flattened()).take(used * K) {
                        let (weight, _) = S::as_mut_simd_f32s(&mut weight[lane..]);
                        for (weight, sum) in weight.iter_mut().zip(sums) {
                            *weight = simd.add_f32s(*weight, *sum);
                        }
                    }
                }
            }
        }
    }

    /// Start of a column's input in the band.
    fn place(&self, column: usize) -> usize {
        let taps = self.shape.taps();
        column / taps * self.band.plane + self.band.taps[column % taps]
    }
}

/// Sums of `N` rows of taps and some outputs over a band.
struct Tile<'a, const N: usize> {
    input: &'a [f32],
    places: [usize; N],
    stride: usize,
    width: usize,
    /// `[pixels, lanes]`
    gradient: &'a [f32],
    lanes: usize,
    lane: usize,
}

impl<const N: usize> Tile<'_, N> {
    #[inline(always)]
    fn sums<S: Simd, const V: usize, const K: usize>(&self, simd: S) -> [[[S::f32s; V]; K]; N] {
        let mut sums = [[[simd.splat_f32s(0.0); V]; K]; N];
        for (y, gradient) in self.gradient.chunks_exact(self.width * self.lanes).enumerate() {
            let rows = self.places.map(|place| &self.input[place + y * self.stride..][..self.width + K - 1]);
            for (x, gradient) in gradient.chunks_exact(self.lanes).enumerate() {
                let (gradient, _) = S::as_simd_f32s(&gradient[self.lane..]);
                let gradient: [S::f32s; V] = *gradient.first_chunk().expect("V vectors in the lanes");
                for (sums, row) in sums.iter_mut().zip(rows) {
                    let taps: &[f32; K] = row[x..].first_chunk().expect("taps of a pixel");
                    for (sums, input) in sums.iter_mut().zip(taps) {
                        let input = simd.splat_f32s(*input);
                        for (sum, gradient) in sums.iter_mut().zip(gradient) {
                            *sum = simd.mul_add_e_f32s(input, gradient, *sum);
                        }
                    }
                }
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::chunks::tests::{dot, every_arch, noise};

    #[test]
    fn sums_are_right_at_any_width_of_vectors() {
        for (kernel, lanes, outputs) in [(1, 16, 48), (3, 16, 16), (3, 32, 64), (5, 32, 32), (7, 16, 16), (7, 32, 32)] {
            let shape = Shape { batch: 1, inputs: 3, outputs, height: 5, width: 9, kernel, bf16: false };
            let band = Band::new(&shape, 1, 3);
            let mut input = Vec::new();
            let x = noise(3 * 5 * 9, 1);
            band.fill(&shape, 3, &mut input, |c, y, into| {
                into.copy_from_slice(shape.row(&x, 3, 0, c, y));
            });
            let pixels = band.rows * shape.width;
            let gradient = noise(outputs * pixels, 2);
            for arch in every_arch() {
                let mut weight = vec![1.0; shape.columns() * outputs];
                arch.dispatch(Correlation {
                    shape: &shape,
                    band: &band,
                    input: &input,
                    gradient: &gradient,
                    lanes,
                    outputs,
                    weight: &mut weight,
                });
                for (i, found) in weight.iter().enumerate() {
                    let (block, column) = (i / lanes / shape.columns(), i / lanes % shape.columns());
                    let start = column / shape.taps() * band.plane + band.taps[column % shape.taps()];
                    let own = &gradient[block * lanes * pixels + i % lanes..];
                    let own: Vec<f32> = own.iter().step_by(lanes).take(pixels).copied().collect();
                    let near = (0..band.rows).flat_map(|y| &input[start + y * band.stride..][..shape.width]);
                    let near: Vec<f32> = near.copied().collect();
                    let wanted = 1.0 + dot(&own, &near);
                    assert!((f64::from(*found) - wanted).abs() < 1e-5, "{arch:?} {shape:?} {i}: {found}, not {wanted}");
                }
            }
        }
    }
}
