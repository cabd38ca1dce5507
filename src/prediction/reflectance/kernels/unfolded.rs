//! Convolution of small pictures with many more weights than pixels. The input is unfolded:
//! each pixel gets a row with the input of each weight. All three products then read the weights once and in
//! memory order.

use super::band::Band;
use super::chunks::{WORTH_A_THREAD, arch};
use super::correlation::add;
use super::pointwise::Activation;
use super::shape::{Shape, Sources};
use super::tile::{self, Factor, MAX_POSITIONS, Packed, ROWS, Tile};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Output channels of a tile of [`dots`].
const OUTPUTS: usize = 4;

/// An unfolded picture: `[pixels, row_length]`, each row in the order of an output channel's weights.
struct Unfolded {
    values: Vec<f32>,
    row_length: usize,
}

impl Unfolded {
    fn new(shape: &Shape, x: Sources, picture: usize) -> Self {
        let band = Band::new(shape, 0, shape.height);
        let mut copy = Vec::new();
        band.fill(shape, shape.inputs, &mut copy, |c, y, into| {
            into.copy_from_slice(shape.input_row(x, picture, c, y));
        });
        // The last tile may read further, at any width.
        let row_length = shape.columns() + MAX_POSITIONS;
        let mut values = vec![0.0; shape.plane() * row_length];
        let rows = values.par_chunks_mut(row_length).enumerate();
        let least = (WORTH_A_THREAD / row_length).max(1);
        rows.with_min_len(least).for_each(|(p, row)| {
            let pixel = p / shape.width * band.stride + p % shape.width;
            let lines = row.chunks_exact_mut(shape.kernel);
            for (line, row) in lines.take(shape.inputs * shape.kernel).enumerate() {
                let (channel, ky) = (line / shape.kernel, line % shape.kernel);
                let start = channel * band.plane + pixel + ky * band.stride;
                row.copy_from_slice(&copy[start..][..shape.kernel]);
            }
        });
        Self { values, row_length }
    }
}

/// As [`convolution::forward`](super::convolution::forward).
pub fn forward(shape: &Shape, x: Sources, weight: &[f32], bias: &[f32], activation: Activation, out: &mut [f32]) {
    let (columns, pixels) = (shape.columns(), shape.plane());
    for (picture, out) in out.chunks_exact_mut(shape.outputs * pixels).enumerate() {
        let unfolded = Unfolded::new(shape, x, picture);
        let blocks = out.par_chunks_mut(OUTPUTS * pixels).enumerate();
        let least = (WORTH_A_THREAD / (OUTPUTS * columns)).max(1);
        blocks.with_min_len(least).for_each(|(block, out)| {
            let first = block * OUTPUTS;
            arch().dispatch(Outputs {
                weight: &weight[first * columns..],
                columns,
                unfolded: &unfolded,
                bias: &bias[first..],
                pixels,
                out,
            });
            activation.apply(out);
        });
    }
}

/// A block of output channels: each sum is the product of a row of weights and a row of the unfolded picture.
struct Outputs<'a> {
    /// Output from the block's first channel on.
    weight: &'a [f32],
    columns: usize,
    unfolded: &'a Unfolded,
    bias: &'a [f32],
    pixels: usize,
    out: &'a mut [f32],
}

impl Outputs<'_> {
    /// Sums of the pixels from `pixel` on, `T` at a time; returns the first remaining one.
    #[inline(always)]
    fn tiles<S: Simd, const T: usize>(&mut self, simd: S, mut pixel: usize) -> usize {
        let used = self.out.len() / self.pixels;
        let rows = core::array::from_fn(|r| r.min(used - 1) * self.columns);
        let unfolded = &self.unfolded.values;
        while pixel + T <= self.pixels {
            let taps: [usize; T] = core::array::from_fn(|t| (pixel + t) * self.unfolded.row_length);
            let sums = dots(simd, self.weight, rows, unfolded, taps, self.columns);
            for (r, sums) in sums.iter().take(used).enumerate() {
                let out = &mut self.out[r * self.pixels + pixel..][..T];
                for (out, sum) in out.iter_mut().zip(sums) {
                    *out = self.bias[r] + sum;
                }
            }
            pixel += T;
        }
        pixel
    }
}

impl WithSimd for Outputs<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        // Narrow vectors come with few registers.
        let whole = match S::F32_LANES {
            8 => self.tiles::<S, 3>(simd, 0),
            _ => self.tiles::<S, 4>(simd, 0),
        };
        self.tiles::<S, 1>(simd, whole);
    }
}

/// Σ over `length` positions of left[rows[r] + p] · right[taps[t] + p], for all r and t of a tile.
#[inline(always)]
fn dots<S: Simd, const T: usize>(
    simd: S,
    left: &[f32],
    rows: [usize; OUTPUTS],
    right: &[f32],
    taps: [usize; T],
    length: usize,
) -> [[f32; T]; OUTPUTS] {
    let zero = simd.splat_f32s(0.0);
    let mut sums = [[zero; T]; OUTPUTS];
    let left = rows.map(|row| &left[row..][..length]);
    let right = taps.map(|tap| &right[tap..][..length]);
    let whole = length / S::F32_LANES;
    {
        let left = left.map(|a| &S::as_simd_f32s(a).0[..whole]);
        let right = right.map(|b| &S::as_simd_f32s(b).0[..whole]);
        for p in 0..whole {
            let mut b = [zero; T];
            for (b, right) in b.iter_mut().zip(right) {
                *b = right[p];
            }
            for (sums, a) in sums.iter_mut().zip(left) {
                for (sum, b) in sums.iter_mut().zip(b) {
                    *sum = simd.mul_add_e_f32s(a[p], b, *sum);
                }
            }
        }
    }
    let mut result = [[0.0; T]; OUTPUTS];
    for (r, sums) in sums.iter().enumerate() {
        for (t, sum) in sums.iter().enumerate() {
            result[r][t] = simd.reduce_sum_f32s(*sum);
        }
    }
    for p in whole * S::F32_LANES..length {
        for (result, a) in result.iter_mut().zip(left) {
            for (result, b) in result.iter_mut().zip(right) {
                *result += a[p] * b[p];
            }
        }
    }
    result
}

/// A picture's gradient before the activation, `[outputs, pixels]`; `before(picture, channel, y, into)`
/// fills a row of it.
fn gradient(shape: &Shape, picture: usize, before: &(impl Fn(usize, usize, usize, &mut [f32]) + Sync)) -> Vec<f32> {
    let mut gradient = vec![0.0; shape.outputs * shape.plane()];
    for (i, row) in gradient.chunks_exact_mut(shape.width).enumerate() {
        before(picture, i / shape.height, i % shape.height, row);
    }
    gradient
}

/// The gradients by weights and biases.
pub fn by_weights(
    shape: &Shape,
    x: Sources,
    before: impl Fn(usize, usize, usize, &mut [f32]) + Sync,
) -> (Vec<f32>, Vec<f32>) {
    let (columns, pixels) = (shape.columns(), shape.plane());
    let mut weight = vec![0.0; shape.outputs * columns];
    let mut bias = vec![0.0; shape.outputs];
    let threads = rayon::current_num_threads();
    let part = shape.outputs.div_ceil(threads).next_multiple_of(ROWS);
    for picture in 0..shape.batch {
        let gradient = gradient(shape, picture, &before);
        for (bias, plane) in bias.iter_mut().zip(gradient.chunks_exact(pixels)) {
            *bias += plane.iter().sum::<f32>();
        }
        let unfolded = Unfolded::new(shape, x, picture);
        let parts = weight.par_chunks_mut(part * columns);
        let parts = parts.zip(gradient.par_chunks(part * pixels));
        parts.for_each(|(weight, gradient)| {
            arch().dispatch(ByWeights { gradient, unfolded: &unfolded, pixels, columns, weight });
        });
    }
    (weight, bias)
}

/// weight += gradient · unfolded, for some output channels.
struct ByWeights<'a> {
    /// `[channels, pixels]`
    gradient: &'a [f32],
    unfolded: &'a Unfolded,
    pixels: usize,
    columns: usize,
    weight: &'a mut [f32],
}

impl WithSimd for ByWeights<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let step = tile::positions::<S>();
        let outputs = self.weight.len() / self.columns;
        let left =
            Packed::new(outputs, (self.pixels, 1), |output, pixel, _| self.gradient[output * self.pixels + pixel]);
        let right = Factor { values: &self.unfolded.values, channel_stride: self.unfolded.row_length, taps: &[0] };
        let mut tile: Tile = [[0.0; MAX_POSITIONS]; ROWS];
        for column in (0..self.columns).step_by(step) {
            let run = step.min(self.columns - column);
            let blocks = self.weight.chunks_mut(ROWS * self.columns);
            for (block, weight) in blocks.enumerate() {
                let product = tile::Product { left: left.block(block), right, start: [0.0; ROWS] };
                product.fill(simd, column, weight.len() / self.columns, &mut tile);
                for (weight, sums) in weight.chunks_exact_mut(self.columns).zip(&tile) {
                    add(&mut weight[column..][..run], &sums[..run]);
                }
            }
        }
    }
}

/// Columns per task of [`by_input`]: enough that weights are read in runs of a kilobyte.
const COLUMNS: usize = 5 * MAX_POSITIONS;

/// Gradient by the input: the contribution of every pixel through each weight, `[columns, pixels]`, folded
/// back to its source.
pub fn by_input(
    shape: &Shape,
    weight: &[f32],
    before: impl Fn(usize, usize, usize, &mut [f32]) + Sync,
    input: &mut [f32],
) {
    for (picture, input) in input.chunks_exact_mut(shape.inputs * shape.plane()).enumerate() {
        fold(shape, weight, &gradient(shape, picture, &before), input);
    }
}

fn fold(shape: &Shape, weight: &[f32], gradient: &[f32], input: &mut [f32]) {
    let (columns, pixels) = (shape.columns(), shape.plane());
    let mut spread = vec![0.0; columns.div_ceil(COLUMNS) * pixels * COLUMNS];
    let gradient = Packed::new(pixels, (shape.outputs, 1), |pixel, output, _| gradient[output * pixels + pixel]);
    let blocks = spread.par_chunks_mut(pixels * COLUMNS).enumerate();
    blocks.for_each(|(block, spread)| {
        arch().dispatch(SpreadGradient {
            gradient: &gradient,
            weight,
            pixels,
            columns,
            first: block * COLUMNS,
            spread,
        });
    });
    let (taps, radius) = (shape.taps(), shape.radius());
    let planes = input.par_chunks_exact_mut(pixels).enumerate();
    let least = (WORTH_A_THREAD / (pixels * taps)).max(1);
    planes.with_min_len(least).for_each(|(channel, plane)| {
        for tap in 0..taps {
            let column = channel * taps + tap;
            let spread = &spread[column / COLUMNS * pixels * COLUMNS + column % COLUMNS..];
            let (ky, kx) = (tap / shape.kernel, tap % shape.kernel);
            // Pixels for which this tap lies inside the picture.
            let ys = radius.saturating_sub(ky)..(shape.height + radius).saturating_sub(ky).min(shape.height);
            let xs = radius.saturating_sub(kx)..(shape.width + radius).saturating_sub(kx).min(shape.width);
            for y in ys {
                for x in xs.clone() {
                    let to = (y + ky - radius) * shape.width + x + kx - radius;
                    plane[to] += spread[(y * shape.width + x) * COLUMNS];
                }
            }
        }
    });
}

/// spread = gradientᵀ · weight, for a block of columns.
struct SpreadGradient<'a> {
    /// A row for each pixel, an element for each output.
    gradient: &'a Packed,
    weight: &'a [f32],
    pixels: usize,
    columns: usize,
    first: usize,
    /// `[pixels, COLUMNS]`
    spread: &'a mut [f32],
}

impl WithSimd for SpreadGradient<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let step = tile::positions::<S>();
        let right = Factor { values: self.weight, channel_stride: self.columns, taps: &[0] };
        let mut tile: Tile = [[0.0; MAX_POSITIONS]; ROWS];
        let last = self.columns.min(self.first + COLUMNS);
        for column in (self.first..last).step_by(step) {
            // The very last tile is moved back to end with the weights; its results for
            // earlier columns are left out.
            let from = column.min(self.columns - step);
            let (skipped, run) = (column - from, step.min(last - column));
            for pixel in (0..self.pixels).step_by(ROWS) {
                let used = ROWS.min(self.pixels - pixel);
                let product = tile::Product { left: self.gradient.block(pixel / ROWS), right, start: [0.0; ROWS] };
                product.fill(simd, from, used, &mut tile);
                for (r, sums) in tile.iter().take(used).enumerate() {
                    let start = (pixel + r) * COLUMNS + column - self.first;
                    let run = run.min(step - skipped);
                    self.spread[start..start + run].copy_from_slice(&sums[skipped..skipped + run]);
                }
            }
        }
    }
}
