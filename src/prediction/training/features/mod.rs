//! Perceptual features: pictures compared by the layers of a recognition network, with weights
//! from a file.

mod cache;
mod lpips;
mod network;
#[cfg(test)]
mod tests;
mod weights;

pub use cache::{PictureId, PictureKind, rows};
pub use lpips::Lpips;
pub use network::{Architecture, FeatureNetwork};
pub use weights::WeightFile;

use base::error::Result;
use burn::tensor::module::adaptive_avg_pool2d;
use burn::tensor::{Device, Tensor, TensorData};
use cache::FeatureCache;
use reflectance::render::encoded_white;
use std::path::Path;

/// Added under the root: ‖x‖ becomes √(‖x‖² + ε²), whose gradient at zero error is 0 instead of 0/0.
/// In units of encoded values: far below one 8-bit step.
pub const EPSILON: f32 = 1e-4;

/// Pixels whose gradients are computed at once: four pictures of 128 × 128, for which VGG-16 holds about
/// 80 MB. A larger picture is computed alone.
const PIXELS_AT_ONCE: usize = 1 << 16;

/// Features of a network from a file.
pub struct Features {
    architecture: Architecture,
    network: FeatureNetwork,
    /// Inverse of each layer's root mean square over a fixed picture. The layers' levels differ by up
    /// to a factor of fifty; these factors make them count alike.
    gains: Vec<f32>,
    known: FeatureCache,
}

impl Features {
    /// Reads the network in a `.safetensors` or `.pth` file.
    ///
    /// # Errors
    /// When the file cannot be read, or holds a network other than VGG-16, VGG-19 or SqueezeNet 1.1.
    pub fn open(path: &Path, device: &Device) -> Result<Self> {
        let file = WeightFile::open(path)?;
        let architecture = Architecture::from_file(&file)?;
        let network = FeatureNetwork::load(architecture, &file, device)?;
        let level = |layer: Tensor<4>| layer.square().mean().sqrt().into_scalar::<f32>();
        let levels = network.forward(reference(device)).into_iter().map(level);
        Ok(Self {
            architecture,
            gains: levels.map(|level| 1.0 / level.max(1e-6)).collect(),
            network,
            known: FeatureCache::default(),
        })
    }

    /// Architecture of the network.
    pub fn architecture(&self) -> Architecture {
        self.architecture
    }

    /// Mean distance between encoded pictures `[n, 3, h, w]` and true ones, where `mask`,
    /// `[1, 1, h, w]`, is not 0; h and w are at least 3. True pictures with the same name must be
    /// identical each time, and so must their masks.
    ///
    /// The term of a layer is √(Σ (mask · difference)² / values + ε²), where `values` is the subject's share
    /// of the layer's values, in units of the layer's level; the distance is the mean over layers.
    pub fn distance(
        &mut self,
        predicted: Tensor<4>,
        truth: Tensor<4>,
        mask: &Tensor<4>,
        names: Option<&[PictureId]>,
    ) -> Tensor<1> {
        let [pictures, _, h, w] = predicted.dims();
        let shown = mask.clone() / encoded_white();
        let (predicted, truth) = (predicted * shown.clone(), truth * shown);
        let share = mask.clone().sum().clamp_min(1.0) / (h * w) as f32;
        let at_once = (PIXELS_AT_ONCE / (h * w)).max(1);
        let mut distance = share.zeros_like();
        let mut slopes = Vec::new();
        for first in (0..pictures).step_by(at_once) {
            let count = at_once.min(pictures - first);
            let part = |x: &Tensor<4>| x.clone().narrow(0, first, count);
            let truth = match names {
                Some(names) => {
                    let names = &names[first..first + count];
                    self.known.layers(&self.network, part(&truth), names)
                }
                None => self.network.forward(part(&truth)),
            };
            let x = part(&predicted).detach();
            if !x.device().is_autodiff() {
                distance = distance + self.distances(x, truth, mask, &share);
                continue;
            }
            let x = x.require_grad();
            let part = self.distances(x.clone(), truth, mask, &share);
            distance = distance + part.clone().detach();
            let slope = x.grad(&part.backward());
            slopes.push(slope.unwrap_or_else(|| x.clone().inner().zeros_like()));
        }
        if !slopes.is_empty() {
            // Value and gradient are known, so the intermediate layers of all pictures need not be kept.
            let tangent = (predicted * Tensor::from_inner(Tensor::cat(slopes, 0))).sum();
            distance = distance + (tangent.clone() - tangent.detach());
        }
        distance / pictures as f32
    }

    /// Sum of the distances of pictures.
    fn distances(&self, predicted: Tensor<4>, truth: Vec<Tensor<4>>, mask: &Tensor<4>, share: &Tensor<1>) -> Tensor<1> {
        let predicted = self.network.forward(predicted);
        let layers = predicted.len() as f32;
        let mut sum = share.zeros_like();
        for ((predicted, truth), gain) in predicted.into_iter().zip(truth).zip(&self.gains) {
            let [n, c, h, w] = predicted.dims();
            let coverage = adaptive_avg_pool2d(mask.clone(), [h, w]).square();
            let squares = (predicted - truth).square().sum_dim(1) * coverage;
            let squares = squares.reshape([n, h * w]).sum_dim(1).reshape([n]);
            let mean = squares * (gain * gain) / (share.clone() * (c * h * w) as f32);
            sum = sum + (mean + EPSILON * EPSILON).sqrt().sum();
        }
        sum / layers
    }
}

/// A test picture of waves of 1 to 32 periods, with the spectrum of natural pictures: `[1, 3, 64, 64]`.
fn reference(device: &Device) -> Tensor<4> {
    const SIZE: usize = 64;
    let place = |i: usize| (i as f32 + 0.5) / SIZE as f32;
    let value = |i: usize| {
        let (colour, y, x) = (i / (SIZE * SIZE), place(i / SIZE % SIZE), place(i % SIZE));
        let waves = (0..6).map(|octave| {
            let (periods, turn) = ((1 << octave) as f32, 2.4 * octave as f32);
            let phase = periods * (x * turn.cos() + y * turn.sin()) * std::f32::consts::TAU;
            0.25 / periods.sqrt() * (phase + turn + 0.5 * colour as f32).cos()
        });
        (0.5 + waves.sum::<f32>()).clamp(0.0, 1.0)
    };
    let values: Vec<f32> = (0..3 * SIZE * SIZE).map(value).collect();
    Tensor::from_data(TensorData::new(values, [1, 3, SIZE, SIZE]), device)
}
