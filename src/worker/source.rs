//! Where predicted frames come from: a project's calibration and network.

use super::comparison::ComparisonSource;
use super::comparison_reader::ComparisonReader;
use super::event::{Blocked, Need};
use base::error::Error;
use calibration::Calibration;
use compositor::{Field, FieldEncoder, Plate};
use footage::Frame;
use gpu::ComputeDevice;
use light::Rig;
use project::Project;
use reflectance::Predictor;

/// A frame of the interview and its OLATs.
pub struct Prediction {
    pub frame: Frame,
    /// The frame's plate; None if pictures have the working size.
    pub plate: Option<Plate>,
    pub field: Field,
}

impl From<(Frame, Field)> for Prediction {
    /// One whose pictures have the working size.
    fn from((frame, field): (Frame, Field)) -> Self {
        Self {
            frame,
            plate: None,
            field,
        }
    }
}

/// Reads a frame by its number and predicts its field.
pub type Predict = Box<dyn FnMut(usize) -> Result<Prediction, Error>>;

/// Finds the OLATs that a frame is compared with.
pub type FindComparison = Box<dyn FnMut(&ComparisonSource, usize) -> Result<Prediction, Error>>;

/// Where predicted frames come from.
pub struct Source {
    pub rig: Rig,
    /// Where the prediction runs, and why.
    pub device: String,
    /// Stays on the thread that made it.
    pub predict: Predict,
    /// What predictions are compared with.
    pub comparison: FindComparison,
}

/// Opens a project's calibration and network.
///
/// # Errors
/// When the shoot, the calibration or the network is missing or cannot be read.
pub fn open_project(project: &Project, compute: &ComputeDevice) -> Result<Source, Blocked> {
    let blocked = |need| {
        move |e: Error| Blocked {
            sentence: e.to_string(),
            need,
        }
    };
    project.check_shoot().map_err(blocked(Some(Need::Shoot)))?;
    // Whatever is wrong with a calibration, another one mends it.
    let calibration = Calibration::load(project).map_err(blocked(Some(Need::Calibration)))?;
    // A network that is there and cannot be used is not replaced unasked.
    let untrained = !project.checkpoint_path().exists();
    let need = untrained.then_some(Need::Network);
    let predictor = compute
        .guarded(|| Predictor::open(project, &compute.device))
        .map_err(blocked(need))?;
    let compute = compute.clone();
    let (project, response) = (project.clone(), calibration.response);
    // In f16 twice as many frames fit into memory.
    let mut encoder = FieldEncoder::default();
    let comparisons = ComparisonReader::new(&project, &calibration, &compute);
    Ok(Source {
        rig: calibration.rig,
        device: compute.description.clone(),
        comparison: Box::new(comparisons.find()),
        predict: Box::new(move |index| {
            let (frame, filmed) = Frame::load_filmed(&project, &response, index)?;
            let field = compute.guarded(|| {
                encoder.encode(predictor.predict_on_device(&frame)?, compute.passes())
            })?;
            let plate = Some(Plate::of(filmed, &frame)?);
            Ok(Prediction {
                frame,
                plate,
                field,
            })
        }),
    })
}
