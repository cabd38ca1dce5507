//! Network of Sun et al.: an encoder, a bottleneck that estimates the picture's light and receives the target
//! light, and a decoder with skip connections that makes the picture.
//!
//! Lights are shares of the rig's lamps here, instead of lat-long pictures of 16 × 32 texels: no information of
//! the ground truth is lost. Resolution changes and normalisation follow our own network.

use super::patch_network::{convolution, output_layer};
use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::nn::{GroupNorm, GroupNormConfig, Linear, LinearConfig};
use burn::tensor::{Device, Tensor, activation};
use reflectance::Precision;
use reflectance::kernels::{self, Activation};

/// Channels of the first block, and of the widest.
const WIDTH: usize = 24;
const MOST: usize = 96;
/// Least size of the bottleneck, in pixels.
const BOTTLENECK: usize = 8;
/// Channels of the target light in the bottleneck.
const LIGHT: usize = 96;
const LEAK: f32 = 0.2;
const RELU: Activation = Activation::LeakyRelu(0.0);

/// The network.
#[derive(Module, Debug)]
pub struct PortraitNetwork {
    encoder: Vec<Block>,
    wanted: Vec<Linear>,
    mix: Vec<Conv2d>,
    source: Conv2d,
    decoder: Vec<Conv2d>,
    output: Conv2d,
}

/// A block of the encoder.
#[derive(Module, Debug)]
struct Block {
    convolution: Conv2d,
    norm: Option<GroupNorm>,
}

/// Encoder features of a picture.
pub struct Encoding {
    bottleneck: Tensor<4>,
    /// From full resolution down.
    skips: Vec<Tensor<4>>,
}

impl PortraitNetwork {
    /// Network for pictures of `size` pixels and a rig of this many lamps, whose output starts at `mean`.
    pub fn new(size: usize, lamps: usize, mean: f32, device: &Device) -> Self {
        let layer = |from, to, kernel| convolution(from, to, kernel).init(device);
        let blocks = (size / BOTTLENECK).max(1).ilog2() as usize + 1;
        let channels = |block: usize| (WIDTH << block).min(MOST);
        let mut from = 3;
        let mut encoder = Vec::new();
        for block in 0..blocks {
            let (to, kernel) = (channels(block), if block == 0 { 7 } else { 3 });
            let norm = (block > 0).then(|| GroupNormConfig::new(8, to).init(device));
            let convolution = layer(from, to, kernel);
            encoder.push(Block { convolution, norm });
            from = to;
        }
        let mut decoder = Vec::new();
        let mut above = from;
        for block in (0..blocks - 1).rev() {
            let to = channels(block);
            decoder.push(layer(above, to, 3));
            above = 2 * to;
        }
        Self {
            wanted: vec![
                LinearConfig::new(3 * lamps, LIGHT).init(device),
                LinearConfig::new(LIGHT, LIGHT).init(device),
            ],
            mix: vec![layer(from + LIGHT, from, 3), layer(from, from, 3)],
            source: layer(from, 3 * lamps + 1, 1),
            output: output_layer(above, 3, &[mean; 3], device),
            encoder,
            decoder,
        }
    }

    /// A plate, encoded and cut out, `[1, 3, size, size]`.
    pub fn encode(&self, plate: Tensor<4>) -> Encoding {
        let mut skips = Vec::new();
        let mut x = plate;
        for (i, block) in self.encoder.iter().enumerate() {
            if i > 0 {
                skips.push(x.clone());
                x = kernels::blur_pool(x);
            }
            let activation = match block.norm {
                Some(_) => Activation::None,
                None => Activation::LeakyRelu(LEAK),
            };
            x = kernels::convolution(x, None, &block.convolution, activation, Precision::Auto);
            if let Some(norm) = &block.norm {
                x = kernels::group_norm(x, norm, LEAK);
            }
        }
        Encoding { bottleneck: x, skips }
    }

    /// Estimated light of the plate, `[1, 3·lamps]`: a vote of all places, weighted by confidence.
    pub fn source(&self, encoding: &Encoding) -> Tensor<2> {
        let x = encoding.bottleneck.clone();
        let votes = kernels::convolution(x, None, &self.source, Activation::None, Precision::Auto);
        let [_, channels, h, w] = votes.dims();
        let votes = votes.reshape([channels, h * w]);
        let sure = activation::softmax(votes.clone().narrow(0, channels - 1, 1), 1);
        (votes.narrow(0, 0, channels - 1) * sure).sum_dim(1).reshape([1, channels - 1])
    }

    /// The subject in other lights, `[n, 3·lamps]` → `[n, 3, size, size]` in (0, 1).
    pub fn decode(&self, encoding: &Encoding, lights: Tensor<2>) -> Tensor<4> {
        let [n, _] = lights.dims();
        let [_, _, h, w] = encoding.bottleneck.dims();
        let [first, second] = [&self.wanted[0], &self.wanted[1]];
        let light = activation::leaky_relu(first.forward(lights), f64::from(LEAK));
        let light = activation::leaky_relu(second.forward(light), f64::from(LEAK));
        let light = light.reshape([n, LIGHT, 1, 1]).expand([n, LIGHT, h, w]);
        let layer =
            |x, skip, layer: &Conv2d, activation| kernels::convolution(x, skip, layer, activation, Precision::Auto);
        let every = |x: &Tensor<4>| x.clone().repeat_dim(0, n);
        let mut x = layer(every(&encoding.bottleneck), Some(light), &self.mix[0], RELU);
        x = layer(x, None, &self.mix[1], RELU);
        let mut skips = encoding.skips.iter().rev();
        let mut skip = None;
        for convolution in &self.decoder {
            x = layer(kernels::upsample(x, skip), None, convolution, RELU);
            skip = skips.next().map(every);
        }
        layer(x, skip, &self.output, Activation::Sigmoid)
    }
}
