//! Reads the OLATs of comparisons: photographs, a truth, or predictions with another network or none.

use super::comparison::ComparisonSource;
use super::prediction::Prediction;
use base::error::Result;
use compositor::{Field, Plate};
use evaluation::Truth;
use footage::{Exemplar, Frame};
use gpu::ComputeDevice;
use imaging::Response;
use project::Project;
use reflectance::{Predictor, ReflectanceField};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use transfer::{FineField, OlatPredictor};

/// Inputs of a reader.
pub(super) struct ComparisonReader {
    project: Project,
    response: Response,
    compute: ComputeDevice,
    /// Without a network.
    transfer: OlatPredictor,
    /// With the networks of the last two checkpoints, which are slow to read.
    networks: VecDeque<(PathBuf, Arc<OlatPredictor>)>,
}

impl ComparisonReader {
    pub fn new(project: &Project, response: Response, predictor: &OlatPredictor, compute: &ComputeDevice) -> Self {
        Self {
            project: project.clone(),
            response,
            compute: compute.clone(),
            transfer: predictor.corrected_by(None),
            networks: VecDeque::new(),
        }
    }

    /// As [`super::Source::comparison`].
    pub fn find(mut self) -> impl FnMut(&ComparisonSource, usize) -> Result<Prediction> {
        move |source, index| match source {
            ComparisonSource::Exemplar(pose) => self.exemplar(*pose, index),
            ComparisonSource::Truth(folder) => self.truth(folder, index),
            ComparisonSource::Checkpoint(folder) => {
                let predictor = self.checkpoint(folder)?;
                self.predicted(&predictor, index)
            }
            ComparisonSource::Transfer => self.predicted(&self.transfer, index),
        }
    }

    /// The photographs of a pose, with the pose's matte in place of the frame's.
    fn exemplar(&self, pose: usize, index: usize) -> Result<Prediction> {
        let exemplar = Exemplar::load(&self.project, &self.response, pose)?;
        let (mut frame, plate) = self.frame(index)?;
        frame.mask = exemplar.mask;
        Ok(Prediction {
            // The pose differs from the frame's, so the plate's detail does not apply.
            plate: Some(plate.without_detail(&frame.mask)?),
            frame,
            field: field(&exemplar.olats),
        })
    }

    fn frame(&self, index: usize) -> Result<(Frame, Plate)> {
        let (frame, filmed) = Frame::load_filmed(&self.project, &self.response, index)?;
        let plate = Plate::from_filmed(filmed, &frame)?;
        Ok((frame, plate))
    }

    fn truth(&self, folder: &Path, index: usize) -> Result<Prediction> {
        let truth = Truth::open(&self.project, folder)?;
        let (frame, plate) = self.frame(index)?;
        Ok(Prediction { frame, plate: Some(plate), field: field(&truth.olats(index)?) })
    }

    fn checkpoint(&mut self, folder: &Path) -> Result<Arc<OlatPredictor>> {
        if let Some((_, read)) = self.networks.iter().find(|(of, _)| of == folder) {
            return Ok(read.clone());
        }
        let open = || Predictor::open_at(&self.project, folder, &self.compute.device);
        let network = self.compute.guarded(open)?;
        let predictor = Arc::new(self.transfer.corrected_by(Some(network)));
        self.networks.truncate(1);
        self.networks.push_front((folder.to_path_buf(), predictor.clone()));
        Ok(predictor)
    }

    fn predicted(&self, predictor: &OlatPredictor, index: usize) -> Result<Prediction> {
        let (frame, plate) = self.frame(index)?;
        let (predicted, fine) = self.compute.guarded(|| {
            let (field, fine) = predictor.predict_fine(&frame)?;
            Ok((field.read()?, fine))
        })?;
        Ok(Prediction { frame, plate: Some(FineField::on(fine, plate)), field: Field::from(predicted).halved() })
    }
}

fn field(olats: &[imaging::Image]) -> Field {
    Field::from(ReflectanceField::from_olats(olats)).halved()
}
