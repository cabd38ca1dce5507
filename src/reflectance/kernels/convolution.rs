//! Two-dimensional convolution of stride one that keeps the size of the picture, and its gradients.

use super::Precision;
use super::amx;
use super::band::{Weights, convolve};
use super::chunks::vectorized;
use super::correlation::correlate;
use super::pointwise;
use super::tile::MAX_POSITIONS;
use super::unfolded;
use rayon::prelude::*;

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
    /// Whether the processor's tile registers compute it, and how exactly.
    pub tiles: Option<amx::Precision>,
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
    pub(super) fn apply(self, values: &mut [f32]) {
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
    /// `[batch, inputs, height, width]`, if it was asked for.
    pub input: Option<Vec<f32>>,
    /// By the weights, `[outputs, inputs, kernel, kernel]`, and by the biases, `[outputs]`, where they
    /// were asked for.
    pub parameters: Option<(Vec<f32>, Vec<f32>)>,
}

/// Inputs whose channels follow one another: `[batch, c1, h, w]` and `[batch, c2, h, w]`, c1 + c2 the
/// convolution's inputs. The second may be empty.
pub type Sources<'a> = [&'a [f32]; 2];

/// Pixels of a picture up to which unfolding is faster than bands: for the products that read weights …
const TINY: usize = 16;
/// … and for the one that writes them.
const SMALL: usize = 64;

impl Shape {
    /// The same shape on tile registers, where there are any, the precision allows it, and channels fill
    /// them.
    pub fn with_precision(self, precision: Precision) -> Self {
        let fills = self.inputs.min(self.outputs) >= amx::MIN_CHANNELS && self.plane() > SMALL;
        let tiles = match precision {
            _ if !fills || !amx::available() => None,
            Precision::Full => None,
            Precision::Split => Some(amx::Precision::Split),
            Precision::Half => Some(amx::Precision::Half),
        };
        Self { tiles, ..self }
    }

    /// Whether pictures are unfolded, where that is faster up to so many pixels.
    fn unfolds(&self, most: usize) -> bool {
        self.tiles.is_none() && self.plane() <= most && self.columns() >= MAX_POSITIONS
    }

    pub(super) fn radius(&self) -> usize {
        self.kernel / 2
    }

    pub(super) fn taps(&self) -> usize {
        self.kernel * self.kernel
    }

    /// Weights of an output channel.
    pub(super) fn columns(&self) -> usize {
        self.inputs * self.taps()
    }

    pub(super) fn plane(&self) -> usize {
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
    pub(super) fn input_row<'a>(
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
    pub(super) fn band_rows(&self) -> usize {
        const CACHED: usize = 256 * 1024;
        let channels = self.inputs.max(self.outputs);
        let rows = CACHED / (channels * (self.width + self.radius())).max(1);
        let most = (self.height.div_ceil(16)).max(8);
        rows.saturating_sub(2 * self.radius())
            .clamp(2, most)
            .min(self.height)
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
    if shape.unfolds(TINY) {
        return unfolded::forward(shape, x, weight, bias, activation, out);
    }
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
/// by the parameters cost about the same; only those that are asked for are computed.
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
        by_input(shape, weight, before, &mut input);
        input
    });
    let parameters = weight_gradient.then(|| {
        if shape.unfolds(SMALL) {
            unfolded::by_weights(shape, x, before)
        } else {
            correlate(shape, x, before)
        }
    });
    Gradients { input, parameters }
}

/// The gradient by the input: a convolution of the output's gradient, whose kernel is the same turned
/// by half a turn, with inputs and outputs exchanged.
fn by_input(
    shape: &Shape,
    weight: &[f32],
    before: impl Fn(usize, usize, usize, &mut [f32]) + Sync,
    out: &mut [f32],
) {
    if shape.unfolds(TINY) {
        return unfolded::by_input(shape, weight, before, out);
    }
    let taps = shape.taps();
    let mut weights = Weights {
        values: weight,
        row_stride: taps,
        channel_stride: shape.inputs * taps,
        taps: (0..taps).rev().collect(),
    };
    // Read as they lie, weights come a few at a time from far apart: with little to do for each, it
    // pays to bring them in order first.
    let turned;
    if shape.tiles.is_none() && shape.plane() < 1024 {
        turned = transposed(shape, weight);
        weights = Weights {
            values: &turned,
            row_stride: shape.outputs * taps,
            channel_stride: taps,
            ..weights
        };
    }
    convolve(&shape.reversed(), &weights, None, out, before, |_| {});
}

/// `[outputs, inputs, taps]` → `[inputs, outputs, taps]`.
fn transposed(shape: &Shape, weight: &[f32]) -> Vec<f32> {
    const INPUTS: usize = 16;
    let (taps, columns) = (shape.taps(), shape.columns());
    let row = shape.outputs * taps;
    let mut transposed = vec![0.0; weight.len()];
    let blocks = transposed.par_chunks_mut(INPUTS * row).enumerate();
    blocks.for_each(|(block, rows)| {
        for (output, weight) in weight.chunks_exact(columns).enumerate() {
            let weight = weight[block * INPUTS * taps..].chunks_exact(taps);
            for (row, weight) in rows.chunks_exact_mut(row).zip(weight) {
                row[output * taps..][..taps].copy_from_slice(weight);
            }
        }
    });
    transposed
}
