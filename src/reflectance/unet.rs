//! The U-Net of the paper's section 3.2: from one encoded interview look to all OLATs.

use super::kernels::{self, Activation};
use crate::error::{Error, Result};
use burn::module::{Initializer, Module, Param};
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::{BatchNorm, BatchNormConfig, GroupNorm, GroupNormConfig, PaddingConfig2d};
use burn::tensor::{Device, Tensor};
use serde::{Deserialize, Serialize};

/// The slope of the encoder's leaky ReLU below zero.
const LEAK: f32 = 0.2;

/// What shapes a [`UNet`]; two networks with equal configurations can exchange weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UNetConfig {
    /// Width and height of input and output in pixels, a power of two.
    pub size: usize,
    /// Number of lamps; the output has three channels for each.
    pub lamps: usize,
    /// Channels of the first block; each further block doubles them …
    pub width: usize,
    /// … up to this many.
    pub most_channels: usize,
    /// What follows the encoder's convolutions.
    pub normalization: Normalization,
    /// What the sigmoid's output stands for.
    pub formulation: Formulation,
}

/// What follows a convolution of the encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Normalization {
    /// Batch normalisation as in the paper, left out at 1×1, where one picture has no variance.
    Batch,
    /// Group normalisation over eight groups, left out at 4×4 and below. It does not differ between
    /// training and use, which batch normalisation does with one picture a step.
    Group,
    /// None.
    None,
}

/// What the sigmoid's output s ∈ (0, 1) stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Formulation {
    /// OLAT = scale · s, as in the paper.
    Direct,
    /// OLAT = scale · s · (look + ε): the network predicts light transport relative to the interview's
    /// own pixels, which carry the texture.
    Ratio,
}

impl UNetConfig {
    /// Blocks of the encoder and of the decoder: log2(size) + 1, ten for 512.
    pub fn blocks(&self) -> usize {
        self.size.ilog2() as usize + 1
    }

    /// Channels after encoder block `block`.
    fn channels(&self, block: usize) -> usize {
        (self.width << block).min(self.most_channels.max(self.width))
    }

    /// Refuses what no network can be built from.
    pub fn check(&self) -> Result<()> {
        crate::project::check_size(self.size)?;
        let widths = [self.width, self.most_channels];
        if self.lamps == 0
            || widths
                .iter()
                .any(|w| !w.is_multiple_of(8) || !(8..=1024).contains(w))
        {
            return Err(Error::unexpected(
                "the network's shape",
                "at least one lamp, and channel counts that are multiples of 8 from 8 to 1024",
                format!(
                    "{} lamps, {} to {} channels",
                    self.lamps, self.width, self.most_channels
                ),
                "Choose other channel counts",
            ));
        }
        Ok(())
    }

    /// A network with fresh weights: the last layer starts small, with its bias at the logit of
    /// `mean_output`, the mean of what it has to predict. From the default start it falls to black
    /// and does not return.
    pub fn init(&self, mean_output: f32, device: &Device) -> UNet {
        let convolution =
            |from: usize, to: usize, kernel: usize| {
                Conv2dConfig::new([from, to], [kernel, kernel]).with_padding(
                    PaddingConfig2d::Explicit(kernel / 2, kernel / 2, kernel / 2, kernel / 2),
                )
            };
        let mut channels = 3;
        let mut encoder = Vec::new();
        for block in 0..self.blocks() {
            let to = self.channels(block);
            let kernel = if block == 0 { 7 } else { 3 };
            let pixels = self.size >> block;
            let normalized = if block == 0 {
                Normalization::None
            } else {
                self.normalization
            };
            encoder.push(EncoderBlock {
                convolution: convolution(channels, to, kernel).init(device),
                batch: (normalized == Normalization::Batch && pixels > 1)
                    .then(|| BatchNormConfig::new(to).init(device)),
                group: (normalized == Normalization::Group && pixels > 4)
                    .then(|| GroupNormConfig::new(8, to).init(device)),
            });
            channels = to;
        }
        let mut decoder = Vec::new();
        for block in (0..self.blocks() - 1).rev() {
            let to = self.channels(block);
            decoder.push(convolution(channels, to, 3).init(device));
            channels = 2 * to;
        }
        let bound = 0.1 / (channels as f64 * 9.0).sqrt();
        let mut output = convolution(channels, 3 * self.lamps, 3)
            .with_initializer(Initializer::Uniform {
                min: -bound,
                max: bound,
            })
            .init(device);
        let mean = mean_output.clamp(1e-4, 1.0 - 1e-4);
        let bias = Tensor::full([3 * self.lamps], (mean / (1.0 - mean)).ln(), device);
        output.bias = Some(Param::from_tensor(bias));
        UNet {
            encoder,
            decoder,
            output,
        }
    }
}

/// One block of the encoder.
#[derive(Module, Debug)]
pub struct EncoderBlock {
    convolution: Conv2d,
    batch: Option<BatchNorm>,
    group: Option<GroupNorm>,
}

/// The network. L blocks down (the first keeps the resolution, the others blur-pool on entry, down
/// to one pixel), L blocks up with skip connections, the last ending in a sigmoid.
#[derive(Module, Debug)]
pub struct UNet {
    encoder: Vec<EncoderBlock>,
    decoder: Vec<Conv2d>,
    output: Conv2d,
}

impl UNet {
    /// `[n, 3, size, size]` encoded looks → `[n, 3·lamps, size, size]` sigmoid outputs in (0, 1);
    /// channel `lamp · 3 + c` is colour c of a lamp.
    pub fn forward(&self, look: Tensor<4>) -> Tensor<4> {
        let mut skips = Vec::with_capacity(self.encoder.len());
        let mut x = look;
        for (i, block) in self.encoder.iter().enumerate() {
            if i > 0 {
                skips.push(x.clone());
                x = kernels::blur_pool(x);
            }
            x = block.forward(x);
        }
        let mut skip = None;
        for convolution in &self.decoder {
            x = kernels::upsample(x, skip);
            x = kernels::convolution(x, None, convolution, Activation::LeakyRelu(0.0));
            skip = skips.pop();
        }
        kernels::convolution(x, skip, &self.output, Activation::Sigmoid)
    }
}

impl EncoderBlock {
    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let leak = Activation::LeakyRelu(LEAK);
        match (&self.batch, &self.group) {
            (None, None) => kernels::convolution(x, None, &self.convolution, leak),
            (None, Some(group)) => {
                let x = kernels::convolution(x, None, &self.convolution, Activation::None);
                kernels::group_norm(x, group, LEAK)
            }
            (Some(batch), _) => {
                let x = kernels::convolution(x, None, &self.convolution, Activation::None);
                kernels::batch_norm(x, batch, LEAK)
            }
        }
    }
}
