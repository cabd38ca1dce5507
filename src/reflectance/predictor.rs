//! A trained network in use: interview frame in, reflectance field out.

use super::checkpoint::{self, CheckpointInfo};
use super::field::ReflectanceField;
use super::render::{encode, light, olats, tensor_from_image, tensor_from_mask};
use super::unet::UNet;
use crate::error::{Error, Result};
use crate::footage::Frame;
use crate::project::Project;
use crate::turn;
use burn::tensor::Device;

/// A network on a device, ready to predict.
pub struct Predictor {
    network: UNet,
    info: CheckpointInfo,
    device: Device,
}

impl Predictor {
    /// Loads the project's checkpoint.
    ///
    /// # Errors
    /// When there is none, or it was trained for another size or another number of lamps.
    pub fn open(project: &Project, device: &Device) -> Result<Self> {
        let folder = project.checkpoint_path();
        let (info, network) = checkpoint::load(&folder, device)?;
        check_fits(&info, project)?;
        Ok(Self {
            network,
            info,
            device: device.clone(),
        })
    }

    /// A predictor over a network at hand.
    pub fn new(network: UNet, info: CheckpointInfo, device: &Device) -> Self {
        Self {
            network,
            info,
            device: device.clone(),
        }
    }

    /// What the checkpoint says of itself.
    pub fn info(&self) -> &CheckpointInfo {
        &self.info
    }

    /// Predicts the OLATs of a frame, zero outside the subject's matte.
    ///
    /// # Errors
    /// When the device fails.
    pub fn predict(&self, frame: &Frame) -> Result<ReflectanceField> {
        let _turn = turn::DEVICE.take();
        let look = tensor_from_image(&frame.plate, &self.device);
        let mask = tensor_from_mask(&frame.mask, &self.device);
        let output = self.network.forward(encode(look.clone()) * mask.clone());
        let network = &self.info.network;
        let light = light(&look, network.formulation, self.info.scale);
        // What an output of 1 stands for is as small as a picture: cheap to mask before it is applied.
        let covered = olats(output, &(light * mask.greater_elem(0.0).float()));
        let data = covered.try_into_data().map_err(|e| device_failure(&e))?;
        let values = data.try_into_vec::<f32>().map_err(|e| device_failure(&e))?;
        let (width, height) = frame.mask.size();
        Ok(ReflectanceField {
            width,
            height,
            lamps: self.info.network.lamps,
            values,
        })
    }
}

/// Refuses a checkpoint that was made for other pictures.
pub fn check_fits(info: &CheckpointInfo, project: &Project) -> Result<()> {
    let (network, settings) = (&info.network, &project.settings);
    if network.size == settings.size && network.lamps == settings.shoot.lamps.len() {
        return Ok(());
    }
    Err(Error::unexpected(
        project.checkpoint_path().display(),
        format!(
            "a network for {} lamps at {} pixels",
            settings.shoot.lamps.len(),
            settings.size
        ),
        format!("one for {} lamps at {} pixels", network.lamps, network.size),
        "Train this project from the start: afterlight train PROJECT --fresh",
    ))
}

fn device_failure(cause: &dyn std::fmt::Debug) -> Error {
    Error::unexpected(
        "the prediction",
        "values from the device",
        format!("{cause:?}"),
        "Try again with --device cpu",
    )
}
