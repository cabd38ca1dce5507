//! Feature networks, up to the last compared layer, with frozen weights.

use super::weights::WeightFile;
use base::error::Result;
use burn::module::Module;
use burn::nn::PaddingConfig2d;
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::pool::{MaxPool2d, MaxPool2dConfig};
use burn::tensor::{Device, Tensor, activation};
use reflectance::kernels::{self, Activation, Precision};

/// Mean and standard deviation of ImageNet's pictures, by which torchvision's networks normalise their input.
const MEAN: [f32; 3] = [0.485, 0.456, 0.406];
const DEVIATION: [f32; 3] = [0.229, 0.224, 0.225];

const RELU: Activation = Activation::LeakyRelu(0.0);
/// Precision whose error is far below the differences between features.
const PRECISION: Precision = Precision::Full;

/// Architecture, recognised by its tensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Architecture {
    Vgg16,
    Vgg19,
    SqueezeNet,
}

impl Architecture {
    /// Architecture of the network in `file`.
    ///
    /// # Errors
    /// When the file holds none of these networks.
    pub fn from_file(file: &WeightFile) -> Result<Self> {
        // VGG-19 has its eighth convolution where the others have their third pooling.
        let known = [
            ("features.3.squeeze.weight", Self::SqueezeNet),
            ("features.16.weight", Self::Vgg19),
            ("features.17.weight", Self::Vgg16),
        ];
        known.into_iter().find_map(|(name, network)| file.has(name).then_some(network)).ok_or_else(|| file.unknown())
    }

    /// Common name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vgg16 => "VGG-16",
            Self::Vgg19 => "VGG-19",
            Self::SqueezeNet => "SqueezeNet 1.1",
        }
    }
}

/// A network up to its last compared layer.
#[derive(Module, Debug)]
pub struct FeatureNetwork {
    /// Stages; the last layer of each is compared.
    stages: Vec<Vec<Layer>>,
}

/// A layer, its ReLU included.
#[derive(Module, Debug)]
#[expect(clippy::large_enum_variant, reason = "a network has a dozen layers, and their weights are on the heap")]
pub enum Layer {
    /// Stride 1, and the picture keeps its size.
    Convolution(Conv2d),
    /// Stride 2, and no zeros around the picture.
    Strided(Conv2d),
    Fire(Fire),
    Pool(MaxPool2d),
}

/// SqueezeNet's fire module: few channels, expanded by 1×1 and 3×3 convolutions.
#[derive(Module, Debug)]
pub struct Fire {
    squeeze: Conv2d,
    expand1x1: Conv2d,
    expand3x3: Conv2d,
}

impl FeatureNetwork {
    /// Reads the network in `file`.
    ///
    /// # Errors
    /// When a tensor is missing or does not have the architecture's shape.
    pub fn load(architecture: Architecture, file: &WeightFile, device: &Device) -> Result<Self> {
        let stages = match architecture {
            // Up to relu4_3, and up to relu4_4.
            Architecture::Vgg16 => vgg([2, 2, 3, 3], file, device),
            Architecture::Vgg19 => vgg([2, 2, 4, 4], file, device),
            Architecture::SqueezeNet => squeezenet(file, device),
        };
        Ok(Self { stages: stages? })
    }

    /// Compared layers of pictures `[n, 3, h, w]` in display codes, 0 black and 1
    /// white: `[n, channels, h', w']` each. Pictures too small for a pooling have fewer.
    pub fn forward(&self, pictures: Tensor<4>) -> Vec<Tensor<4>> {
        let device = pictures.device();
        let colour = |values: [f32; 3]| Tensor::<1>::from_floats(values, &device);
        let [mean, deviation] = [MEAN, DEVIATION].map(|v| colour(v).reshape([1, 3, 1, 1]));
        let mut x = (pictures - mean) / deviation;
        let mut compared = Vec::with_capacity(self.stages.len());
        for stage in &self.stages {
            for layer in stage {
                if matches!(layer, Layer::Pool(_)) && x.dims()[2..].contains(&1) {
                    return compared;
                }
                x = layer.forward(x);
            }
            compared.push(x.clone());
        }
        compared
    }
}

impl Layer {
    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        match self {
            Self::Convolution(layer) => kernels::convolution(x, None, layer, RELU, PRECISION),
            Self::Strided(layer) => activation::relu(layer.forward(x)),
            Self::Fire(fire) => fire.forward(x),
            Self::Pool(pool) => pool.forward(x),
        }
    }
}

impl Fire {
    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let x = kernels::convolution(x, None, &self.squeeze, RELU, PRECISION);
        let expanded = [&self.expand1x1, &self.expand3x3]
            .map(|layer| kernels::convolution(x.clone(), None, layer, RELU, PRECISION));
        Tensor::cat(expanded.to_vec(), 1)
    }
}

/// A convolution with the weights under `name`.
fn convolution(
    file: &WeightFile,
    name: &str,
    [inputs, outputs, kernel]: [usize; 3],
    device: &Device,
) -> Result<Conv2d> {
    let pad = kernel / 2;
    let mut layer = Conv2dConfig::new([inputs, outputs], [kernel, kernel])
        .with_padding(PaddingConfig2d::Explicit(pad, pad, pad, pad))
        .init(device);
    let shape = [outputs, inputs, kernel, kernel];
    layer.weight = file.parameter(&format!("{name}.weight"), shape, device)?;
    layer.bias = Some(file.parameter(&format!("{name}.bias"), [outputs], device)?);
    Ok(layer)
}

/// Stages of 3×3 convolutions with 64, 128, 256 and 512 channels, halved in size between them. As in
/// torchvision's list a convolution, its ReLU and a pooling count one each.
fn vgg(convolutions: [usize; 4], file: &WeightFile, device: &Device) -> Result<Vec<Vec<Layer>>> {
    let (mut index, mut channels) = (0, 3);
    let mut stages = Vec::new();
    for (stage, count) in convolutions.into_iter().enumerate() {
        let mut layers = Vec::new();
        if stage > 0 {
            layers.push(Layer::Pool(MaxPool2dConfig::new([2, 2]).init()));
            index += 1;
        }
        for _ in 0..count {
            let shape = [channels, 64 << stage, 3];
            let layer = convolution(file, &format!("features.{index}"), shape, device)?;
            layers.push(Layer::Convolution(layer));
            (index, channels) = (index + 2, 64 << stage);
        }
        stages.push(layers);
    }
    Ok(stages)
}

/// The first convolution, and fire modules 4, 7 and 9 to 12 of torchvision's list: the layers of LPIPS.
fn squeezenet(file: &WeightFile, device: &Device) -> Result<Vec<Vec<Layer>>> {
    let fire = |index: usize, [inputs, squeezed, expanded]: [usize; 3]| {
        let layer = |part: &str, shape| convolution(file, &format!("features.{index}.{part}"), shape, device);
        Ok(Layer::Fire(Fire {
            squeeze: layer("squeeze", [inputs, squeezed, 1])?,
            expand1x1: layer("expand1x1", [squeezed, expanded, 1])?,
            expand3x3: layer("expand3x3", [squeezed, expanded, 3])?,
        }))
    };
    let pool = || {
        let pool = MaxPool2dConfig::new([3, 3]).with_strides([2, 2]);
        Layer::Pool(pool.with_ceil_mode(true).init())
    };
    let mut first = convolution(file, "features.0", [3, 64, 3], device)?;
    (first.stride, first.padding) = ([2, 2], PaddingConfig2d::Valid);
    Ok(vec![
        vec![Layer::Strided(first)],
        vec![pool(), fire(3, [64, 16, 64])?, fire(4, [128, 16, 64])?],
        vec![pool(), fire(6, [128, 32, 128])?, fire(7, [256, 32, 128])?],
        vec![pool(), fire(9, [256, 48, 192])?],
        vec![fire(10, [384, 48, 192])?],
        vec![fire(11, [384, 64, 256])?],
        vec![fire(12, [512, 64, 256])?],
    ])
}
