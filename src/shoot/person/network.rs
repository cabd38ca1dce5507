//! The graph of MediaPipe's selfie segmentation: blocks of MobileNetV3 (Howard et al. 2019) down to 16 × 16, then
//! three stages back up. Each stage gates the features from below with the features of the same size from the way
//! down.

use burn::module::Module;
use burn::nn::PaddingConfig2d;
use burn::nn::conv::{Conv2d, Conv2dConfig, ConvTranspose2d, ConvTranspose2dConfig};
use burn::tensor::module::interpolate;
use burn::tensor::ops::{InterpolateMode, InterpolateOptions};
use burn::tensor::{Device, Tensor, activation};

/// Activation function after a convolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Activation {
    Relu,
    /// x · min(max(x + 3, 0), 6) ÷ 6.
    HardSwish,
}

impl Activation {
    fn apply(self, x: Tensor<4>) -> Tensor<4> {
        match self {
            Self::Relu => activation::relu(x),
            Self::HardSwish => x.clone() * (x + 3.0).clamp(0.0, 6.0) / 6.0,
        }
    }
}

/// A convolution with TensorFlow's `SAME` padding: an odd row or column of it lies below or to the right.
fn convolution(from: usize, to: usize, (kernel, stride): (usize, usize), device: &Device) -> Conv2d {
    Conv2dConfig::new([from, to], [kernel, kernel])
        .with_stride([stride, stride])
        .with_padding(PaddingConfig2d::Same)
        .init(device)
}

/// A depthwise convolution: each channel separately.
fn depthwise(channels: usize, (kernel, stride): (usize, usize), device: &Device) -> Conv2d {
    Conv2dConfig::new([channels, channels], [kernel, kernel])
        .with_stride([stride, stride])
        .with_groups(channels)
        .with_padding(PaddingConfig2d::Same)
        .init(device)
}

const POINT: (usize, usize) = (1, 1);

/// The mean of each channel: `[n, c, h, w]` → `[n, c, 1, 1]`.
fn mean(x: Tensor<4>) -> Tensor<4> {
    x.mean_dim(3).mean_dim(2)
}

/// Channel gate: the share of each channel that passes, 0 to 1, computed from all channels' means.
#[derive(Module, Debug)]
struct Gate {
    reduce: Conv2d,
    expand: Conv2d,
}

impl Gate {
    fn new(channels: usize, reduced: usize, device: &Device) -> Self {
        Self {
            reduce: convolution(channels, reduced, POINT, device),
            expand: convolution(reduced, channels, POINT, device),
        }
    }

    /// `[n, c, h, w]` → `[n, c, 1, 1]`.
    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let reduced = activation::relu(self.reduce.forward(mean(x)));
        activation::sigmoid(self.expand.forward(reduced))
    }
}

/// A block on the way down.
#[derive(Module, Debug)]
struct Block {
    expand: Conv2d,
    depthwise: Conv2d,
    gate: Option<Gate>,
    project: Conv2d,
    #[module(skip)]
    activation: Activation,
}

/// The shape of a [`Block`].
struct Shape {
    channels: [usize; 3],
    kernel: usize,
    stride: usize,
    /// Channels within the gate; None means no gate.
    gate: Option<usize>,
    activation: Activation,
}

impl Block {
    fn new(shape: &Shape, device: &Device) -> Self {
        let [from, within, to] = shape.channels;
        Self {
            expand: convolution(from, within, POINT, device),
            depthwise: depthwise(within, (shape.kernel, shape.stride), device),
            gate: shape.gate.map(|reduced| Gate::new(within, reduced, device)),
            project: convolution(within, to, POINT, device),
            activation: shape.activation,
        }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let y = self.activation.apply(self.expand.forward(x.clone()));
        let y = self.activation.apply(self.depthwise.forward(y));
        let y = match &self.gate {
            Some(gate) => y.clone() * gate.forward(y),
            None => y,
        };
        let y = self.project.forward(y);
        if y.dims() == x.dims() { y + x } else { y }
    }
}

/// A stage on the way up.
#[derive(Module, Debug)]
struct Stage {
    narrow: Conv2d,
    gate: Gate,
    blend: Conv2d,
    depthwise: Conv2d,
}

impl Stage {
    fn new(from: usize, to: usize, device: &Device) -> Self {
        Self {
            narrow: convolution(from, to, POINT, device),
            gate: Gate::new(to, to, device),
            blend: convolution(to, to, POINT, device),
            depthwise: depthwise(to, (3, 1), device),
        }
    }

    /// From below at half the size and from the way `down`: `[n, from, h, w]`, `[n, to, 2h, 2w]` → `[n, to, 2h, 2w]`.
    fn forward(&self, below: Tensor<4>, down: Tensor<4>) -> Tensor<4> {
        let [.., height, width] = down.dims();
        let bilinear = InterpolateOptions::new(InterpolateMode::Bilinear)
            .with_align_corners(false)
            .with_output_size([height, width]);
        let below = self.narrow.forward(interpolate(below, bilinear));
        let gate = self.gate.forward(down.clone() + below.clone());
        let x = activation::relu(self.blend.forward(down * gate + below));
        x.clone() + activation::relu(self.depthwise.forward(x))
    }
}

/// Layers whose outputs the stages reuse: the last before each halving. 0 is the stem, 1 the first block.
const TAKEN_UP: [usize; 3] = [3, 1, 0];

/// The whole network.
#[derive(Module, Debug)]
pub struct Network {
    stem: Conv2d,
    blocks: Vec<Block>,
    features: Conv2d,
    context: Conv2d,
    stages: Vec<Stage>,
    segment: ConvTranspose2d,
}

impl Network {
    /// A network with uninitialised weights.
    pub fn new(device: &Device) -> Self {
        use Activation::{HardSwish, Relu};
        let shapes = [
            ([16, 16, 16], 3, 2, Some(8), Relu),
            ([16, 72, 24], 3, 2, None, Relu),
            ([24, 88, 24], 3, 1, None, Relu),
            ([24, 96, 32], 5, 2, Some(24), HardSwish),
            ([32, 128, 32], 5, 1, Some(32), HardSwish),
            ([32, 128, 32], 5, 1, Some(32), HardSwish),
            ([32, 96, 32], 5, 1, Some(24), HardSwish),
            ([32, 96, 32], 5, 1, Some(24), HardSwish),
        ]
        .map(|(channels, kernel, stride, gate, activation)| Shape {
            channels,
            kernel,
            stride,
            gate,
            activation,
        });
        Self {
            stem: convolution(3, 16, (3, 2), device),
            blocks: shapes.iter().map(|shape| Block::new(shape, device)).collect(),
            features: convolution(32, 128, POINT, device),
            context: convolution(32, 128, POINT, device),
            stages: [(128, 24), (24, 16), (16, 16)].map(|(from, to)| Stage::new(from, to, device)).into(),
            segment: ConvTranspose2dConfig::new([16, 1], [2, 2]).with_stride([2, 2]).init(device),
        }
    }

    /// `[n, 3, h, w]` encoded RGB in `[0, 1]` → `[n, 1, h, w]` probabilities of a person; h and w are multiples of 16.
    pub fn forward(&self, picture: Tensor<4>) -> Tensor<4> {
        let mut x = Activation::HardSwish.apply(self.stem.forward(picture));
        let mut seen = vec![x.clone()];
        for block in &self.blocks {
            x = block.forward(x);
            seen.push(x.clone());
        }
        let context = activation::sigmoid(self.context.forward(mean(x.clone())));
        let mut x = activation::relu(self.features.forward(x)) * context;
        for (stage, down) in self.stages.iter().zip(TAKEN_UP) {
            x = stage.forward(x, seen[down].clone());
        }
        activation::sigmoid(self.segment.forward(x))
    }
}
