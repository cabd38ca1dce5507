//! Two-dimensional convolution of stride one that keeps the size of the picture, and its gradients.

use super::band::{self, Weights};
use super::bf16::{self, Signs};
use super::correlation::correlate;
use super::peak::bf16_pays;
use super::pointwise::{Activation, pull_back_leaky};
use super::precision::Precision;
use super::shape::{Input, Rows, Shape, Sources};
use super::tile::MAX_POSITIONS;
use super::unfolded;

/// Gradients of a convolution.
pub struct Gradients {
    /// `[batch, inputs, height, width]`; None if not requested.
    pub input: Option<Vec<f32>>,
    /// By the weights, `[outputs, inputs, kernel, kernel]`, and by the biases, `[outputs]`; None if not
    /// requested.
    pub parameters: Option<(Vec<f32>, Vec<f32>)>,
}

/// A convolution's sources and output, as far as its gradients need them.
#[derive(Clone, Copy)]
pub enum GradientInputs<'a> {
    /// Without activation the output is not read.
    Exact(Sources<'a>, &'a [f32]),
    /// Sources as bf16, for factors of bf16; None without activation.
    Rounded(Sources<'a, u16>, Option<&'a Signs>),
}

/// Number of pixels up to which unfolding is faster than bands: for the products that read weights …
const TINY: usize = 16;
/// … and for the product that writes them.
const SMALL: usize = 64;

impl Shape {
    /// The same shape with factors of bf16, if the processor multiplies them, the precision allows it, and there are
    /// enough channels.
    pub fn with_precision(self, precision: Precision) -> Self {
        let fills = self.inputs.min(self.outputs) >= bf16::MIN_CHANNELS && self.plane() > SMALL;
        let rounds = match precision {
            Precision::Full => false,
            Precision::Mixed => bf16::available(),
            Precision::Auto => bf16_pays(),
        };
        Self { bf16: fills && rounds, ..self }
    }

    /// True if pictures are unfolded, given the number of pixels up to which that is faster.
    fn unfolds(&self, most: usize) -> bool {
        !self.bf16 && self.plane() <= most && self.columns() >= MAX_POSITIONS
    }
}

/// Convolution, bias and activation: x as [`Sources`], weight `[outputs, inputs,
/// kernel, kernel]`, bias `[outputs]` → out `[batch, outputs, height, width]`.
pub fn forward(shape: &Shape, x: Sources, weight: &[f32], bias: &[f32], activation: Activation, out: &mut [f32]) {
    if shape.unfolds(TINY) {
        return unfolded::forward(shape, x, weight, bias, activation, out);
    }
    let taps = shape.taps();
    let weights = Weights {
        values: weight,
        rows: shape.outputs,
        row_stride: shape.inputs * taps,
        channel_stride: taps,
        taps: (0..taps).collect(),
    };
    let rows = Input(shape, x);
    convolve(shape, &weights, Some(bias), out, &rows, |plane| activation.apply(plane));
}

/// Gradients of [`forward`], from `inputs` and the gradient of its output. Those by the input and
/// by the parameters cost about the same; only the requested ones are computed.
pub fn backward(
    shape: &Shape,
    inputs: GradientInputs,
    weight: &[f32],
    activation: Activation,
    gradient: &[f32],
    [input_gradient, weight_gradient]: [bool; 2],
) -> Gradients {
    let before = |picture: usize, channel: usize, y: usize, into: &mut [f32]| {
        let outputs = shape.outputs;
        let gradient = shape.row(gradient, outputs, picture, channel, y);
        match inputs {
            GradientInputs::Exact(_, output) => {
                let output = shape.row(output, outputs, picture, channel, y);
                activation.pull_back(gradient, output, into);
            }
            GradientInputs::Rounded(_, None) => into.copy_from_slice(gradient),
            GradientInputs::Rounded(_, Some(signs)) => {
                let positive = shape.row(&signs.positive, outputs, picture, channel, y);
                pull_back_leaky(signs.slope, gradient, positive, into);
            }
        }
    };
    let input = input_gradient.then(|| {
        let mut input = vec![0.0; shape.batch * shape.inputs * shape.plane()];
        by_input(shape, weight, before, &mut input);
        input
    });
    let parameters = weight_gradient.then(|| match inputs {
        GradientInputs::Rounded(x, _) => bf16::correlate(shape, x, before),
        GradientInputs::Exact(x, _) if shape.bf16 => bf16::correlate(shape, x, before),
        GradientInputs::Exact(x, _) if shape.unfolds(SMALL) => unfolded::by_weights(shape, x, before),
        GradientInputs::Exact(x, _) => correlate(shape, x, before),
    });
    Gradients { input, parameters }
}

/// Gradient by the input: a convolution of the output's gradient, with the kernel rotated
/// by half a turn and inputs and outputs exchanged.
fn by_input(shape: &Shape, weight: &[f32], before: impl Fn(usize, usize, usize, &mut [f32]) + Sync, out: &mut [f32]) {
    if shape.unfolds(TINY) {
        return unfolded::by_input(shape, weight, before, out);
    }
    let taps = shape.taps();
    let weights = Weights {
        values: weight,
        rows: shape.inputs,
        row_stride: taps,
        channel_stride: shape.inputs * taps,
        taps: (0..taps).rev().collect(),
    };
    convolve(&shape.reversed(), &weights, None, out, &before, |_| {});
}

/// The sums of a convolution: see [`band::convolve`].
fn convolve(
    shape: &Shape,
    weights: &Weights,
    bias: Option<&[f32]>,
    out: &mut [f32],
    rows: &impl Rows,
    finish: impl Fn(&mut [f32]) + Sync,
) {
    if shape.bf16 {
        bf16::convolve(shape, weights, bias, out, rows, finish);
    } else {
        band::convolve(shape, weights, bias, out, rows, finish);
    }
}
