//! Few-shot patch-based training (Texler et al. 2020): the relit poses are keyframes. A network trained on
//! random patches of them transfers their look to the frames.
//!
//! A look is a light. The published method trains a network for each; here one network has a head for each, so that all
//! looks share the time. It cannot make looks outside its training.

use super::guide::guide;
use super::learner::{Effort, Spent, draw, learn};
use super::patch_network::PatchNetwork;
use super::poses::{Poses, bright_level, input, subject};
use base::error::{Error, Result};
use base::progress::Progress;
use base::turn;
use burn::module::Module;
use burn::tensor::{Device, Int, Tensor, TensorData};
use footage::Frame;
use imaging::Image;
use rand::RngExt;
use rand::seq::SliceRandom;
use rayon::prelude::*;
use reflectance::render::{decode, encode, tensor_from_image, tensor_from_images, tensor_from_mask};

/// Side of a patch in pixels.
const PATCH: usize = 32;
/// Patches per step.
const BATCH: usize = 16;
/// Looks compared per step.
const LOOKS: usize = 8;
const RATE: f64 = 1e-3;
/// Weight of differences between neighbours, which replace the published perceptual loss.
const EDGES: f32 = 0.5;

/// A network that gives frames the looks of its training.
pub struct PatchStyle {
    network: PatchNetwork,
    /// Factor on each look before encoding.
    gains: Vec<f32>,
    seed: u64,
    device: Device,
    pub spent: Spent,
}

/// A keyframe on the device.
struct Keyframe {
    /// `[1, 6, h, w]`.
    input: Tensor<4>,
    /// `[1, 1, h, w]`.
    mask: Tensor<4>,
    /// Encoded, `[looks, 3, h, w]`.
    looks: Tensor<4>,
    /// Possible centre pixels of patches.
    subject: Vec<usize>,
}

impl PatchStyle {
    /// Learns a look for each of `lights`, which are weights on the poses' OLATs.
    ///
    /// # Errors
    /// When there is no look, the user stops, or training fails.
    pub fn learn(
        poses: &Poses,
        lights: &[Vec<[f32; 3]>],
        effort: &Effort,
        device: &Device,
        progress: &Progress,
    ) -> Result<Self> {
        if lights.is_empty() {
            return Err(Error::missing("there is no light to learn a look from", "Give at least one environment"));
        }
        let autodiff = device.clone().autodiff();
        let relit: Vec<Vec<Image>> =
            (poses.poses.par_iter()).map(|pose| lights.iter().map(|light| pose.relit(light)).collect()).collect();
        let gains: Vec<f32> = (0..lights.len())
            .map(|look| {
                let pixels = poses
                    .poses
                    .iter()
                    .zip(&relit)
                    .flat_map(|(pose, relit)| subject(&pose.mask).flat_map(move |i| relit[look].pixels[i]));
                bright_level(&mut pixels.collect::<Vec<f32>>()).map_or(0.0, |level| 1.0 / level)
            })
            .collect();
        let keyframes: Vec<Keyframe> = (poses.poses.iter().zip(&relit))
            .map(|(pose, relit)| {
                let (mask, guide) = (
                    tensor_from_mask(&pose.mask, &autodiff),
                    tensor_from_image(&guide(&pose.mask, effort.seed), &autodiff),
                );
                let plate = input(tensor_from_image(&pose.plate, &autodiff), &mask);
                Keyframe {
                    input: Tensor::cat(vec![plate, guide], 1),
                    looks: encode(tensor_from_images(relit, &autodiff) * gain(&gains, &autodiff)),
                    mask,
                    subject: subject(&pose.mask).collect(),
                }
            })
            .collect();
        autodiff.seed(effort.seed);
        let network = PatchNetwork::new(&means(&keyframes), &autodiff).materialize();
        let size = poses.size();
        let mut step_loss = |network: &PatchNetwork, step: u64| {
            let batch = Batch::drawn(&keyframes, size, effort.seed, step);
            batch.loss(network)
        };
        let told = ("training on patches", progress);
        let (network, spent) = learn(network, effort, RATE, told, &mut step_loss)?;
        Ok(Self { network, gains, seed: effort.seed, device: device.clone(), spent })
    }

    /// A frame in each learnt look, linear, zero outside the matte.
    ///
    /// # Errors
    /// When the device fails.
    pub fn relit(&self, frame: &Frame) -> Result<Vec<Image>> {
        let _turn = turn::DEVICE.lock();
        let mask = tensor_from_mask(&frame.mask, &self.device);
        let guide = tensor_from_image(&guide(&frame.mask, self.seed), &self.device);
        let plate = input(tensor_from_image(&frame.plate, &self.device), &mask);
        let output = self.network.forward(Tensor::cat(vec![plate, guide], 1), None);
        let [_, _, h, w] = output.dims();
        let inverse = |gain: &f32| if *gain > 0.0 { 1.0 / gain } else { 0.0 };
        let inverses: Vec<f32> = self.gains.iter().map(inverse).collect();
        let looks = decode(output.reshape([self.gains.len(), 3, h, w]));
        images(looks * gain(&inverses, &self.device) * mask.greater_elem(0.0).float())
    }
}

/// Factors on pictures, `[n, 1, 1, 1]`.
fn gain(gains: &[f32], device: &Device) -> Tensor<4> {
    Tensor::<1>::from_floats(gains, device).reshape([gains.len(), 1, 1, 1])
}

/// Pictures `[n, 3, h, w]` in memory.
///
/// # Errors
/// When the device fails.
pub fn images(pictures: Tensor<4>) -> Result<Vec<Image>> {
    let [n, _, h, w] = pictures.dims();
    let values = pictures
        .into_data()
        .try_into_vec::<f32>()
        .map_err(|e| Error::bug(format!("the device returned no pictures: {e}")))?;
    let picture = |n: usize| {
        let plane = |c: usize| &values[(3 * n + c) * h * w..][..h * w];
        let [r, g, b] = [0, 1, 2].map(plane);
        let pixels = r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]);
        Image { width: w, height: h, pixels: pixels.collect() }
    };
    Ok((0..n).map(picture).collect())
}

/// Mean of each look's channels over the keyframes' subjects, encoded.
fn means(keyframes: &[Keyframe]) -> Vec<f32> {
    let channels = keyframes[0].looks.dims()[0] * 3;
    let mut sums = vec![0.0f32; channels];
    for keyframe in keyframes {
        let all = keyframe.mask.clone().sum();
        let inside = (keyframe.looks.clone() * keyframe.mask.clone()).sum_dim(3).sum_dim(2);
        let means = inside.reshape([channels]) / all.clamp_min(1.0);
        let means = means.into_data().try_into_vec::<f32>().unwrap_or_default();
        for (sum, mean) in sums.iter_mut().zip(means) {
            *sum += mean / keyframes.len() as f32;
        }
    }
    sums
}

/// Patches of one step.
struct Batch {
    /// `[n, 6, s, s]`.
    input: Tensor<4>,
    /// `[n, 1, s, s]`.
    mask: Tensor<4>,
    /// `[n, 3·looks, s, s]`.
    truth: Tensor<4>,
    /// Looks that are compared; None means all.
    looks: Option<Vec<usize>>,
}

impl Batch {
    fn drawn(keyframes: &[Keyframe], (w, h): (usize, usize), seed: u64, step: u64) -> Self {
        let mut rng = draw(seed, step, 11);
        let count = keyframes[0].looks.dims()[0];
        let looks = (count > LOOKS).then(|| {
            let mut order: Vec<usize> = (0..count).collect();
            order.shuffle(&mut rng);
            order.truncate(LOOKS);
            order
        });
        let side = PATCH.min(w).min(h);
        let (mut inputs, mut masks, mut truths) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..BATCH {
            let keyframe = &keyframes[rng.random_range(0..keyframes.len())];
            let centre = keyframe.subject[rng.random_range(0..keyframe.subject.len())];
            let start = |at: usize, length: usize| at.saturating_sub(side / 2).min(length - side);
            let (x, y) = (start(centre % w, w), start(centre / w, h));
            let cut = |from: &Tensor<4>| from.clone().narrow(2, y, side).narrow(3, x, side);
            inputs.push(cut(&keyframe.input));
            masks.push(cut(&keyframe.mask));
            let mut truth = cut(&keyframe.looks);
            if let Some(looks) = &looks {
                let named: Vec<i64> = looks.iter().map(|&look| look as i64).collect();
                let device = truth.device().without_autodiff();
                let named = TensorData::new(named, [looks.len()]);
                truth = truth.select(0, Tensor::<1, Int>::from_data(named, &device));
            }
            let looks = truth.dims()[0];
            truths.push(truth.reshape([1, 3 * looks, side, side]));
        }
        Self { input: Tensor::cat(inputs, 0), mask: Tensor::cat(masks, 0), truth: Tensor::cat(truths, 0), looks }
    }

    /// Mean absolute difference inside the matte, plus that of the differences between neighbours.
    fn loss(self, network: &PatchNetwork) -> Tensor<1> {
        let output = network.forward(self.input, self.looks.as_deref());
        let [_, channels, h, w] = output.dims();
        let values = self.mask.clone().sum().clamp_min(1.0) * channels as f32;
        let off = (output - self.truth) * self.mask;
        let mut sum = off.clone().abs().sum();
        if w > 1 && h > 1 {
            let across = off.clone().narrow(3, 1, w - 1) - off.clone().narrow(3, 0, w - 1);
            let down = off.clone().narrow(2, 1, h - 1) - off.narrow(2, 0, h - 1);
            sum = sum + (across.abs().sum() + down.abs().sum()) * EDGES;
        }
        sum / values
    }
}
