//! Checks of a network during training: its prediction of a pose, and outputs that have stopped
//! learning.

use super::data::TrainingSample;
use burn::tensor::Tensor;
use imaging::color::byte_from_unit;
use rayon::prelude::*;
use reflectance::UNet;
use reflectance::UNetConfig;
use reflectance::checkpoint::CheckpointInfo;
use reflectance::render::{encode, encoded_white, light, network_input, olats};

/// A lamp is dead if the slope of its sigmoid, s · (1 − s), is on average below this, a 250th of the
/// maximum: its outputs move a 250th as far in a step …
const DEAD_SLOPE: f32 = 1e-3;
/// … while their error exceeds this share of the truth …
const DEAD_ERROR: f32 = 0.5;
/// … and the truth itself is not black: its mean is above this, in encoded units.
const LIT: f32 = 0.01;

/// Longest side of a displayed picture.
const PICTURE_PX: usize = 256;

/// Prediction of a pose, beside the truth.
pub struct PosePrediction {
    /// Sigmoid outputs, `[lamps, 3, h, w]`.
    outputs: Tensor<4>,
    /// Encoded OLATs of both, `[lamps, 3, h, w]`.
    predicted: Tensor<4>,
    truth: Tensor<4>,
    /// `[1, 1, h, w]`.
    mask: Tensor<4>,
}

impl PosePrediction {
    /// Predicts the pose of `sample` with `network`, which is on the plain device; `gain` brings OLATs to
    /// the exposure of the sample's encoded ones.
    pub fn new(network: &UNet, info: &CheckpointInfo, sample: &TrainingSample, gain: f32) -> Self {
        let plain = |x: &Tensor<4>| x.clone().inner();
        let UNetConfig { lamps, formulation, .. } = info.network;
        let [plate, mask] = [&sample.plate.encoded, &sample.plate.mask].map(plain);
        let [_, _, h, w] = mask.dims();
        let outputs = network.forward(network_input(plate, mask.clone()));
        let light = light(&plain(&sample.plate.linear), formulation, info.scale);
        Self {
            predicted: encode(olats(outputs.clone(), &light) * gain),
            outputs: outputs.reshape([lamps, 3, h, w]),
            truth: plain(&sample.encoded_olats),
            mask,
        }
    }

    /// Width and height of the byte pictures: those of the pose, halved until they are small.
    pub fn picture_size(&self) -> [usize; 2] {
        let ([_, _, h, w], by) = (self.mask.dims(), self.reduction());
        [w / by, h / by]
    }

    fn reduction(&self) -> usize {
        let [_, _, h, w] = self.mask.dims();
        (w.max(h) / PICTURE_PX).max(1)
    }

    /// Encoded OLATs within the matte as bytes, white as 255: `[lamps, h, w, 3]`. None if the device
    /// fails.
    pub fn predicted_bytes(&self) -> Option<Vec<u8>> {
        self.bytes(&self.predicted)
    }

    /// The truth in the same form.
    pub fn truth_bytes(&self) -> Option<Vec<u8>> {
        self.bytes(&self.truth)
    }

    fn bytes(&self, encoded: &Tensor<4>) -> Option<Vec<u8>> {
        let [lamps, _, h, w] = encoded.dims();
        let by = self.reduction();
        let picture = (encoded.clone() * self.mask.clone()).permute([0, 2, 3, 1]);
        let cells = picture.reshape([lamps * h / by, by, w / by, 3 * by]);
        let rows = cells.mean_dim(1).reshape([lamps * h / by, w / by, by, 3]);
        let mean = rows.mean_dim(2);
        let values = read(mean.reshape([-1]))?;
        let white = encoded_white();
        let bytes = values.par_iter().map(|v| byte_from_unit(v / white));
        Some(bytes.collect())
    }

    /// PSNR over the encoded OLATs within the matte in dB, with white as the peak. None if the device
    /// fails.
    pub fn decibels(&self) -> Option<f32> {
        let [lamps, ..] = self.truth.dims();
        let difference = (self.predicted.clone() - self.truth.clone()) * self.mask.clone();
        let values = self.mask.clone().sum() * (3 * lamps) as f32;
        let mean = read((difference.square().sum() / values).reshape([1]))?[0];
        Some(-10.0 * (mean / encoded_white().powi(2)).log10())
    }

    /// Lamps whose outputs are saturated at black or white and far from the truth, so that they hardly learn.
    /// None if the device fails.
    pub fn dead_lamps(&self) -> Option<Vec<usize>> {
        let [lamps, ..] = self.truth.dims();
        let mean = |x: Tensor<4>| {
            let sums = (x * self.mask.clone()).reshape([lamps as i32, -1]).sum_dim(1);
            read((sums / (self.mask.clone().sum().reshape([1, 1]) * 3.0)).reshape([lamps]))
        };
        let slopes = mean(self.outputs.clone() * (self.outputs.clone().neg() + 1.0))?;
        let errors = mean((self.predicted.clone() - self.truth.clone()).abs())?;
        let levels = mean(self.truth.clone())?;
        let dead = |&l: &usize| slopes[l] < DEAD_SLOPE && levels[l] > LIT && errors[l] > DEAD_ERROR * levels[l];
        Some((0..lamps).filter(dead).collect())
    }
}

fn read(values: Tensor<1>) -> Option<Vec<f32>> {
    values.try_into_data().ok()?.try_into_vec().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Device;

    #[test]
    fn lamps_stuck_at_black_or_white_are_dead_and_those_that_are_right_or_learn_are_not() {
        let device = Device::flex();
        // Per lamp: its output, its predicted and its true encoded OLAT.
        let lamps = [
            (1e-5, 0.0, 0.4),
            (1.0 - 1e-5, 2.0, 0.4),
            (1e-5, 0.0, 0.0),
            (1e-5, 0.38, 0.4),
            (0.02, 0.05, 0.4),
            (0.3, 0.4, 0.4),
        ];
        let picture = |pick: fn((f32, f32, f32)) -> f32| {
            let planes = lamps.map(|lamp| Tensor::full([1, 3, 4, 4], pick(lamp), &device));
            Tensor::cat(planes.to_vec(), 0)
        };
        let mut mask = [1.0f32; 16];
        mask[8..].fill(0.0);
        let prediction = PosePrediction {
            outputs: picture(|l| l.0),
            predicted: picture(|l| l.1),
            truth: picture(|l| l.2),
            mask: Tensor::<1>::from_floats(mask, &device).reshape([1, 1, 4, 4]),
        };
        assert_eq!(prediction.dead_lamps(), Some(vec![0, 1]));
    }

    #[test]
    fn pictures_are_interleaved_masked_and_reduced() {
        let device = Device::flex();
        let side = 2 * PICTURE_PX;
        // Lamp l, channel c, row y, column x: white where 3 l + c + y / 2 + x / 2 is odd.
        let white = encoded_white();
        let lit = |i: usize| {
            let (x, y) = (i % side, i / side % side);
            (i / (side * side) + x / 2 + y / 2) % 2 == 1
        };
        let values: Vec<f32> = (0..6 * side * side).map(|i| if lit(i) { white } else { 0.0 }).collect();
        let picture = Tensor::<1>::from_floats(values.as_slice(), &device).reshape([2, 3, side, side]);
        let mut mask = vec![1.0f32; side * side];
        mask[..2 * side].fill(0.0);
        let prediction = PosePrediction {
            outputs: picture.clone(),
            predicted: picture.clone(),
            truth: picture * 0.5,
            mask: Tensor::<1>::from_floats(mask.as_slice(), &device).reshape([1, 1, side, side]),
        };
        assert_eq!(prediction.picture_size(), [PICTURE_PX; 2]);
        let (predicted, truth) = (prediction.predicted_bytes().unwrap(), prediction.truth_bytes().unwrap());
        assert_eq!(predicted.len(), 2 * PICTURE_PX * PICTURE_PX * 3);
        for (i, (&p, &t)) in predicted.iter().zip(&truth).enumerate() {
            let (c, x) = (i % 3, i / 3 % PICTURE_PX);
            let (y, l) = (i / 3 / PICTURE_PX % PICTURE_PX, i / 3 / PICTURE_PX / PICTURE_PX);
            let lit = y > 0 && (3 * l + c + x + y) % 2 == 1;
            assert_eq!((p, t), if lit { (255, 128) } else { (0, 0) }, "{i}");
        }
    }
}
