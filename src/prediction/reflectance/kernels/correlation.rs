//! Gradients by weights and biases of large pictures.

use super::band::{Band, SCRATCH};
use super::chunks::{arch, vectorized};
use super::shape::{Shape, Sources};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Output channels side by side in the transposed gradient, so that sums of several outputs share a vector: few …
const NARROW: usize = 16;
/// … and many.
const WIDE: usize = 32;
/// Rows of the gradient that are transposed at once.
const SIDE: usize = 8;

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
    let lanes = if shape.outputs <= NARROW { NARROW } else { WIDE };
    let padded = shape.outputs.next_multiple_of(lanes);
    // With fewer groups than threads, each group is divided by output channels.
    let parts = rayon::current_num_threads().div_ceil(groups.len());
    let part = padded.div_ceil(parts).next_multiple_of(lanes);
    let mut weights = vec![0.0; groups.len() * padded * columns];
    let mut biases = vec![0.0; groups.len() * padded];
    let tasks = weights.chunks_mut(padded * columns).zip(biases.chunks_mut(padded)).zip(&groups);
    let tasks = tasks.flat_map(|((weight, bias), bands)| {
        let shares = weight.chunks_mut(part * columns).zip(bias.chunks_mut(part));
        shares.enumerate().map(move |(p, (weight, bias))| (p * part, weight, bias, *bands))
    });
    let tasks: Vec<_> = tasks.collect();
    tasks.into_par_iter().for_each(|(first, weight, bias, bands)| {
        let mut lines = vec![0.0; lanes * shape.width];
        for &(picture, from) in bands {
            let band = Band::new(shape, from, rows.min(shape.height - from));
            let (mut input, mut gradient) = SCRATCH.take();
            band.fill(shape, shape.inputs, &mut input, |c, y, into| {
                into.copy_from_slice(shape.input_row(x, picture, c, y));
            });
            let pixels = band.rows * shape.width;
            gradient.resize(bias.len() * pixels, 0.0);
            let blocks = gradient.chunks_exact_mut(lanes * pixels).zip(bias.chunks_mut(lanes));
            for (block, (gradient, bias)) in blocks.enumerate() {
                let first = first + block * lanes;
                let used = lanes.min(shape.outputs - first);
                lines[used * shape.width..].fill(0.0);
                for (y, into) in gradient.chunks_exact_mut(lanes * shape.width).enumerate() {
                    for (c, line) in lines.chunks_exact_mut(shape.width).take(used).enumerate() {
                        before(picture, first + c, from + y, line);
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
                weight,
            });
            SCRATCH.set((input, gradient));
        }
    });
    let mut weight = vec![0.0; shape.outputs * columns];
    weight.par_chunks_mut(columns).enumerate().for_each(|(output, weight)| {
        let start = output / lanes * columns * lanes + output % lanes;
        for group in weights.chunks_exact(padded * columns) {
            for (into, from) in weight.iter_mut().zip(group[start..].iter().step_by(lanes)) {
                *into += from;
            }
        }
    });
    let mut bias = vec![0.0; shape.outputs];
    for group in biases.chunks_exact(padded) {
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
    /// The input's band.
    input: &'a [f32],
    /// `[blocks, pixels, lanes]`
    gradient: &'a [f32],
    lanes: usize,
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
        let (columns, lanes) = (self.shape.columns(), self.lanes);
        let lines = columns / K;
        let blocks = self.weight.len() / (columns * lanes);
        let pixels = self.gradient.len() / blocks;
        for line in (0..lines).step_by(N) {
            let used = N.min(lines - line);
            let places: [usize; N] =
                core::array::from_fn(|n| self.place(K * (line + n.min(used - 1))));
            for (weight, gradient) in self
                .weight
                .chunks_exact_mut(columns * lanes)
                .zip(self.gradient.chunks_exact(pixels))
            {
                for lane in (0..lanes).step_by(V * S::F32_LANES) {
                    let tile = Tile {
                        input: self.input,
                        places,
                        stride: self.band.stride,
                        width: self.shape.width,
                        gradient,
                        lanes,
                        lane,
                    };
                    let sums = tile.sums::<S, V, K>(simd);
                    let weight = weight[line * K * lanes..].chunks_exact_mut(lanes);
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
            let rows = self
                .places
                .map(|place| &self.input[place + y * self.stride..][..self.width + K - 1]);
            for (x, gradient) in gradient.chunks_exact(self.lanes).enumerate() {
                let (gradient, _) = S::as_simd_f32s(&gradient[self.lane..]);
                let gradient: [S::f32s; V] =
                    *gradient.first_chunk().expect("V vectors in the lanes");
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
