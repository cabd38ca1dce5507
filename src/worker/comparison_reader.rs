//! Reads the OLATs that a frame is compared with: photographs, a truth, or those of another network.

use super::comparison::ComparisonSource;
use base::error::Result;
use calibration::Calibration;
use compositor::Field;
use evaluation::Truth;
use footage::{Exemplar, Frame};
use gpu::ComputeDevice;
use imaging::Response;
use project::Project;
use reflectance::{Predictor, ReflectanceField};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

/// What is needed to read them.
pub(super) struct ComparisonReader {
    project: Project,
    response: Response,
    compute: ComputeDevice,
    /// The networks of the last checkpoints, which take a while to read: two can be compared.
    networks: VecDeque<(PathBuf, Predictor)>,
}

impl ComparisonReader {
    pub fn new(project: &Project, calibration: &Calibration, compute: &ComputeDevice) -> Self {
        Self {
            project: project.clone(),
            response: calibration.response,
            compute: compute.clone(),
            networks: VecDeque::new(),
        }
    }

    /// As [`super::Source::comparison`].
    pub fn find(mut self) -> impl FnMut(&ComparisonSource, usize) -> Result<(Frame, Field)> {
        move |source, index| match source {
            ComparisonSource::Exemplar(pose) => self.exemplar(*pose, index),
            ComparisonSource::Truth(folder) => self.truth(folder, index),
            ComparisonSource::Checkpoint(folder) => self.checkpoint(folder, index),
        }
    }

    /// The photographs of a pose. Its matte stands in for the frame's.
    fn exemplar(&self, pose: usize, index: usize) -> Result<(Frame, Field)> {
        let exemplar = Exemplar::load(&self.project, &self.response, pose)?;
        let mut frame = Frame::load(&self.project, &self.response, index)?;
        frame.mask = exemplar.mask;
        Ok((frame, field(&exemplar.olats)))
    }

    fn truth(&self, folder: &Path, index: usize) -> Result<(Frame, Field)> {
        let truth = Truth::open(&self.project, folder)?;
        let frame = Frame::load(&self.project, &self.response, index)?;
        Ok((frame, field(&truth.olats(index)?)))
    }

    fn checkpoint(&mut self, folder: &Path, index: usize) -> Result<(Frame, Field)> {
        let frame = Frame::load(&self.project, &self.response, index)?;
        if self.networks.iter().all(|(of, _)| of != folder) {
            self.networks.truncate(1);
            let open = || Predictor::open_at(&self.project, folder, &self.compute.device);
            let read = self.compute.guarded(open)?;
            self.networks.push_front((folder.to_path_buf(), read));
        }
        let network = self.networks.iter().position(|(of, _)| of == folder);
        let (_, network) = &self.networks[network.unwrap_or(0)];
        let predicted = self.compute.guarded(|| network.predict(&frame))?;
        Ok((frame, Field::from(predicted).halved()))
    }
}

fn field(olats: &[imaging::Image]) -> Field {
    Field::from(ReflectanceField::from_olats(olats)).halved()
}
