//! Two-dimensional convolution of stride one that keeps the size of the picture, and its gradients.
//!
//! Nothing is unfolded. A band of rows is copied with its borders zeroed, the zeros to the right of
//! one row being those to the left of the next. In that copy the pixel that a tap of the kernel reads
//! lies at one distance from the pixel that it serves, whatever the pixel: a convolution becomes a
//! matrix product whose right factor is read at shifted places, over all pixels of the band at once.
//! What comes out between rows is thrown away.

use super::chunks::vectorized;
use super::pointwise;
use super::tile::{self, Factor, MOST_POSITIONS, ROWS, TAPS, Tile};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::cell::RefCell;

/// The shape of a convolution with an odd square kernel, stride 1 and zeros around the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    pub batch: usize,
    pub inputs: usize,
    pub outputs: usize,
    pub height: usize,
    pub width: usize,
    /// Width and height of the kernel.
    pub kernel: usize,
}

/// What is applied to a convolution's sums.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Activation {
    None,
    /// max(x, 0) + slope · min(x, 0); ReLU has slope 0.
    LeakyRelu(f32),
    /// 1 / (1 + exp(−x)).
    Sigmoid,
}

impl Activation {
    /// Applies it in place.
    fn apply(self, values: &mut [f32]) {
        vectorized(
            #[inline(always)]
            || match self {
                Self::None => {}
                Self::LeakyRelu(slope) => {
                    for v in &mut *values {
                        *v = if *v > 0.0 { *v } else { slope * *v };
                    }
                }
                Self::Sigmoid => {
                    for v in &mut *values {
                        *v = pointwise::sigmoid(*v);
                    }
                }
            },
        );
    }

    /// into = gradient · derivative, from the activation's output.
    fn pull_back(self, gradient: &[f32], output: &[f32], into: &mut [f32]) {
        vectorized(
            #[inline(always)]
            || {
                let terms = into.iter_mut().zip(gradient).zip(output);
                match self {
                    Self::None => into.copy_from_slice(gradient),
                    Self::LeakyRelu(slope) => {
                        for ((into, g), y) in terms {
                            *into = if *y > 0.0 { *g } else { slope * g };
                        }
                    }
                    Self::Sigmoid => {
                        for ((into, g), y) in terms {
                            *into = g * y * (1.0 - y);
                        }
                    }
                }
            },
        );
    }
}

/// The gradients of a convolution.
pub struct Gradients {
    /// `[batch, inputs, height, width]`, where it was asked for.
    pub input: Option<Vec<f32>>,
    /// By the weights, `[outputs, inputs, kernel, kernel]`, and by the biases, `[outputs]`, where they
    /// were asked for.
    pub parameters: Option<(Vec<f32>, Vec<f32>)>,
}

/// Inputs whose channels follow one another: `[batch, c1, h, w]` and `[batch, c2, h, w]`, c1 + c2 the
/// convolution's inputs. The second may be empty.
pub type Sources<'a> = [&'a [f32]; 2];

impl Shape {
    fn radius(&self) -> usize {
        self.kernel / 2
    }

    fn taps(&self) -> usize {
        self.kernel * self.kernel
    }

    fn plane(&self) -> usize {
        self.height * self.width
    }

    /// One row of a plane of `values`, `[batch, channels, height, width]`.
    fn row<'a>(
        &self,
        values: &'a [f32],
        channels: usize,
        picture: usize,
        channel: usize,
        y: usize,
    ) -> &'a [f32] {
        let start = ((picture * channels + channel) * self.height + y) * self.width;
        &values[start..start + self.width]
    }

    /// One row of an input whose channels are those of two sources, one after the other.
    fn input_row<'a>(
        &self,
        sources: Sources<'a>,
        picture: usize,
        channel: usize,
        y: usize,
    ) -> &'a [f32] {
        let first = sources[0].len() / (self.batch * self.plane()).max(1);
        match channel.checked_sub(first) {
            None => self.row(sources[0], first, picture, channel, y),
            Some(channel) => self.row(sources[1], self.inputs - first, picture, channel, y),
        }
    }

    /// The same convolution seen from its output.
    fn reversed(&self) -> Self {
        Self {
            inputs: self.outputs,
            outputs: self.inputs,
            ..*self
        }
    }

    /// Rows of a band, by the shape alone so that no result depends on the number of threads: few
    /// enough that both factors stay in the second-level cache.
    fn band_rows(&self) -> usize {
        const CACHED: usize = 160 * 1024;
        let channels = self.inputs.max(self.outputs);
        let rows = CACHED / (channels * (self.width + self.radius())).max(1);
        let most = (self.height.div_ceil(16)).max(8);
        rows.saturating_sub(2 * self.radius())
            .clamp(2, most)
            .min(self.height)
    }
}

/// Rows `from..from + rows` of one picture with the rows around them, borders zeroed.
struct Band {
    /// First row and number of rows that are computed.
    from: usize,
    rows: usize,
    /// Distance between rows in `values`.
    stride: usize,
    /// Distance between channels.
    plane: usize,
    /// Distance of the pixel that tap (ky, kx) reads from the pixel that it serves.
    taps: Vec<usize>,
}

impl Band {
    fn new(shape: &Shape, from: usize, rows: usize) -> Self {
        let stride = shape.width + shape.radius();
        let used = rows * stride;
        let plane = used.next_multiple_of(MOST_POSITIONS).next_multiple_of(16)
            + 2 * shape.radius() * (stride + 1);
        // An odd number of cache lines between channels spreads them over the cache's sets.
        let plane = (plane.div_ceil(16) | 1) * 16;
        let taps = (0..shape.taps())
            .map(|t| (t / shape.kernel) * stride + t % shape.kernel)
            .collect();
        Self {
            from,
            rows,
            stride,
            plane,
            taps,
        }
    }

    /// Positions that are computed, those between rows counted in.
    fn positions(&self) -> usize {
        self.rows * self.stride
    }

    /// Copies `channels` planes into `values`; `row(channel, y, into)` gives one row of a plane.
    #[inline(always)]
    fn fill(
        &self,
        shape: &Shape,
        channels: usize,
        values: &mut Vec<f32>,
        mut row: impl FnMut(usize, usize, &mut [f32]),
    ) {
        let radius = shape.radius();
        values.resize(channels * self.plane, 0.0);
        for (channel, plane) in values.chunks_exact_mut(self.plane).enumerate() {
            let (body, rest) = plane.split_at_mut((self.rows + 2 * radius) * self.stride);
            rest.fill(0.0);
            for (i, line) in body.chunks_exact_mut(self.stride).enumerate() {
                line[..radius].fill(0.0);
                match (self.from + i).checked_sub(radius) {
                    Some(y) if y < shape.height => row(channel, y, &mut line[radius..]),
                    _ => line.fill(0.0),
                }
            }
        }
    }
}

thread_local! {
    /// Bands of a thread's current task, kept so that their memory is.
    static SCRATCH: RefCell<(Vec<f32>, Vec<f32>)> = const { RefCell::new((Vec::new(), Vec::new())) };
}

/// The matrix product of a band for some output channels: left factor the weights, right factor the
/// band, each sum written to its pixel.
struct Product<'a, 'b> {
    band: &'a Band,
    values: &'a [f32],
    channels: usize,
    weights: Factor<'a>,
    /// Distance between output channels in the weights.
    row_stride: usize,
    width: usize,
    bias: Option<&'a [f32]>,
    first: usize,
    /// The band's rows in each output plane.
    out: &'a mut [&'b mut [f32]],
}

impl WithSimd for Product<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let step = tile::positions::<S>();
        let right = Factor {
            values: self.values,
            channel_stride: self.band.plane,
            taps: &self.band.taps,
        };
        let mut tile: Tile = [[0.0; MOST_POSITIONS]; ROWS];
        for position in (0..self.band.positions()).step_by(step) {
            for (i, planes) in self.out.chunks_mut(ROWS).enumerate() {
                let channel = |r: usize| self.first + i * ROWS + r.min(planes.len() - 1);
                let rows = core::array::from_fn(|r| channel(r) * self.row_stride);
                let start = core::array::from_fn(|r| self.bias.map_or(0.0, |b| b[channel(r)]));
                tile::product(
                    simd,
                    self.weights,
                    rows,
                    right,
                    self.channels,
                    position,
                    start,
                    &mut tile,
                );
                for (plane, sums) in planes.iter_mut().zip(&tile) {
                    scatter(&sums[..step], position, self.band, self.width, plane);
                }
            }
        }
    }
}

/// Writes a tile's sums from `position` on to the band's rows in a plane.
#[inline(always)]
fn scatter(sums: &[f32], position: usize, band: &Band, width: usize, plane: &mut [f32]) {
    let (mut y, mut x) = (position / band.stride, position % band.stride);
    let mut sums = sums;
    while !sums.is_empty() && y < band.rows {
        let run = (band.stride - x).min(sums.len());
        let valid = run.min(width.saturating_sub(x));
        plane[y * width + x.min(width)..][..valid].copy_from_slice(&sums[..valid]);
        sums = &sums[run..];
        (y, x) = (y + 1, 0);
    }
}

/// Splits planes of `plane` values into bands: for each picture and band its rows in every channel.
fn split_bands<'a>(
    out: &'a mut [f32],
    shape: &Shape,
    channels: usize,
    rows: usize,
) -> Vec<Vec<&'a mut [f32]>> {
    let bands = shape.height.div_ceil(rows);
    let mut split: Vec<Vec<&mut [f32]>> = Vec::new();
    split.resize_with(shape.batch * bands, || Vec::with_capacity(channels));
    for (i, plane) in out.chunks_exact_mut(shape.plane()).enumerate() {
        let picture = i / channels;
        for (band, rows) in plane.chunks_mut(rows * shape.width).enumerate() {
            split[picture * bands + band].push(rows);
        }
    }
    split
}

/// Where element (row, channel, tap) of the weights' factor lies.
struct Weights<'a> {
    values: &'a [f32],
    row_stride: usize,
    channel_stride: usize,
    taps: Vec<usize>,
}

/// The sums of a convolution over all bands. `row(picture, channel, y, into)` gives a row of the
/// input, `finish` is applied to what a task has written.
fn convolve(
    shape: &Shape,
    weights: &Weights,
    bias: Option<&[f32]>,
    out: &mut [f32],
    row: impl Fn(usize, usize, usize, &mut [f32]) + Sync,
    finish: impl Fn(&mut [f32]) + Sync,
) {
    let rows = shape.band_rows();
    let bands = shape.height.div_ceil(rows);
    // Channels are shared out too where there are fewer bands than threads could take.
    let wanted = 2 * rayon::current_num_threads();
    let parts = wanted
        .div_ceil(shape.batch * bands)
        .min(shape.outputs.div_ceil(ROWS));
    let part = shape.outputs.div_ceil(parts).next_multiple_of(ROWS);
    let mut split = split_bands(out, shape, shape.outputs, rows);
    let tasks: Vec<(usize, usize, &mut [&mut [f32]])> = split
        .iter_mut()
        .enumerate()
        .flat_map(|(i, planes)| {
            planes
                .chunks_mut(part)
                .enumerate()
                .map(move |(p, planes)| (i, p * part, planes))
        })
        .collect();
    let threads = tasks.len() > 1;
    let task = |(i, first, out): (usize, usize, &mut [&mut [f32]])| {
        let (picture, from) = (i / bands, i % bands * rows);
        let band = Band::new(shape, from, rows.min(shape.height - from));
        SCRATCH.with_borrow_mut(|(values, _)| {
            band.fill(shape, shape.inputs, values, |c, y, into| {
                row(picture, c, y, into)
            });
            Arch::new().dispatch(Product {
                band: &band,
                values,
                channels: shape.inputs,
                weights: Factor {
                    values: weights.values,
                    channel_stride: weights.channel_stride,
                    taps: &weights.taps,
                },
                row_stride: weights.row_stride,
                width: shape.width,
                bias,
                first,
                out,
            });
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
}

/// Convolution, bias and activation: x as [`Sources`], weight `[outputs, inputs,
/// kernel, kernel]`, bias `[outputs]` → out `[batch, outputs, height, width]`.
pub fn forward(
    shape: &Shape,
    x: Sources,
    weight: &[f32],
    bias: &[f32],
    activation: Activation,
    out: &mut [f32],
) {
    let taps = shape.taps();
    let weights = Weights {
        values: weight,
        row_stride: shape.inputs * taps,
        channel_stride: taps,
        taps: (0..taps).collect(),
    };
    let row = |picture: usize, channel: usize, y: usize, into: &mut [f32]| {
        into.copy_from_slice(shape.input_row(x, picture, channel, y));
    };
    convolve(shape, &weights, Some(bias), out, row, |plane| {
        activation.apply(plane)
    });
}

/// The gradients of [`forward`], from its output and the gradient of its output. Those by the input and
/// by the parameters cost alike; what nobody asks for is not computed.
pub fn backward(
    shape: &Shape,
    x: Sources,
    weight: &[f32],
    activation: Activation,
    output: &[f32],
    gradient: &[f32],
    [input_gradient, weight_gradient]: [bool; 2],
) -> Gradients {
    let before = |picture: usize, channel: usize, y: usize, into: &mut [f32]| {
        let row = |values| shape.row(values, shape.outputs, picture, channel, y);
        activation.pull_back(row(gradient), row(output), into);
    };
    let input = input_gradient.then(|| {
        let mut input = vec![0.0; shape.batch * shape.inputs * shape.plane()];
        let taps = shape.taps();
        // Seen from the output, the kernel is turned by half a turn.
        let weights = Weights {
            values: weight,
            row_stride: taps,
            channel_stride: shape.inputs * taps,
            taps: (0..taps).rev().collect(),
        };
        convolve(
            &shape.reversed(),
            &weights,
            None,
            &mut input,
            before,
            |_| {},
        );
        input
    });
    let parameters = weight_gradient.then(|| {
        if shape.plane() >= 512 {
            correlate(shape, x, before)
        } else {
            unfold(shape, x, before)
        }
    });
    Gradients { input, parameters }
}

/// Gradients by weights and biases for large pictures: each weight is the correlation of an output's
/// gradient with a shifted input. Groups of bands add up on their own and then in order, so that the
/// sums do not depend on the number of threads.
fn correlate(
    shape: &Shape,
    x: Sources,
    before: impl Fn(usize, usize, usize, &mut [f32]) + Sync,
) -> (Vec<f32>, Vec<f32>) {
    let rows = shape.band_rows();
    let bands: Vec<(usize, usize)> = (0..shape.batch)
        .flat_map(|picture| {
            (0..shape.height)
                .step_by(rows)
                .map(move |from| (picture, from))
        })
        .collect();
    let columns = shape.inputs * shape.taps();
    let groups = (shape.plane() / 4096).clamp(1, 16);
    let groups: Vec<_> = bands.chunks(bands.len().div_ceil(groups)).collect();
    // Where there are fewer groups than threads, each is shared out by output channels.
    let parts = rayon::current_num_threads().div_ceil(groups.len());
    let part = shape.outputs.div_ceil(parts).next_multiple_of(ROWS);
    let length = shape.outputs * columns;
    let mut weights = vec![0.0; groups.len() * length];
    let mut biases = vec![0.0; groups.len() * shape.outputs];
    let tasks = weights
        .chunks_mut(length)
        .zip(biases.chunks_mut(shape.outputs))
        .zip(&groups);
    let tasks = tasks.flat_map(|((weight, bias), bands)| {
        let shares = weight.chunks_mut(part * columns).zip(bias.chunks_mut(part));
        shares
            .enumerate()
            .map(move |(p, (weight, bias))| (p * part, weight, bias, *bands))
    });
    let tasks: Vec<_> = tasks.collect();
    tasks
        .into_par_iter()
        .for_each(|(first, weight, bias, bands)| {
            for &(picture, from) in bands {
                let band = Band::new(shape, from, rows.min(shape.height - from));
                let own = from..from + band.rows;
                SCRATCH.with_borrow_mut(|(left, right)| {
                    band.fill(shape, bias.len(), left, |c, y, into| {
                        // What lies around the band belongs to other bands.
                        if own.contains(&y) {
                            before(picture, first + c, y, into);
                        } else {
                            into.fill(0.0);
                        }
                    });
                    band.fill(shape, shape.inputs, right, |c, y, into| {
                        into.copy_from_slice(shape.input_row(x, picture, c, y));
                    });
                    Arch::new().dispatch(Correlation {
                        shape,
                        band: &band,
                        left,
                        right,
                        weight,
                        bias,
                    });
                });
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

fn add(into: &mut [f32], from: &[f32]) {
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
        let columns = shape.inputs * shape.taps();
        let length = band.positions().next_multiple_of(16);
        let place =
            |column: usize| column / shape.taps() * band.plane + band.taps[column % shape.taps()];
        // In the left factor the pixel itself lies behind the border; between rows it is zero.
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
            let mut column = 0;
            while column < columns {
                let weight = &mut self.weight[first * columns..];
                if columns - column >= TAPS {
                    let taps: [usize; TAPS] = core::array::from_fn(|t| place(column + t));
                    let sums = tile::correlation(simd, self.left, rows, self.right, taps, length);
                    for (r, sums) in sums.iter().take(used).enumerate() {
                        add(&mut weight[r * columns + column..][..TAPS], sums);
                    }
                    column += TAPS;
                } else {
                    let sums = tile::correlation(
                        simd,
                        self.left,
                        rows,
                        self.right,
                        [place(column)],
                        length,
                    );
                    for (r, sums) in sums.iter().take(used).enumerate() {
                        weight[r * columns + column] += sums[0];
                    }
                    column += 1;
                }
            }
        }
    }
}

/// Gradients by weights and biases for small pictures: the input is unfolded, 256 pixels at a time,
/// into rows of what each weight meets there.
fn unfold(
    shape: &Shape,
    x: Sources,
    before: impl Fn(usize, usize, usize, &mut [f32]) + Sync,
) -> (Vec<f32>, Vec<f32>) {
    const PIXELS: usize = 256;
    let columns = shape.inputs * shape.taps();
    let mut weight = vec![0.0; shape.outputs * columns];
    let mut bias = vec![0.0; shape.outputs];
    let row_length = columns.next_multiple_of(MOST_POSITIONS);
    let chunk_rows = (PIXELS / shape.width).max(1);
    let mut unfolded = vec![0.0; chunk_rows.min(shape.height) * shape.width * row_length];
    let mut gradient = vec![0.0; shape.outputs * chunk_rows.min(shape.height) * shape.width];
    for picture in 0..shape.batch {
        for from in (0..shape.height).step_by(chunk_rows) {
            let band = Band::new(shape, from, chunk_rows.min(shape.height - from));
            let pixels = band.rows * shape.width;
            SCRATCH.with_borrow_mut(|(values, _)| {
                band.fill(shape, shape.inputs, values, |c, y, into| {
                    into.copy_from_slice(shape.input_row(x, picture, c, y));
                });
                let values = &*values;
                unfolded[..pixels * row_length]
                    .par_chunks_mut(row_length)
                    .enumerate()
                    .for_each(|(p, row)| {
                        let pixel = p / shape.width * band.stride + p % shape.width;
                        for (line, row) in row
                            .chunks_exact_mut(shape.kernel)
                            .take(shape.inputs * shape.kernel)
                            .enumerate()
                        {
                            let (channel, ky) = (line / shape.kernel, line % shape.kernel);
                            let start = channel * band.plane + pixel + ky * band.stride;
                            row.copy_from_slice(&values[start..][..shape.kernel]);
                        }
                    });
            });
            let gradient = &mut gradient[..shape.outputs * pixels];
            gradient
                .par_chunks_mut(pixels)
                .zip(&mut bias)
                .enumerate()
                .for_each(|(c, (rows, bias))| {
                    for (i, row) in rows.chunks_exact_mut(shape.width).enumerate() {
                        before(picture, c, from + i, row);
                    }
                    *bias += rows.iter().sum::<f32>();
                });
            let gradient = &*gradient;
            let unfolded = &unfolded[..pixels * row_length];
            weight
                .par_chunks_mut(ROWS * columns)
                .enumerate()
                .for_each(|(block, weight)| {
                    Arch::new().dispatch(Unfolded {
                        gradient,
                        unfolded,
                        pixels,
                        row_length,
                        columns,
                        first: block * ROWS,
                        weight,
                    });
                });
        }
    }
    (weight, bias)
}

/// weight += gradient · unfolded, for a block of output channels.
struct Unfolded<'a> {
    gradient: &'a [f32],
    unfolded: &'a [f32],
    pixels: usize,
    row_length: usize,
    columns: usize,
    first: usize,
    weight: &'a mut [f32],
}

impl WithSimd for Unfolded<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let used = self.weight.len() / self.columns;
        let rows = core::array::from_fn(|r| (self.first + r.min(used - 1)) * self.pixels);
        let left = Factor {
            values: self.gradient,
            channel_stride: 1,
            taps: &[0],
        };
        let right = Factor {
            values: self.unfolded,
            channel_stride: self.row_length,
            taps: &[0],
        };
        let step = tile::positions::<S>();
        let mut tile: Tile = [[0.0; MOST_POSITIONS]; ROWS];
        for column in (0..self.columns).step_by(step) {
            tile::product(
                simd,
                left,
                rows,
                right,
                self.pixels,
                column,
                [0.0; ROWS],
                &mut tile,
            );
            let run = step.min(self.columns - column);
            for (weight, sums) in self.weight.chunks_exact_mut(self.columns).zip(&tile) {
                add(&mut weight[column..][..run], &sums[..run]);
            }
        }
    }
}
