//! Convolutions: the left factor is the weights, the right factor a band of the picture.

use super::band::{Band, Chunks, Cover, Run};
use super::layout::{Factor, SIDE, Steps, Sums, TILE};
use super::pack::{self, Buffer};
use super::sum::sum;
use super::weights;
use crate::kernels::band::{Share, Weights, shares, split_bands};
use crate::kernels::chunks::vectorized;
use crate::kernels::shape::{Rows, Shape};
use rayon::prelude::*;
use std::cell::{Cell, RefCell};

/// Weights in the layout of [`weights::pack`].
struct Packed<'a> {
    words: &'a [u32],
    /// Words of a block.
    block: usize,
}

/// The sums of a band for some output channels.
struct Product<'a, 'b> {
    cover: &'a Cover,
    band: &'a Band,
    values: &'a [u32],
    steps: &'a Steps,
    weights: Packed<'a>,
    width: usize,
    bias: Option<&'a [f32]>,
    /// First channel, the first one of a block.
    first: usize,
    /// Rows of the band in each output plane.
    out: &'a mut [&'b mut [f32]],
}

impl Product<'_, '_> {
    fn run(self) {
        let [down, across] = self.cover.blocking.tiles();
        let channels = down * SIDE;
        let blocks = self.band.blocks(self.cover, self.width);
        let mut sums = Sums([[0.0; TILE]; 4]);
        for (i, planes) in self.out.chunks_mut(channels).enumerate() {
            let first = self.first + i * channels;
            let left = Factor {
                bytes: pack::bytes(self.weights.words),
                start: 4 * self.weights.block * (first / channels),
                row: 4 * SIDE,
                next: 4 * TILE,
            };
            for block in &blocks {
                let right = Factor {
                    bytes: pack::bytes(self.values),
                    start: 4 * block.start,
                    row: 4 * self.band.plane,
                    next: 4 * block.next,
                };
                sum(self.cover.blocking, &left, &right, self.steps, &mut sums.0);
                vectorized(
                    #[inline(always)]
                    || {
                        for (r, plane) in planes.iter_mut().enumerate() {
                            let bias = self.bias.map_or(0.0, |bias| bias[first + r]);
                            let tile = &sums.0[r / SIDE * across..][..across];
                            scatter(tile, r % SIDE, bias, &block.runs, plane);
                        }
                    },
                );
            }
        }
    }
}

/// Writes a channel's sums to their pixels.
#[inline(always)]
fn scatter(tiles: &[[f32; TILE]], row: usize, bias: f32, runs: &[Run], plane: &mut [f32]) {
    for run in runs {
        let sums = &tiles[run.tile][row * SIDE..][..SIDE];
        let into = &mut plane[run.pixel..][..run.length];
        if let (Some(into), Some(sums)) = (into.first_chunk_mut(), sums.first_chunk::<SIDE>()) {
            *into = sums.map(|sum| sum + bias);
        } else {
            for (into, sum) in into.iter_mut().zip(&sums[run.column..]) {
                *into = sum + bias;
            }
        }
    }
}

/// Division of the work, without influence on the sums.
struct Division {
    /// Rows of a band.
    rows: usize,
    bands: usize,
    /// Output channels of a task.
    part: usize,
    parts: usize,
}

impl Division {
    fn new(shape: &Shape, cover: &Cover, chunks: Chunks) -> Self {
        /// Bytes of a band, so that it stays in the second-level cache.
        const CACHED: usize = 768 * 1024;
        /// Number of rows below which their surroundings cost too much.
        const FEW: usize = 8;
        let threads = rayon::current_num_threads();
        let wanted = if threads > 1 { 2 * threads } else { 1 };
        let row = 4 * chunks.total() * cover.stride;
        let most = (CACHED / row).saturating_sub(2 * shape.radius()).max(FEW / 2);
        // Every task reads its weights once. If the weights are larger than the picture, tasks should
        // differ in their weights.
        let heavy = shape.outputs * shape.taps() > 2 * shape.plane();
        let rows = if heavy { most } else { most.min((shape.batch * shape.height).div_ceil(wanted).max(FEW)) };
        let bands = shape.height.div_ceil(rows);
        let rows = shape.height.div_ceil(bands);
        let block = cover.blocking.tiles()[0] * SIDE;
        let blocks = shape.outputs.div_ceil(block);
        let parts = wanted.div_ceil(shape.batch * bands).min(blocks);
        let part = blocks.div_ceil(parts) * block;
        Self { rows, bands, part, parts }
    }
}

thread_local! {
    /// A thread's current band and incoming rows, kept to reuse their memory.
    static SCRATCH: RefCell<(Buffer<u32>, Vec<f32>)> =
        const { RefCell::new((Buffer::new(), Vec::new())) };
    /// Weights, and bands that threads share. Taken while in use: a thread that waits for others
    /// may meanwhile compute another convolution.
    static SHARED: Cell<[Buffer<u32>; 2]> = const { Cell::new([Buffer::new(), Buffer::new()]) };
}

/// The sums of a convolution. `finish` is applied to complete rows of the output, as many at a time as are finished.
pub fn convolve(
    shape: &Shape,
    weights: &Weights,
    bias: Option<&[f32]>,
    out: &mut [f32],
    input: &impl Rows,
    finish: impl Fn(&mut [f32]) + Sync,
) {
    let cover = Cover::new(shape);
    let chunks = Chunks::new(shape.inputs);
    let division = Division::new(shape, &cover, chunks);
    let Division { rows, bands, part, .. } = division;

    let mut shared = SHARED.take();
    let [packed, common] = &mut shared;
    let [tiles, _] = cover.blocking.tiles();
    let block = chunks.count * shape.taps() * tiles * TILE;
    let packed = packed.get(block * shape.outputs.div_ceil(tiles * SIDE));
    weights::pack(shape, weights, chunks, tiles, packed);
    let packed = &*packed;

    let band = |i: usize| {
        let from = i % bands * rows;
        Band::new(shape, &cover, from, rows.min(shape.height - from))
    };
    // If several tasks compute channels of a band, it is copied once for all of them.
    let length = band(0).plane * chunks.total();
    let common: &[u32] = if division.parts > 1 {
        let common = common.get(length * shape.batch * bands);
        for (i, values) in common.chunks_exact_mut(length).enumerate() {
            let band = band(i);
            values.par_chunks_exact_mut(band.plane).take(chunks.total()).enumerate().for_each(|(pair, into)| {
                SCRATCH.with_borrow_mut(|(_, lines)| {
                    band.fill(shape, input, (i / bands, pair), lines, into);
                });
            });
        }
        common
    } else {
        &[]
    };

    let mut split = split_bands(out, shape, shape.outputs, rows);
    let tasks = shares(&mut split, part);
    let threads = tasks.len() > 1;
    let task = |Share { band: i, first, out }: Share| {
        let band = band(i);
        let steps = (0..chunks.count * shape.taps()).map(|step| {
            let (chunk, tap) = (step / shape.taps(), step % shape.taps());
            let (ky, kx) = (tap / shape.kernel, tap % shape.kernel);
            let pixel = ky * band.stride + kx;
            [4 * step * tiles * TILE, 4 * (chunk * chunks.pairs * band.plane + pixel)]
        });
        let steps = Steps::new(steps.collect(), chunks.pairs);
        SCRATCH.with_borrow_mut(|(values, lines)| {
            let values = if common.is_empty() {
                let values = values.get(band.plane * chunks.total());
                for (pair, into) in values.chunks_exact_mut(band.plane).enumerate() {
                    band.fill(shape, input, (i / bands, pair), lines, into);
                }
                values
            } else {
                &common[i * length..][..length]
            };
            let product = Product {
                cover: &cover,
                band: &band,
                values,
                steps: &steps,
                weights: Packed { words: packed, block },
                width: shape.width,
                bias,
                first,
                out: &mut *out,
            };
            product.run();
        });
        for plane in out {
            finish(plane);
        }
    };
    if threads {
        tasks.into_par_iter().for_each(task);
    } else {
        tasks.into_iter().for_each(task);
    }
    SHARED.set(shared);
}
