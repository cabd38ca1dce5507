//! Prediction with a trained network: interview frame in, reflectance field out.

use super::checkpoint::{self, CheckpointInfo};
use super::device_field::DeviceField;
use super::field::ReflectanceField;
use super::kernels::{Precision, on_pool};
use super::render::{encode, light, network_input, olats, tensor_from_image, tensor_from_mask};
use super::unet::UNet;
use base::error::{Error, Result};
use base::turn;
use burn::tensor::{DType, Device, FloatDType, Tensor};
use footage::Frame;
use project::Project;
use std::path::Path;

/// A network on a device, ready to predict.
pub struct Predictor {
    network: UNet,
    /// True if the network computes in f16.
    half: bool,
    info: CheckpointInfo,
    device: Device,
}

/// An encoder's features of a picture: `[channels, side, side]`.
pub struct Features {
    pub channels: usize,
    pub side: usize,
    pub values: Vec<f32>,
}

impl Predictor {
    /// Loads the project's checkpoint.
    ///
    /// # Errors
    /// When there is no checkpoint, or its size or number of lamps differs from the project's.
    pub fn open(project: &Project, device: &Device) -> Result<Self> {
        Self::open_at(project, &project.checkpoint_path(), device)
    }

    /// Loads a checkpoint of the project from another folder.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_at(project: &Project, folder: &Path, device: &Device) -> Result<Self> {
        let (info, network) = checkpoint::load(folder, device)?;
        check_fits(&info, project)?;
        Ok(Self::new(network, info, device))
    }

    /// A predictor for a network that is already loaded.
    pub fn new(network: UNet, info: CheckpointInfo, device: &Device) -> Self {
        let half = info.network.precision == Precision::Mixed && predicts_in_half(device);
        Self { network: if half { network.halved() } else { network }, half, info, device: device.clone() }
    }

    /// The checkpoint's table.
    pub fn info(&self) -> &CheckpointInfo {
        &self.info
    }

    /// Features of a frame from the network's encoder, at the lowest resolution with at least `side` values on each side.
    ///
    /// # Errors
    /// When the device fails.
    pub fn features(&self, frame: &Frame, side: usize) -> Result<Features> {
        let _turn = turn::DEVICE.lock();
        let plate = tensor_from_image(&frame.plate, &self.device);
        let mask = tensor_from_mask(&frame.mask, &self.device);
        let input = network_input(encode(plate), mask);
        let network = &self.info.network;
        let block = (network.size / side.max(1)).max(1).ilog2() as usize;
        let block = block.min(network.blocks() - 1);
        let found = if self.half {
            let found = self.network.encoded(input.cast(FloatDType::F16), block);
            found.cast(FloatDType::F32)
        } else {
            self.network.encoded(input, block)
        };
        let [_, channels, side, _] = found.dims();
        let values = found.into_data().try_into_vec::<f32>();
        Ok(Features {
            channels,
            side,
            values: values.map_err(|e| Error::bug(format!("the device gave no features: {e}")))?,
        })
    }

    /// Predicts the OLATs of a frame, zero outside the subject's matte, and leaves them on the device.
    ///
    /// # Errors
    /// When the device fails.
    pub fn predict_on_device(&self, frame: &Frame) -> Result<DeviceField> {
        let _turn = turn::DEVICE.lock();
        DeviceField::finished(on_pool(&self.device, || self.olats(frame)))
    }

    /// OLATs `[lamps, 3, size, size]`.
    fn olats(&self, frame: &Frame) -> Tensor<4> {
        let plate = tensor_from_image(&frame.plate, &self.device);
        let mask = tensor_from_mask(&frame.mask, &self.device);
        let input = network_input(encode(plate.clone()), mask.clone());
        let output = if self.half {
            let input = input.cast(FloatDType::F16);
            self.network.forward(input).cast(FloatDType::F32)
        } else {
            self.network.forward(input)
        };
        let network = &self.info.network;
        let light = light(&plate, network.formulation, self.info.scale);
        // The light of an output of 1 is a single picture: masking it is cheaper than masking all OLATs.
        olats(output, &(light * mask.greater_elem(0.0).float()))
    }

    /// Predicts the OLATs of a frame, zero outside the subject's matte.
    ///
    /// # Errors
    /// When the device fails.
    pub fn predict(&self, frame: &Frame) -> Result<ReflectanceField> {
        self.predict_on_device(frame)?.read()
    }
}

/// True if a network of half precision predicts in f16 on this device: on a GPU whose shaders support it.
pub fn predicts_in_half(device: &Device) -> bool {
    *device != Device::flex() && device.supports_dtype(DType::F16)
}

/// Refuses a checkpoint with a different size or number of lamps.
pub fn check_fits(info: &CheckpointInfo, project: &Project) -> Result<()> {
    let (network, settings) = (&info.network, &project.settings);
    if network.size == settings.size && network.lamps == settings.shoot.lamps.len() {
        return Ok(());
    }
    Err(Error::invalid(
        format!(
            "the network in {} is for {} lamps at {} pixels, but the project has {} lamps at {} pixels",
            project.checkpoint_path().display(),
            network.lamps,
            network.size,
            settings.shoot.lamps.len(),
            settings.size
        ),
        ("Train this project from the start", "afterlight train PROJECT --fresh"),
    ))
}
