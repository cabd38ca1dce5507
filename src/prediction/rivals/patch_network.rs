//! Generator of Texler et al., with a head of three channels for each look: two convolutions down, residual blocks, two
//! up with skip connections, and smoothing convolutions at the end.
//!
//! As in our own network, resolution changes by blur-pool and bilinear interpolation, and widths are
//! half those published. The published 7 × 7 convolution near the end is 3 × 3 here: it would cost more than all
//! other layers together. There is no batch normalisation, whose statistics differ between patches and whole frames.

use burn::module::{Initializer, Module, Param};
use burn::nn::PaddingConfig2d;
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::tensor::{Device, Tensor, activation};
use reflectance::Precision;
use reflectance::kernels::{self, Activation};

/// Channels of the first block.
const WIDTH: usize = 16;
/// Residual blocks.
const BLOCKS: usize = 7;
/// Channels of the input: the plate's and the guide's.
pub const INPUTS: usize = 6;
const RELU: Activation = Activation::LeakyRelu(0.0);
const LEAKY: Activation = Activation::LeakyRelu(0.2);

/// The generator.
#[derive(Module, Debug)]
pub struct PatchNetwork {
    first: Conv2d,
    down: Vec<Conv2d>,
    residual: Vec<Residual>,
    up: Vec<Conv2d>,
    joined: Conv2d,
    smoothers: Vec<Conv2d>,
    output: Conv2d,
}

/// A residual block.
#[derive(Module, Debug)]
struct Residual {
    first: Conv2d,
    second: Conv2d,
}

pub fn convolution(from: usize, to: usize, kernel: usize) -> Conv2dConfig {
    let pad = kernel / 2;
    Conv2dConfig::new([from, to], [kernel, kernel]).with_padding(PaddingConfig2d::Explicit(pad, pad, pad, pad))
}

/// Output layer with the initial means `means`, one per channel.
pub fn output_layer(from: usize, kernel: usize, means: &[f32], device: &Device) -> Conv2d {
    let bound = 0.1 / ((from * kernel * kernel) as f64).sqrt();
    let start = Initializer::Uniform { min: -bound, max: bound };
    let mut layer = convolution(from, means.len(), kernel).with_initializer(start).init(device);
    let logit = |mean: &f32| {
        let mean = mean.clamp(1e-3, 1.0 - 1e-3);
        (mean / (1.0 - mean)).ln()
    };
    let logits: Vec<f32> = means.iter().map(logit).collect();
    let bias = Tensor::<1>::from_floats(logits.as_slice(), device);
    layer.bias = Some(Param::from_tensor(bias));
    layer
}

impl PatchNetwork {
    /// Network whose heads start at the means of their targets, three channels for each look.
    pub fn new(means: &[f32], device: &Device) -> Self {
        let [half, quarter] = [2 * WIDTH, 4 * WIDTH];
        let layer = |from, to, kernel| convolution(from, to, kernel).init(device);
        let residual = |_| Residual { first: layer(quarter, quarter, 3), second: layer(quarter, quarter, 3) };
        Self {
            first: layer(INPUTS, WIDTH, 7),
            down: vec![layer(WIDTH, half, 3), layer(half, quarter, 3)],
            residual: (0..BLOCKS).map(residual).collect(),
            up: vec![layer(2 * quarter, quarter, 3), layer(quarter + half, half, 3)],
            joined: layer(half + WIDTH + INPUTS, half, 3),
            smoothers: (0..2).map(|_| layer(half, half, 3)).collect(),
            output: output_layer(half, 1, means, device),
        }
    }

    /// `[n, 6, h, w]` → `[n, 3·looks, h, w]` in (0, 1), of some looks; None means all. h and w are multiples of 4.
    pub fn forward(&self, input: Tensor<4>, looks: Option<&[usize]>) -> Tensor<4> {
        let layer =
            |x, skip, layer: &Conv2d, activation| kernels::convolution(x, skip, layer, activation, Precision::Auto);
        let full = layer(input.clone(), None, &self.first, LEAKY);
        let half = layer(kernels::blur_pool(full.clone()), None, &self.down[0], LEAKY);
        let quarter = layer(kernels::blur_pool(half.clone()), None, &self.down[1], LEAKY);
        let mut x = quarter.clone();
        for block in &self.residual {
            let y = layer(activation::relu(x.clone()), None, &block.first, RELU);
            x = x + layer(y, None, &block.second, Activation::None);
        }
        x = layer(kernels::upsample(x, Some(quarter)), None, &self.up[0], RELU);
        x = layer(kernels::upsample(x, Some(half)), None, &self.up[1], RELU);
        let skip = Tensor::cat(vec![full, input], 1);
        x = layer(x, Some(skip), &self.joined, RELU);
        for smoother in &self.smoothers {
            x = layer(x, None, smoother, RELU);
        }
        match looks {
            None => layer(x, None, &self.output, Activation::Sigmoid),
            Some(looks) => {
                let channels = |&look: &usize| (0..3).map(move |c| 3 * look + c);
                let outputs: Vec<usize> = looks.iter().flat_map(channels).collect();
                let (sigmoid, precision) = (Activation::Sigmoid, Precision::Auto);
                kernels::some_outputs(x, None, &self.output, &outputs, sigmoid, precision)
            }
        }
    }
}
