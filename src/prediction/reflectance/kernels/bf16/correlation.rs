//! Gradients by weights: the left factor is the input, channel by channel, the right factor the output's
//! gradient with its channels side by side. Sums run over the pixels of a band.

use super::layout::{Blocking, Factor, SIDE, Steps, Sums, TILE};
use super::pack::{self, Buffer, Round};
use super::sum::sum;
use crate::kernels::chunks::vectorized;
use crate::kernels::shape::{Shape, Sources};
use rayon::prelude::*;
use std::cell::{Cell, RefCell};

/// Pixels of a step, equal to the width of a left tile.
const STEP: usize = 2 * SIDE;
/// Sums of four tiles.
const BLOCK: usize = 4 * TILE;

/// Division of the work. It depends only on the shape, since the order of the sums depends on it.
struct Division {
    blocking: Blocking,
    /// Distance between rows of a band. It is even, so that pairs of pixels start with a row.
    stride: usize,
    /// Rows of a band.
    rows: usize,
    /// Blocks of input channels and of output channels.
    blocks: [usize; 2],
    /// Most parts with separate sums.
    groups: usize,
}

impl Division {
    fn new(shape: &Shape) -> Self {
        /// Bytes of a band, so that it stays in the second-level cache.
        const CACHED: usize = 1536 * 1024;
        /// Pixels of a band: enough that sums are seldom moved.
        const PIXELS: usize = 2048;
        const GROUPS: usize = 8;
        let blocking = if shape.outputs <= SIDE && shape.inputs > 2 * SIDE { Blocking::Tall } else { Blocking::Square };
        let [down, across] = blocking.tiles();
        let blocks = [shape.inputs.div_ceil(down * SIDE), shape.outputs.div_ceil(across * SIDE)];
        let channels = SIDE * (blocks[0] * down + blocks[1] * across);
        let stride = (shape.width + shape.radius()).next_multiple_of(2);
        let pixels = (CACHED / (2 * channels)).min(PIXELS);
        let rows = (pixels / stride).clamp(4, shape.height.max(4));
        let bands = shape.height.div_ceil(rows);
        let rows = shape.height.div_ceil(bands);
        Self { blocking, stride, rows, blocks, groups: (shape.batch * shape.plane() / PIXELS).clamp(1, GROUPS) }
    }

    /// Channels of the input and of the output, including padding.
    fn channels(&self) -> [usize; 2] {
        let [down, across] = self.blocking.tiles();
        [self.blocks[0] * down * SIDE, self.blocks[1] * across * SIDE]
    }
}

/// Rows `from..from + rows` of a picture, and for the input those around them.
struct Band {
    from: usize,
    rows: usize,
    /// Pixels of the gradient, including those between rows and at the end, which are zero.
    pixels: usize,
    /// Distance between rows.
    stride: usize,
    /// Distance between channels of the input.
    plane: usize,
}

impl Band {
    fn new(shape: &Shape, division: &Division, from: usize) -> Self {
        let rows = division.rows.min(shape.height - from);
        let pixels = (rows * division.stride).next_multiple_of(STEP);
        let plane = pixels + 2 * shape.radius() * (division.stride + 1);
        // An odd number of cache lines between channels spreads them over the cache's sets.
        let plane = (plane.div_ceil(STEP) | 1) * STEP;
        Self { from, rows, pixels, stride: division.stride, plane }
    }

    /// Copies one channel of the input; `row(y)` gives a row.
    fn fill_input<'a, T: Round + 'a>(&self, shape: &Shape, into: &mut [u16], row: impl Fn(usize) -> &'a [T]) {
        let (radius, width, stride) = (shape.radius(), shape.width, self.stride);
        let rows = self.rows + 2 * radius;
        for i in 0..rows {
            let into = &mut into[i * stride..][..stride];
            match (self.from + i).checked_sub(radius) {
                Some(y) if y < shape.height => {
                    let row = row(y);
                    into[..radius].fill(0);
                    into[radius + width..].fill(0);
                    vectorized(
                        #[inline(always)]
                        || T::to_bf16(row, &mut into[radius..]),
                    );
                }
                _ => into.fill(0),
            }
        }
        into[rows * stride..].fill(0);
    }

    /// Copies up to 16 channels of the gradient, followed by zeros, and adds each up in `bias`;
    /// `row(channel, y, into)` gives a row.
    fn fill_gradient(
        &self,
        width: usize,
        scratch: (&mut [f32], &mut [u32]),
        into: &mut [[u32; SIDE]],
        bias: &mut [f32],
        row: impl Fn(usize, usize, &mut [f32]),
    ) {
        let (line, words) = scratch;
        let length = self.pixels / 2;
        let words = &mut words[..SIDE * length];
        words[bias.len() * length..].fill(0);
        let line = &mut line[..width.next_multiple_of(SIDE)];
        for (c, bias) in bias.iter_mut().enumerate() {
            let mut sums = [0.0; SIDE];
            for i in 0..self.rows {
                line[width..].fill(0.0);
                row(c, self.from + i, &mut line[..width]);
                let place = c * length + i * self.stride / 2;
                let last = i + 1 == self.rows;
                let end = if last { (c + 1) * length } else { place + self.stride / 2 };
                let line = &*line;
                vectorized(
                    #[inline(always)]
                    || {
                        let row = &line[..width.next_multiple_of(2)];
                        let (words, rest) = words[place..end].split_at_mut(row.len() / 2);
                        pack::neighbours(row, words);
                        rest.fill(0);
                        for chunk in line.as_chunks::<SIDE>().0 {
                            for (sum, x) in sums.iter_mut().zip(chunk) {
                                *sum += x;
                            }
                        }
                    },
                );
            }
            *bias += sums.iter().sum::<f32>();
        }
        pack::turn(words, length, into);
    }
}

/// Sums of a task: for its blocks of input channels and all output channels, the sums of each tap.
struct Share<'a> {
    bands: &'a [(usize, usize)],
    /// First block of input channels.
    first: usize,
    sums: &'a mut [f32],
    /// None while another task uses them.
    bias: Option<&'a mut [f32]>,
}

#[derive(Default)]
struct Scratch {
    input: Buffer<u16>,
    gradient: Buffer<u32>,
    words: Buffer<u32>,
    line: Buffer<f32>,
    bias: Buffer<f32>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
    /// Taken while in use: a thread that waits for others may meanwhile compute another
    /// convolution.
    static SHARED: Cell<Buffer<f32>> = const { Cell::new(Buffer::new()) };
}

/// Gradients by weights and biases. `before(picture, channel, y, into)` fills a row of the gradient
/// of the convolution's sums.
pub fn correlate<T: Round>(
    shape: &Shape,
    x: Sources<T>,
    before: impl Fn(usize, usize, usize, &mut [f32]) + Sync,
) -> (Vec<f32>, Vec<f32>) {
    let division = Division::new(shape);
    let bands: Vec<(usize, usize)> = (0..shape.batch)
        .flat_map(|picture| (0..shape.height).step_by(division.rows).map(move |from| (picture, from)))
        .collect();
    let groups: Vec<_> = bands.chunks(bands.len().div_ceil(division.groups)).collect();
    // With fewer groups than threads, each group is divided by input channels.
    let parts = rayon::current_num_threads().div_ceil(groups.len());
    let part = division.blocks[0].div_ceil(parts);
    let block = division.blocks[1] * shape.taps() * BLOCK;
    let length = division.blocks[0] * block;
    let mut shared = SHARED.take();
    let sums = shared.get(groups.len() * length);
    let mut biases = vec![0.0; groups.len() * shape.outputs];
    let shares: Vec<Share> = sums
        .chunks_exact_mut(length)
        .zip(biases.chunks_exact_mut(shape.outputs))
        .zip(&groups)
        .flat_map(|((sums, bias), bands)| {
            let mut bias = Some(bias);
            sums.chunks_mut(part * block).enumerate().map(move |(p, sums)| Share {
                bands,
                first: p * part,
                sums,
                bias: bias.take(),
            })
        })
        .collect();
    shares.into_par_iter().for_each(|share| {
        SCRATCH.with_borrow_mut(|scratch| add_up(shape, &division, x, &before, share, scratch));
    });

    let columns = shape.inputs * shape.taps();
    let mut weight = vec![0.0; shape.outputs * columns];
    let sums = &*sums;
    weight
        .par_chunks_mut(SIDE * columns)
        .enumerate()
        .for_each(|(tile, weight)| gather(shape, &division, sums, length, tile, weight));
    SHARED.set(shared);
    let mut bias = vec![0.0; shape.outputs];
    for group in biases.chunks_exact(shape.outputs) {
        add(&mut bias, group);
    }
    (weight, bias)
}

#[inline(always)]
fn add(into: &mut [f32], from: &[f32]) {
    for (into, from) in into.iter_mut().zip(from) {
        *into += from;
    }
}

fn add_up<T: Round>(
    shape: &Shape,
    division: &Division,
    x: Sources<T>,
    before: &(impl Fn(usize, usize, usize, &mut [f32]) + Sync),
    mut share: Share,
    scratch: &mut Scratch,
) {
    let [down, _] = division.blocking.tiles();
    let block = division.blocks[1] * shape.taps() * BLOCK;
    let own = share.sums.len() / block * down * SIDE;
    let outputs = division.channels()[1];
    for (i, &(picture, from)) in share.bands.iter().enumerate() {
        let band = Band::new(shape, division, from);
        let line = scratch.line.get(shape.width.next_multiple_of(SIDE));

        let input = scratch.input.get(own * band.plane);
        for (c, into) in input.chunks_exact_mut(band.plane).enumerate() {
            let channel = share.first * down * SIDE + c;
            if channel < shape.inputs {
                band.fill_input(shape, into, |y| shape.input_row(x, picture, channel, y));
            } else {
                into.fill(0);
            }
        }

        let pairs = band.pixels / 2;
        let words = scratch.words.get(SIDE * pairs);
        let gradient = scratch.gradient.get(outputs * pairs);
        let ignored = scratch.bias.get(shape.outputs);
        let bias = share.bias.as_deref_mut().unwrap_or(ignored);
        for (tile, into) in gradient.chunks_exact_mut(SIDE * pairs).enumerate() {
            let first = tile * SIDE;
            let into = into.as_chunks_mut::<SIDE>().0;
            let scratch = (&mut *line, &mut *words);
            let bias = &mut bias[first.min(shape.outputs)..(first + SIDE).min(shape.outputs)];
            band.fill_gradient(shape.width, scratch, into, bias, |c, y, into| before(picture, first + c, y, into));
        }

        let correlation = Correlation { shape, division, band: &band, input, gradient, replace: i == 0 };
        correlation.run(share.sums);
    }
}

/// Adds a band's share to the sums, or replaces them by it.
struct Correlation<'a> {
    shape: &'a Shape,
    division: &'a Division,
    band: &'a Band,
    input: &'a [u16],
    gradient: &'a [u32],
    replace: bool,
}

impl Correlation<'_> {
    fn run(&self, into: &mut [f32]) {
        let (shape, band) = (self.shape, self.band);
        let blocking = self.division.blocking;
        let [down, across] = blocking.tiles();
        let plane = band.plane;
        let steps = (0..band.pixels / STEP).map(|step| [2 * STEP * step, 4 * TILE * step]);
        let steps = Steps::new(steps.collect(), SIDE);
        let mut sums = Sums([[0.0; TILE]; 4]);
        for (i, into) in into.chunks_exact_mut(BLOCK).enumerate() {
            let (block, tap) = (i / shape.taps(), i % shape.taps());
            let (rows, columns) =
                (block / self.division.blocks[1] * down * SIDE, block % self.division.blocks[1] * across);
            let (ky, kx) = (tap / shape.kernel, tap % shape.kernel);
            let left = Factor {
                bytes: pack::bytes(self.input),
                start: 2 * (rows * plane + ky * self.division.stride + kx),
                row: 2 * plane,
                next: 2 * SIDE * plane,
            };
            let right = Factor {
                bytes: pack::bytes(self.gradient),
                start: 4 * columns * SIDE * band.pixels / 2,
                row: 4 * SIDE,
                next: 4 * SIDE * band.pixels / 2,
            };
            let blocks = into.as_chunks_mut::<TILE>().0;
            if let (true, Some(blocks)) = (self.replace, blocks.first_chunk_mut()) {
                sum(blocking, &left, &right, &steps, blocks);
            } else {
                sum(blocking, &left, &right, &steps, &mut sums.0);
                vectorized(
                    #[inline(always)]
                    || add(blocks.as_flattened_mut(), sums.0.as_flattened()),
                );
            }
        }
    }
}

/// Adds the groups' sums for 16 output channels, or the last ones, and puts them in order.
fn gather(shape: &Shape, division: &Division, sums: &[f32], length: usize, tile: usize, weight: &mut [f32]) {
    let [down, across] = division.blocking.tiles();
    let taps = shape.taps();
    let columns = shape.inputs * taps;
    for input in 0..shape.inputs.div_ceil(SIDE) {
        let block = input / down * division.blocks[1] + tile / across;
        let within = input % down * across + tile % across;
        let used = (shape.inputs - input * SIDE).min(SIDE);
        let start = |tap: usize, c: usize| (block * taps + tap) * BLOCK + within * TILE + c * SIDE;
        // Up to 16 taps of an input at once for all outputs. Surplus taps are overwritten
        // by the taps that follow.
        vectorized(
            #[inline(always)]
            || {
                let mut words = [[0; SIDE]; SIDE];
                for c in 0..used {
                    for from in (0..taps).step_by(SIDE) {
                        let count = (taps - from).min(SIDE);
                        for (t, words) in words.iter_mut().enumerate().take(count) {
                            let mut total = [0.0; SIDE];
                            for group in sums.chunks_exact(length) {
                                add(&mut total, &group[start(from + t, c)..][..SIDE]);
                            }
                            *words = total.map(f32::to_bits);
                        }
                        pack::transpose(&mut words);
                        let place = (input * SIDE + c) * taps + from;
                        for (weight, words) in weight.chunks_exact_mut(columns).zip(&words) {
                            let into = &mut weight[place..];
                            match into.first_chunk_mut() {
                                Some(into) => *into = words.map(f32::from_bits),
                                None => {
                                    for (into, word) in into[..count].iter_mut().zip(words) {
                                        *into = f32::from_bits(*word);
                                    }
                                }
                            }
                        }
                    }
                }
            },
        );
    }
}
