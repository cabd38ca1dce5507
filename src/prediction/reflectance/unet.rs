//! The U-Net of the paper's section 3.2: from one encoded plate of the interview to all OLATs.

use super::kernels::shape::Shape;
use super::kernels::{self, Activation, Precision};
use base::error::{Error, Result};
use burn::module::{Initializer, Module, ModuleMapper, ModuleVisitor, Param, RunningState};
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::{BatchNorm, BatchNormConfig, GroupNorm, GroupNormConfig, PaddingConfig2d};
use burn::tensor::{DType, Device, FloatDType, Tensor};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Slope of the encoder's leaky ReLU below zero.
const LEAK: f32 = 0.2;

/// Shape of a [`UNet`]; two networks with equal configurations can exchange weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UNetConfig {
    /// Width and height of input and output in pixels, a power of two.
    pub size: usize,
    /// Number of lamps; the output has three channels for each.
    pub lamps: usize,
    /// Blocks of the encoder and of the decoder; None means log2(size) + 1, ten for 512: down to one pixel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<usize>,
    /// Channels of the first block; each further block doubles them …
    pub width: usize,
    /// … up to this many.
    pub most_channels: usize,
    /// Normalisation after the encoder's convolutions.
    pub normalization: Normalization,
    /// Statistics that batch normalisation uses for prediction.
    #[serde(default)]
    pub statistics: Statistics,
    /// Meaning of the sigmoid's output.
    pub formulation: Formulation,
    /// Precision of convolutions on a CPU; `mixed` also predicts in f16 on a GPU.
    #[serde(default)]
    pub precision: Precision,
}

/// Normalisation after a convolution of the encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Normalization {
    /// Batch normalisation as in the paper, left out at 1×1, where one picture has no variance.
    Batch,
    /// Group normalisation over eight groups, left out at 4×4 and below. It is the same in
    /// training and prediction, unlike batch normalisation with one picture per step.
    Group,
    /// None.
    None,
}

/// Mean and variance that batch normalisation uses for prediction. In training, with one picture per step,
/// they are always the picture's own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Statistics {
    /// The picture's own, as in training.
    #[default]
    Own,
    /// Their moving averages from training, as originally published.
    Running,
}

/// Meaning of the sigmoid's output s ∈ (0, 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Formulation {
    /// OLAT = scale · s, as in the paper.
    Direct,
    /// OLAT = scale · s · (plate + ε): the network predicts light transport relative to the interview's
    /// own pixels, which carry the texture.
    Ratio,
}

impl UNetConfig {
    /// Limit on lamps, above any stage. With the widest channels their layer takes half a gigabyte.
    const MOST_LAMPS: usize = 4096;

    /// Number of blocks of the encoder and of the decoder.
    pub fn blocks(&self) -> usize {
        self.depth.unwrap_or(self.most_blocks())
    }

    /// Number of blocks that reduce the picture to one pixel.
    fn most_blocks(&self) -> usize {
        self.size.ilog2() as usize + 1
    }

    /// Channels after encoder block `block`.
    fn channels(&self, block: usize) -> usize {
        (self.width << block).min(self.most_channels.max(self.width))
    }

    /// Convolutions in the order in which a picture passes them.
    pub fn convolutions(&self) -> Vec<Convolution> {
        let mut inputs = 3;
        let mut layers = Vec::new();
        let mut layer = |inputs: usize, outputs: usize, kernel: usize, block: usize| {
            layers.push(Convolution { inputs, outputs, kernel, size: self.size >> block });
        };
        for block in 0..self.blocks() {
            let outputs = self.channels(block);
            layer(inputs, outputs, if block == 0 { 7 } else { 3 }, block);
            inputs = outputs;
        }
        for block in (0..self.blocks() - 1).rev() {
            let outputs = self.channels(block);
            layer(inputs, outputs, 3, block);
            inputs = 2 * outputs;
        }
        layer(inputs, 3 * self.lamps, 3, 0);
        layers
    }

    /// True if a layer multiplies factors of bf16 on this processor.
    pub fn multiplies_bf16(&self) -> bool {
        let rounds = |layer: &Convolution| layer.shape(self.precision).bf16;
        self.convolutions().iter().any(rounds)
    }

    /// Cost of the network, from its shape.
    pub fn cost(&self) -> Cost {
        let mut cost = Cost::default();
        for layer in self.convolutions() {
            cost.parameters += layer.weights() + layer.outputs as u64;
            cost.multiply_adds += layer.multiply_adds();
            // Its input, after resampling, and its output.
            cost.activations += 4 * ((layer.inputs + layer.outputs) * layer.size.pow(2)) as u64;
        }
        for block in 0..self.blocks() {
            if self.normalized(block) != Normalization::None {
                let to = self.channels(block);
                cost.parameters += 2 * to as u64;
                cost.activations += 4 * (to * (self.size >> block).pow(2)) as u64;
            }
        }
        cost
    }

    /// Normalisation after the convolution of this block of the encoder.
    fn normalized(&self, block: usize) -> Normalization {
        let pixels = self.size >> block;
        match self.normalization {
            _ if block == 0 => Normalization::None,
            Normalization::Batch if pixels > 1 => Normalization::Batch,
            Normalization::Group if pixels > 4 => Normalization::Group,
            _ => Normalization::None,
        }
    }

    /// Differences from the requested network `asked`, with the names of `checkpoint.toml`.
    pub fn differences(&self, asked: &Self) -> String {
        let table = |config: &Self| toml::Table::try_from(config).unwrap_or_default();
        let (here, asked) = (table(self), table(asked));
        let keys: BTreeSet<&String> = here.keys().chain(asked.keys()).collect();
        let value = |of: &toml::Table, key: &str| (of.get(key)).map_or("the default".to_owned(), ToString::to_string);
        let different = keys.into_iter().filter(|key| here.get(*key) != asked.get(*key));
        different
            .map(|key| format!("{key} is {}, not {}", value(&here, key), value(&asked, key)))
            .collect::<Vec<_>>()
            .join("; ")
    }

    /// Refuses an invalid configuration.
    pub fn check(&self) -> Result<()> {
        project::check_size(self.size)?;
        let widths = [self.width, self.most_channels];
        if !(1..=Self::MOST_LAMPS).contains(&self.lamps)
            || widths.iter().any(|w| !w.is_multiple_of(8) || !(8..=1024).contains(w))
        {
            return Err(Error::invalid(
                format!(
                    "a network cannot have {} lamps and {} to {} channels: it needs 1 to {} lamps, and \
                     channel counts that are multiples of 8 from 8 to 1024",
                    self.lamps,
                    self.width,
                    self.most_channels,
                    Self::MOST_LAMPS
                ),
                "Choose other channel counts",
            ));
        }
        if !(1..=self.most_blocks()).contains(&self.blocks()) {
            return Err(Error::invalid(
                format!(
                    "a network of {} pixels cannot have a depth of {} blocks, only 1 to {}",
                    self.size,
                    self.blocks(),
                    self.most_blocks()
                ),
                "Choose another depth",
            ));
        }
        Ok(())
    }

    /// A network with fresh weights: the last layer starts small, with its bias at the logit of
    /// `mean_output`, the mean of its target. From the default initialisation it collapses to
    /// black.
    pub fn init(&self, mean_output: f32, device: &Device) -> UNet {
        let convolution = |from: usize, to: usize, kernel: usize| {
            Conv2dConfig::new([from, to], [kernel, kernel]).with_padding(PaddingConfig2d::Explicit(
                kernel / 2,
                kernel / 2,
                kernel / 2,
                kernel / 2,
            ))
        };
        let mut channels = 3;
        let mut encoder = Vec::new();
        for block in 0..self.blocks() {
            let to = self.channels(block);
            let kernel = if block == 0 { 7 } else { 3 };
            let normalized = self.normalized(block);
            encoder.push(EncoderBlock {
                convolution: convolution(channels, to, kernel).init(device),
                batch: (normalized == Normalization::Batch).then(|| BatchNormConfig::new(to).init(device)),
                group: (normalized == Normalization::Group).then(|| GroupNormConfig::new(8, to).init(device)),
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
            .with_initializer(Initializer::Uniform { min: -bound, max: bound })
            .init(device);
        let mean = mean_output.clamp(1e-4, 1.0 - 1e-4);
        let bias = Tensor::full([3 * self.lamps], (mean / (1.0 - mean)).ln(), device);
        output.bias = Some(Param::from_tensor(bias));
        UNet { encoder, decoder, output, precision: self.precision, statistics: self.statistics }
    }
}

/// Shape of a network's convolution for one picture of `size` × `size` pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Convolution {
    pub inputs: usize,
    pub outputs: usize,
    /// Width and height of the kernel.
    pub kernel: usize,
    /// Width and height of input and output.
    pub size: usize,
}

impl Convolution {
    fn weights(&self) -> u64 {
        (self.inputs * self.outputs * self.kernel.pow(2)) as u64
    }

    /// Shape for one picture.
    pub fn shape(&self, precision: Precision) -> Shape {
        Shape {
            batch: 1,
            inputs: self.inputs,
            outputs: self.outputs,
            height: self.size,
            width: self.size,
            kernel: self.kernel,
            bf16: false,
        }
        .with_precision(precision)
    }

    /// Multiply-adds of the result, and of each gradient.
    pub fn multiply_adds(&self) -> u64 {
        self.weights() * (self.size * self.size) as u64
    }
}

/// Cost of a network for one picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    pub parameters: u64,
    /// Multiply-adds in one prediction; a training step has three times as many.
    pub multiply_adds: u64,
    /// Bytes of the layers' inputs and outputs, kept through a training step.
    pub activations: u64,
}

impl Cost {
    /// Peak memory of training in bytes: the kept layers, plus the parameters nine times (themselves,
    /// gradients, both moments of the optimiser, a moving average, and all but the gradients once
    /// more while a checkpoint is written).
    pub fn training_bytes(&self) -> u64 {
        self.activations + 9 * 4 * self.parameters
    }
}

impl std::fmt::Display for Cost {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            out,
            "{:.2} M parameters, {:.1} GFLOP a prediction and {:.1} a training step, about {} MB in training",
            self.parameters as f64 / 1e6,
            2e-9 * self.multiply_adds as f64,
            6e-9 * self.multiply_adds as f64,
            self.training_bytes() / 1_000_000
        )
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
    #[module(skip)]
    precision: Precision,
    #[module(skip)]
    statistics: Statistics,
}

impl UNet {
    /// `[n, 3, size, size]` encoded plates → `[n, 3·lamps, size, size]` sigmoid outputs in (0, 1);
    /// channel `lamp · 3 + c` is colour c of a lamp.
    pub fn forward(&self, plate: Tensor<4>) -> Tensor<4> {
        self.forward_lamps(plate, None)
    }

    /// Features of plates `[n, 3, size, size]` up to and including block `block` of the encoder: `[n, channels, size / 2^block,
    /// …]`.
    pub fn encoded(&self, plate: Tensor<4>, block: usize) -> Tensor<4> {
        let mut x = plate;
        for (i, block) in self.encoder.iter().take(block + 1).enumerate() {
            if i > 0 {
                x = kernels::blur_pool(x);
            }
            x = block.forward(x, self.precision, self.statistics);
        }
        x
    }

    /// The outputs of some lamps; None means all. The last layer is not computed for the others.
    pub fn forward_lamps(&self, plate: Tensor<4>, lamps: Option<&[usize]>) -> Tensor<4> {
        self.compute(plate, lamps, Activation::Sigmoid)
    }

    /// The outputs of some lamps before the sigmoid; None means all.
    pub fn logits(&self, plate: Tensor<4>, lamps: Option<&[usize]>) -> Tensor<4> {
        self.compute(plate, lamps, Activation::None)
    }

    fn compute(&self, plate: Tensor<4>, lamps: Option<&[usize]>, last: Activation) -> Tensor<4> {
        let precision = self.precision;
        let mut skips = Vec::with_capacity(self.encoder.len());
        let mut x = plate;
        for (i, block) in self.encoder.iter().enumerate() {
            if i > 0 {
                skips.push(x.clone());
                x = kernels::blur_pool(x);
            }
            x = block.forward(x, precision, self.statistics);
        }
        let mut skip = None;
        for convolution in &self.decoder {
            x = kernels::upsample(x, skip);
            x = kernels::convolution(x, None, convolution, Activation::LeakyRelu(0.0), precision);
            skip = skips.pop();
        }
        match lamps {
            None => kernels::convolution(x, skip, &self.output, last, precision),
            Some(lamps) => {
                let colours = |&lamp: &usize| (0..3).map(move |colour| 3 * lamp + colour);
                let outputs: Vec<usize> = lamps.iter().flat_map(colours).collect();
                kernels::some_outputs(x, skip, &self.output, &outputs, last, precision)
            }
        }
    }
}

impl UNet {
    /// Batch normalisation's statistics of the pictures so far, `[channels]` each: running means and variances, which every
    /// training pass changes. Empty without batch normalisation.
    pub fn running_statistics(&self) -> Vec<Tensor<1>> {
        let values = self.running().map(|running| running.value_sync());
        values.collect()
    }

    /// Restores the result of [`Self::running_statistics`].
    pub fn set_running_statistics(&self, values: Vec<Tensor<1>>) {
        for (running, value) in self.running().zip(values) {
            running.update(value);
            running.value_sync();
        }
    }

    fn running(&self) -> impl Iterator<Item = &RunningState<Tensor<1>>> {
        let batches = self.encoder.iter().filter_map(|block| block.batch.as_ref());
        batches.flat_map(|batch| [&batch.running_mean, &batch.running_var])
    }

    /// The network with convolutions in f16, for predictions on a GPU: input and output are f16 too.
    /// Normalisation computes in f32.
    pub fn halved(self) -> Self {
        let half = |convolution: Conv2d| convolution.map(&mut Halved);
        let block = |block: EncoderBlock| EncoderBlock { convolution: half(block.convolution), ..block };
        Self {
            encoder: self.encoder.into_iter().map(block).collect(),
            decoder: self.decoder.into_iter().map(half).collect(),
            output: half(self.output),
            ..self
        }
    }
}

/// Makes parameters half floats.
pub(super) struct Halved;

/// Searches for parameters that are NaN or infinite.
struct Finite(bool);

impl ModuleVisitor for Finite {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let values = param.val().into_data().convert::<f32>();
        self.0 &= (values.as_slice::<f32>()).is_ok_and(|values| values.iter().all(|v| v.is_finite()));
    }
}

impl UNet {
    /// True if all parameters are finite.
    pub fn is_finite(&self) -> bool {
        let mut finite = Finite(true);
        self.visit(&mut finite);
        finite.0
    }
}

impl ModuleMapper for Halved {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        param.map(|value| value.cast(FloatDType::F16))
    }
}

impl EncoderBlock {
    fn forward(&self, x: Tensor<4>, precision: Precision, statistics: Statistics) -> Tensor<4> {
        let leak = Activation::LeakyRelu(LEAK);
        match (&self.batch, &self.group) {
            (None, None) => kernels::convolution(x, None, &self.convolution, leak, precision),
            (None, Some(group)) => {
                let x = kernels::convolution(x, None, &self.convolution, Activation::None, precision);
                in_full(x, |x| kernels::group_norm(x, group, LEAK))
            }
            (Some(batch), _) => {
                let x = kernels::convolution(x, None, &self.convolution, Activation::None, precision);
                let own = statistics == Statistics::Own;
                in_full(x, |x| kernels::batch_norm(x, batch, LEAK, own))
            }
        }
    }
}

/// Computes f16 input in f32: f16 ends at 65504, which a sum over a picture exceeds.
fn in_full(x: Tensor<4>, compute: impl FnOnce(Tensor<4>) -> Tensor<4>) -> Tensor<4> {
    if x.dtype() == DType::F16 { compute(x.cast(FloatDType::F32)).cast(FloatDType::F16) } else { compute(x) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cost_counts_every_parameter() {
        for (size, normalization) in [(16, Normalization::Group), (32, Normalization::Batch), (64, Normalization::None)]
        {
            let config = UNetConfig {
                size,
                lamps: 5,
                depth: None,
                width: 8,
                most_channels: 32,
                normalization,
                statistics: Statistics::Own,
                formulation: Formulation::Ratio,
                precision: Precision::Full,
            };
            let network = config.init(0.1, &Device::flex());
            // burn counts the running mean and variance of batch normalisation, which are not trained.
            let running = network.encoder.iter().filter_map(|b| b.batch.as_ref());
            let running: usize = running.map(|b| 2 * b.gamma.dims()[0]).sum();
            let parameters = network.num_params() - running;
            assert_eq!(config.cost().parameters, parameters as u64, "{config:?}");
        }
    }

    #[test]
    fn the_paper_s_network_at_its_size_has_ten_blocks_and_123_outputs() {
        let config = UNetConfig {
            size: 512,
            lamps: 41,
            depth: None,
            width: 32,
            most_channels: 512,
            normalization: Normalization::Batch,
            statistics: Statistics::Own,
            formulation: Formulation::Direct,
            precision: Precision::Full,
        };
        assert_eq!(config.blocks(), 10);
        let layers: u64 = (3 * 32 * 49 + 64 * 123 * 9) * 512 * 512;
        assert!(config.cost().multiply_adds > layers);
    }
}
