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
    encoded(1.0)
}

fn encoded(light: f32) -> f32 {
    (light + OFFSET).powf(POWER) - OFFSET.powf(POWER)
}

/// Light up to which the network sees [`encode`] itself: a stop above white, so that plates from codes, and poses relit to
/// match them, are below.
const KNEE: f32 = 2.0;

/// Input of the network: a plate's [`encode`], bounded where light is brighter than twice white, and cut out by the mask.
/// With k = encode(2) about 1.25, an encoded x above k becomes k + 1 − 1 / (1 + x − k), below k + 1. Other values keep
/// their bits.
pub fn network_input(encoded_plate: Tensor<4>, mask: Tensor<4>) -> Tensor<4> {
    let knee = encoded(KNEE);
    let above = (encoded_plate.clone() - knee).clamp_min(0.0);
    (encoded_plate.clamp_max(knee) + (1.0 - (above + 1.0).recip())) * mask
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
    fn the_network_sees_plates_from_codes_unchanged_and_highlights_bounded() {
        let device = Device::flex();
        let seen = |light: &[f32]| -> Vec<f32> {
            let plate = Tensor::<1>::from_floats(light, &device).reshape([1, 1, 1, light.len()]);
            let mask = plate.ones_like();
            network_input(encode(plate), mask).into_data().try_into_vec().unwrap()
        };
        let plain = |light: &[f32]| -> Vec<f32> {
            encode(Tensor::<1>::from_floats(light, &device)).into_data().try_into_vec().unwrap()
        };
        let codes: Vec<f32> = (0..=1000).map(|i| 0.00199 * i as f32).collect();
        assert_eq!(seen(&codes), plain(&codes));
        let bright = seen(&[1.99, 2.0, 2.01, 4.0, 16.0, 1000.0, 65504.0, f32::INFINITY]);
        assert!(bright.is_sorted(), "{bright:?}");
        let bound = encoded(KNEE) + 1.0;
        assert!(bright.iter().all(|v| v.is_finite() && *v <= bound), "{bright:?}");
        // No corner at the knee.
        let slopes = [bright[1] - bright[0], bright[2] - bright[1]];
        assert!((slopes[1] / slopes[0] - 1.0).abs() < 0.02, "{slopes:?}");
        // 16 is 3.40 encoded.
        assert!((bright[4] - (2.2502 - 1.0 / (1.0 + 3.4041 - 1.2502))).abs() < 1e-3, "{bright:?}");
    }

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
