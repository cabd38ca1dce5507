//! Segmentation of a person from any background: MediaPipe's selfie segmentation (general model, 256 × 256,
//! Apache-2.0; source in `assets/person/NOTICE`).

mod network;
#[cfg(test)]
mod tests;

use base::error::{Error, Result};
use burn::store::{FloatCastAdapter, ModuleStore, SafetensorsStore};
use burn::tensor::{DType, Device, Tensor, TensorData};
use imaging::color::{linear_from_srgb, srgb_from_linear, unit};
use imaging::resample::resize;
use imaging::{Encoded, Image, Mask};
use network::Network;

/// Columns and rows of the network's input.
pub const SIDE: usize = 256;

/// Written by `tools/person_weights.py`.
const WEIGHTS: &[u8] = include_bytes!("../../../assets/person/weights.safetensors");

/// The network with its weights, on the CPU.
pub struct Segmenter {
    network: Network,
    device: Device,
}

impl Segmenter {
    /// # Errors
    /// If the built-in weights do not fit the network: a bug.
    pub fn new() -> Result<Self> {
        let device = Device::flex();
        let mut network = Network::new(&device);
        // The file has half floats.
        let mut store =
            SafetensorsStore::from_bytes(Some(WEIGHTS.to_vec())).with_from_adapter(FloatCastAdapter::to(DType::F32));
        (store.apply_to(&mut network))
            .map_err(|e| Error::bug(format!("cannot read the person network's weights: {e}")))?;
        Ok(Self { network, device })
    }

    /// Probability that each pixel shows a person, in `[0, 1]`, for the whole picture squeezed to [`SIDE`] ×
    /// [`SIDE`] pixels, as in MediaPipe. NaN counts as black.
    ///
    /// # Errors
    /// If the picture has no pixels.
    pub fn probability(&self, picture: &Encoded) -> Result<Mask> {
        let (width, height) = picture.0.size();
        if width * height == 0 {
            return Err(Error::invalid(
                format!("a picture of {width} × {height} pixels cannot show a person"),
                "Give a picture with pixels",
            ));
        }
        let seen = match picture.0.size() {
            (SIDE, SIDE) => picture.0.map(|p| p.map(unit)),
            _ => squeezed(picture),
        };
        let planes: Vec<f32> = (0..3).flat_map(|c| seen.pixels.iter().map(move |p| p[c])).collect();
        let planes = TensorData::new(planes, [1, 3, SIDE, SIDE]);
        let planes = Tensor::from_data(planes, &self.device);
        let pixels = (self.network.forward(planes).into_data())
            .try_into_vec_as::<f32>()
            .map_err(|e| Error::bug(format!("cannot read the person network's output: {e}")))?;
        Ok(Mask { width: SIDE, height: SIDE, pixels })
    }
}

/// The picture at the network's input size, averaged as light.
fn squeezed(picture: &Encoded) -> Image {
    let light = picture.0.map(|p| p.map(|v| linear_from_srgb(unit(v))));
    resize(&light, SIDE, SIDE).map(|p| p.map(srgb_from_linear))
}
