//! From the network's output to light: meaning of the sigmoid, and the differentiable renderer.

use super::unet::Formulation;
use burn::tensor::{Device, Tensor, TensorData};
use imaging::{Image, Mask};

/// Added to the plate before it is multiplied with a predicted ratio, in units of the interview's
/// linear light (1 = white), so that black pixels can still receive light.
pub const RATIO_FLOOR: f32 = 0.02;

/// Added to linear light before its root is taken.
const OFFSET: f32 = 0.01;
const POWER: f32 = 1.0 / 2.2;

/// Display-like encoding for the network's input and its losses: (x + o)^(1/2.2) − o^(1/2.2).
/// The offset o keeps the slope at black finite: 8.9 at o = 0.01; that of a pure power is infinite.
pub fn encode<const D: usize>(linear: Tensor<D>) -> Tensor<D> {
    (linear.clamp_min(0.0) + OFFSET).powf_scalar(POWER) - OFFSET.powf(POWER)
}

/// Inverse of [`encode`]: linear light, from 0 up.
pub fn decode<const D: usize>(encoded: Tensor<D>) -> Tensor<D> {
    (encoded.clamp_min(0.0) + OFFSET.powf(POWER)).powf_scalar(1.0 / POWER) - OFFSET
}

/// [`encode`] of white, 1: about 0.88. Black stays 0.
pub fn encoded_white() -> f32 {
    (1.0 + OFFSET).powf(POWER) - OFFSET.powf(POWER)
}

/// OLATs of a network's output: `[1, 3·lamps, h, w]` in (0, 1) and the [`light()`] of an
/// output of 1 → linear OLATs `[lamps, 3, h, w]`.
pub fn olats(output: Tensor<4>, light: &Tensor<4>) -> Tensor<4> {
    let [_, channels, h, w] = output.dims();
    output.reshape([channels / 3, 3, h, w]) * light.clone()
}

/// Linear light of an output of 1, `[1, 3, h, w]`.
pub fn light(plate: &Tensor<4>, formulation: Formulation, scale: f32) -> Tensor<4> {
    match formulation {
        Formulation::Direct => plate.ones_like() * scale,
        Formulation::Ratio => (plate.clone().clamp_min(0.0) + RATIO_FLOOR) * scale,
    }
}

/// The differentiable renderer: Σ over lamps of weight times OLAT. `[lamps, 3, h, w]` and
/// `[lamps, 3, 1, 1]` → `[1, 3, h, w]`.
pub fn relight(olats: Tensor<4>, weights: &Tensor<4>) -> Tensor<4> {
    (olats * weights.clone()).sum_dim(0)
}

/// An image as a tensor `[1, 3, h, w]`.
pub fn tensor_from_image(image: &Image, device: &Device) -> Tensor<4> {
    tensor_from_images(std::slice::from_ref(image), device)
}

/// Images of equal size as a tensor `[n, 3, h, w]`.
pub fn tensor_from_images(images: &[Image], device: &Device) -> Tensor<4> {
    let (w, h) = images.first().map_or((0, 0), Image::size);
    let mut planar = Vec::with_capacity(images.len() * 3 * h * w);
    for image in images {
        for channel in 0..3 {
            planar.extend(image.pixels.iter().map(|p| p[channel]));
        }
    }
    Tensor::from_data(TensorData::new(planar, [images.len(), 3, h, w]), device)
}

/// A mask as a tensor `[1, 1, h, w]`.
pub fn tensor_from_mask(mask: &Mask, device: &Device) -> Tensor<4> {
    let data = TensorData::new(mask.pixels.clone(), [1, 1, mask.height, mask.width]);
    Tensor::from_data(data, device)
}

/// Per-lamp RGB weights as a tensor `[lamps, 3, 1, 1]`.
pub fn tensor_from_weights(weights: &[[f32; 3]], device: &Device) -> Tensor<4> {
    let data = TensorData::new(weights.as_flattened().to_vec(), [weights.len(), 3, 1, 1]);
    Tensor::from_data(data, device)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decoding_undoes_encoding() {
        let light = [0.0, 1e-4, 0.01, 0.3, 1.0, 40.0];
        let tensor = Tensor::<1>::from_floats(light, &Device::flex());
        let back = decode(encode(tensor)).into_data().try_into_vec::<f32>().unwrap();
        for (a, b) in back.iter().zip(light) {
            assert!((a - b).abs() < 1e-5 * (1.0 + b), "{a}, not {b}");
        }
    }
}
