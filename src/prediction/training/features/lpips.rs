//! LPIPS: perceptual distance of two pictures, by a network that recognises pictures.
//!
//! Zhang, Isola, Efros, Shechtman and Wang, "The Unreasonable Effectiveness of Deep Features as a Perceptual Metric"
//! (CVPR 2018), version 0.1: at each place of seven layers of SqueezeNet 1.1 the channels are normalised to length 1, their
//! squared differences are weighted by `lpips.lin0` … `lpips.lin6` and summed; the distance is the sum of the layers'
//! means over all places.

use super::network::{Architecture, FeatureNetwork};
use super::weights::WeightFile;
use base::error::{Error, Result};
use burn::tensor::{Device, Tensor, TensorData};
use imaging::Encoded;
use std::path::Path;

/// Channels of the compared layers.
const CHANNELS: [usize; 7] = [64, 128, 256, 384, 384, 512, 512];
/// Guard against a division by zero at a place without signal.
const EPSILON: f32 = 1e-10;

/// The LPIPS measure, with its weights in memory.
pub struct Lpips {
    network: FeatureNetwork,
    /// `[1, channels, 1, 1]` each.
    weights: Vec<Tensor<4>>,
    device: Device,
}

impl Lpips {
    /// Reads the measure from a file with SqueezeNet 1.1 under torchvision's names and the seven `lpips.lin` tensors.
    ///
    /// # Errors
    /// When the file cannot be read, or lacks a tensor.
    pub fn open(path: &Path) -> Result<Self> {
        let device = Device::flex();
        let file = WeightFile::open(path)?;
        if !file.has("features.3.squeeze.weight") || !file.has("lpips.lin0") {
            return Err(Error::invalid(
                format!(
                    "{} cannot measure LPIPS: expected SqueezeNet 1.1 and the tensors lpips.lin0 to lpips.lin6",
                    path.display()
                ),
                ("Give a file with both, or leave it out", "--lpips FILE"),
            ));
        }
        let network = FeatureNetwork::load(Architecture::SqueezeNet, &file, &device)?;
        let weight = |(layer, channels): (usize, usize)| {
            let name = format!("lpips.lin{layer}");
            let weight = file.parameter::<1>(&name, [channels], &device)?;
            Ok(weight.val().reshape([1, channels as i32, 1, 1]))
        };
        let weights = CHANNELS.into_iter().enumerate().map(weight);
        Ok(Self { weights: weights.collect::<Result<_>>()?, network, device })
    }

    /// Distance of two pictures of equal size, at least 16 pixels wide and high: 0 where they are equal, about 0.7 where
    /// they have nothing in common.
    ///
    /// # Errors
    /// When their sizes differ, or they are too small.
    pub fn distance(&self, a: &Encoded, b: &Encoded) -> Result<f64> {
        let (width, height) = a.0.size();
        if b.0.size() != (width, height) || width.min(height) < 16 {
            let (wide, high) = b.0.size();
            return Err(Error::invalid(
                format!("LPIPS cannot compare {width} × {height} pixels with {wide} × {high}"),
                "Give pictures of equal size, at least 16 × 16",
            ));
        }
        let layers = |picture: &Encoded| {
            let pixels = &picture.0.pixels;
            let planes = (0..3).flat_map(|c| pixels.iter().map(move |p| p[c].clamp(0.0, 1.0)));
            let values: Vec<f32> = planes.map(|v| if v.is_nan() { 0.0 } else { v }).collect();
            let data = TensorData::new(values, [1, 3, height, width]);
            self.network.forward(Tensor::from_data(data, &self.device))
        };
        let unit = |x: Tensor<4>| {
            let length = x.clone().square().sum_dim(1).sqrt() + EPSILON;
            x / length
        };
        let pairs = layers(a).into_iter().zip(layers(b));
        let distances = pairs.zip(&self.weights).map(|((a, b), weight)| {
            let squares = (unit(a) - unit(b)).square() * weight.clone();
            f64::from(squares.sum_dim(1).mean().into_scalar::<f32>())
        });
        Ok(distances.sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Raster;

    #[test]
    fn lpips_has_the_published_distances() {
        let Some(folder) = test_support::shared("data/weights") else { return };
        let lpips = Lpips::open(&folder.join("squeezenet1_1_lpips_v0_1.safetensors")).unwrap();
        let read = |name: &str| {
            let picture = image::open(folder.join(name)).unwrap().to_rgb8();
            let size = picture.dimensions();
            Encoded(Raster::from_fn(size.0 as usize, size.1 as usize, |x, y| {
                picture.get_pixel(x as u32, y as u32).0.map(|v| f32::from(v) / 255.0)
            }))
        };
        let reference = read("ex_ref.png");
        // NumPy's result for the same weights and pictures.
        for (name, expected) in [("ex_p0.png", 0.7112), ("ex_p1.png", 0.1479)] {
            let found = lpips.distance(&reference, &read(name)).unwrap();
            println!("{name}: {found:.4}");
            assert!((found - expected).abs() < 2e-3, "{name}: {found}, not {expected}");
        }
        assert_eq!(lpips.distance(&reference, &reference).unwrap(), 0.0);
        let small = Encoded(Raster::filled(8, 8, [0.5; 3]));
        let refused = lpips.distance(&small, &small).unwrap_err().to_string();
        assert!(refused.contains("16 × 16"), "{refused}");
        let black = Encoded(Raster::filled(32, 32, [f32::NAN; 3]));
        let white = Encoded(Raster::filled(32, 32, [1.0; 3]));
        assert!(lpips.distance(&black, &white).unwrap().is_finite());
    }

    #[test]
    fn a_file_without_the_weights_of_lpips_is_refused_with_a_sentence() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("none.safetensors");
        std::fs::write(&path, b"\x02\0\0\0\0\0\0\0{}").unwrap();
        let refused = Lpips::open(&path).err().unwrap().to_string();
        assert!(refused.contains("lpips.lin0"), "{refused}");
    }
}
