//! OLATs of the interview's frames: the exemplars carried over, corrected by the project's network where there is one.

use crate::beside::Beside;
use crate::blend::Carried;
use crate::detail::{ExemplarDetail, FineField, SharedDetail};
use crate::transfer::Transfer;
use base::error::Result;
use calibration::Calibration;
use footage::Frame;
use project::Project;
use reflectance::{Device, DeviceField, Predictor, ReflectanceField};
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// Share of a trained network in the mean of network and transfer where exemplars explain the frame: errors of both are unlike.
/// docs/method.md has the figures.
const NETWORK_SHARE: f32 = 0.1;
/// Addition to the share where no exemplar explains the frame.
const UNKNOWN_SHARE: f32 = 0.5;
/// [`Carried::unlike`] at which it is larger by half of that.
const UNLIKE: f32 = 0.8;
/// Steps of training after which the network has its whole share. Before, it has learnt less than the exemplars show.
const FULL_STEPS: f32 = 3000.0;

/// The prediction that is shown, exported and judged.
pub struct OlatPredictor {
    transfer: Arc<Transfer>,
    network: Option<Predictor>,
    device: Device,
    detail: Option<SharedDetail>,
    beside: Option<Arc<Beside>>,
}

impl OlatPredictor {
    /// Reads the exemplars, and the network if one is trained.
    ///
    /// # Errors
    /// When a picture cannot be read, or the project's network does not fit it.
    pub fn open(project: &Project, calibration: &Calibration, device: &Device) -> Result<Self> {
        let transfer = Arc::new(Transfer::open(project, calibration)?);
        Self::with_transfer(transfer, project, device)
    }

    /// Reads the network beside exemplars that are read already.
    ///
    /// # Errors
    /// When the project's network does not fit it.
    pub fn with_transfer(transfer: Arc<Transfer>, project: &Project, device: &Device) -> Result<Self> {
        let trained = project.checkpoint_path().exists();
        let network = trained.then(|| Predictor::open(project, device));
        Ok(Self::new(transfer, network.transpose()?, device))
    }

    /// Reads the exemplars, and the network of a checkpoint's folder if one is given.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_at(
        project: &Project,
        calibration: &Calibration,
        checkpoint: Option<&Path>,
        device: &Device,
    ) -> Result<Self> {
        let network = checkpoint.map(|folder| Predictor::open_at(project, folder, device));
        let transfer = Arc::new(Transfer::open(project, calibration)?);
        Ok(Self::new(transfer, network.transpose()?, device))
    }

    fn new(transfer: Arc<Transfer>, network: Option<Predictor>, device: &Device) -> Self {
        Self { transfer, network, device: device.clone(), detail: None, beside: None }
    }

    /// The same exemplars corrected by another network, or by none.
    #[must_use]
    pub fn corrected_by(&self, network: Option<Predictor>) -> Self {
        Self {
            detail: self.detail.clone(),
            beside: self.beside.clone(),
            ..Self::new(self.transfer.clone(), network, &self.device)
        }
    }

    /// The same with the exemplars as they were photographed, for pictures at the plate's size.
    ///
    /// # Errors
    /// When a picture cannot be read.
    pub fn with_detail(self, project: &Project, calibration: &Calibration) -> Result<Self> {
        let detail = OnceLock::from(ExemplarDetail::read(project, calibration)?);
        Ok(self.sharing(Arc::new(detail)))
    }

    /// The same with exemplars that may still be read.
    #[must_use]
    pub fn sharing(self, detail: SharedDetail) -> Self {
        Self { detail: Some(detail), ..self }
    }

    /// The same for frames of the interview, whose places in the exemplars follow the motion from frame to frame.
    #[must_use]
    pub fn steady(self, project: &Project, calibration: &Calibration) -> Self {
        let beside = Beside::new(project, calibration.response);
        Self { beside: Some(Arc::new(beside)), ..self }
    }

    /// The same without one exemplar, by its number in the project.
    #[must_use]
    pub fn without(self, pose: usize) -> Self {
        Self { transfer: Arc::new(self.transfer.without(pose)), beside: None, ..self }
    }

    /// The project's network; None before any training.
    pub fn network(&self) -> Option<&Predictor> {
        self.network.as_ref()
    }

    /// The exemplars.
    pub fn transfer(&self) -> &Transfer {
        &self.transfer
    }

    /// Bytes of the exemplars in memory.
    pub fn bytes(&self) -> usize {
        let detail = self.detail.as_ref().and_then(|detail| detail.get());
        let detail = detail.and_then(Option::as_ref);
        self.transfer.bytes() + detail.map_or(0, ExemplarDetail::bytes)
    }

    /// A sentence on the source of the OLATs.
    pub fn sentence(&self) -> &'static str {
        match self.network {
            Some(_) => "OLATs: poses carried over, corrected by the trained network",
            None => "OLATs: poses carried over. No network is trained yet",
        }
    }

    /// The exemplars carried over to a frame.
    pub fn carry(&self, frame: &Frame) -> Carried {
        match &self.beside {
            Some(beside) => beside.carry(&self.transfer, frame),
            None => self.transfer.carry(frame),
        }
    }

    /// Predicts the OLATs of a frame, zero outside its matte, and leaves them on the network's device. Under the interview's
    /// light they sum to the frame.
    ///
    /// # Errors
    /// When the device fails.
    pub fn predict_on_device(&self, frame: &Frame) -> Result<DeviceField> {
        self.corrected(self.carry(frame), frame)
    }

    /// [`Self::predict_on_device`], with the light of the frame's plate that is finer than that.
    ///
    /// # Errors
    /// When the device fails.
    pub fn predict_fine(&self, frame: &Frame) -> Result<(DeviceField, Option<FineField>)> {
        let carried = self.carry(frame);
        let fine = self.fine(&carried);
        Ok((self.corrected(carried, frame)?, fine))
    }

    /// The fine light of a frame that is carried over; None without exemplars as they were photographed.
    pub fn fine(&self, carried: &Carried) -> Option<FineField> {
        Some(FineField {
            exemplars: self.detail.clone()?,
            places: carried.places.clone(),
            working: carried.field.width,
        })
    }

    /// Predicts the OLATs of a pose of the project from the other poses: no pose explains itself.
    ///
    /// # Errors
    /// When the device fails.
    pub fn predict_without(&self, frame: &Frame, pose: usize) -> Result<ReflectanceField> {
        self.corrected(self.transfer.without(pose).carry(frame), frame)?.read()
    }

    fn corrected(&self, carried: Carried, frame: &Frame) -> Result<DeviceField> {
        match &self.network {
            None => DeviceField::upload(&carried.field, &self.device),
            Some(network) => {
                let steps = network.info().step;
                let share = carried.unlike.map(|unlike| network_share(unlike, steps));
                let field = network.predict_on_device(frame)?;
                field.mixed(&carried.field, &share)?.summing_to(&frame.plate, self.transfer.weights())
            }
        }
    }

    /// Predicts the OLATs of a frame into memory.
    ///
    /// # Errors
    /// When the device fails.
    pub fn predict(&self, frame: &Frame) -> Result<ReflectanceField> {
        match self.network {
            None => Ok(self.carry(frame).field),
            Some(_) => self.predict_on_device(frame)?.read(),
        }
    }
}

/// Share of a network after some steps of training where a frame is so [unlike](Carried::unlike) the exemplars.
fn network_share(unlike: f32, steps: u64) -> f32 {
    let square = unlike * unlike;
    let unknown = square / (square + UNLIKE * UNLIKE);
    (steps as f32 / FULL_STEPS).min(1.0) * (NETWORK_SHARE + UNKNOWN_SHARE * unknown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_network_counts_most_where_no_exemplar_is_like_the_frame() {
        let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-3, "{a} is not {b}");
        close(network_share(0.0, 3000), 0.1);
        close(network_share(0.8, 3000), 0.35);
        close(network_share(20.0, 9000), 0.6);
        close(network_share(20.0, 300), 0.06);
        close(network_share(20.0, 0), 0.0);
    }
}
