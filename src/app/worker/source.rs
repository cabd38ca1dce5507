//! Source of predicted frames: a project's calibration, exemplars and network.

use super::comparison::ComparisonSource;
use super::comparison_reader::ComparisonReader;
use super::event::{Blocked, Need};
use super::prediction::Prediction;
use base::error::Error;
use calibration::Calibration;
use compositor::{FieldEncoder, Plate};
use footage::Frame;
use gpu::ComputeDevice;
use light::Rig;
use project::Project;
use std::sync::Arc;
use std::time::SystemTime;
use transfer::{ExemplarDetail, FineField, OlatPredictor, SharedDetail, Transfer};

/// Reads a frame by its number and predicts its field.
pub type Predict = Box<dyn FnMut(usize) -> Result<Prediction, Error>>;

/// Finds the OLATs to compare with a frame.
pub type FindComparison = Box<dyn FnMut(&ComparisonSource, usize) -> Result<Prediction, Error>>;

/// Source of predicted frames.
pub struct Source {
    pub rig: Rig,
    /// Device that runs the prediction, and the reason for it.
    pub device: String,
    /// Stays on the thread that created it.
    pub predict: Predict,
    /// Finds counterparts for a comparison with predictions.
    pub comparison: FindComparison,
    /// Work to do after opening, beside predictions. If it returns true, the source is opened again for better
    /// predictions. Errors are shown.
    pub later: Option<Later>,
}

/// Work beside predictions.
pub type Later = Box<dyn FnOnce() -> Result<bool, Error> + Send>;

/// Exemplars kept in memory while a training saves one network after the other.
#[derive(Default)]
pub struct KeptExemplars(Option<ReadExemplars>);

/// Exemplars with the calibration and the files that they were read from.
struct ReadExemplars {
    calibration: Calibration,
    stamps: Vec<Stamp>,
    exemplars: Exemplars,
}

/// Exemplars at the working size, and at their photographed size once read.
#[derive(Clone)]
struct Exemplars {
    transfer: Arc<Transfer>,
    detail: SharedDetail,
}

/// Length and modification time of a file; None if it cannot be read.
type Stamp = Option<(u64, Option<SystemTime>)>;

impl KeptExemplars {
    /// The project's exemplars, read again if the calibration or one of their files has changed.
    fn read(&mut self, project: &Project, calibration: &Calibration) -> Result<Exemplars, Error> {
        let stamps: Vec<Stamp> = (footage::exemplar_sources(project).iter())
            .map(|picture| {
                let about = std::fs::metadata(picture.file()).ok()?;
                Some((about.len(), about.modified().ok()))
            })
            .collect();
        if let Some(known) = &self.0
            && known.calibration == *calibration
            && known.stamps == stamps
        {
            return Ok(known.exemplars.clone());
        }
        let exemplars =
            Exemplars { transfer: Arc::new(Transfer::open(project, calibration)?), detail: SharedDetail::default() };
        self.0 = Some(ReadExemplars { calibration: calibration.clone(), stamps, exemplars: exemplars.clone() });
        Ok(exemplars)
    }
}

/// Opens a project's calibration and exemplars, and its network if one is trained.
///
/// # Errors
/// When the shoot or the calibration is missing, or something cannot be read.
pub fn open_project(project: &Project, compute: &ComputeDevice, kept: &mut KeptExemplars) -> Result<Source, Blocked> {
    let blocked = |need| move |e: Error| Blocked { sentence: e.to_string(), need };
    project.check_shoot().map_err(blocked(Some(Need::Shoot)))?;
    // A new calibration repairs any fault of an existing one.
    let unless_matte = |need| {
        move |e: Error| match footage::missing_matte(project) {
            Some(lack) => blocked(Some(Need::Mattes))(lack),
            None => blocked(need)(e),
        }
    };
    let calibration = Calibration::load(project).map_err(unless_matte(Some(Need::Calibration)))?;
    let Exemplars { transfer, detail } = kept.read(project, &calibration).map_err(unless_matte(None))?;
    // A network that cannot be used is not replaced without a request.
    let predictor = compute
        .guarded(|| OlatPredictor::with_transfer(transfer, project, &compute.device))
        .map_err(blocked(None))?
        .sharing(detail.clone())
        .steady(project, &calibration);
    let later = detail.get().is_none().then(|| {
        let (project, calibration) = (project.clone(), calibration.clone());
        Box::new(move || {
            let read = ExemplarDetail::read(&project, &calibration)?;
            let is_some = read.is_some();
            Ok(detail.set(read).is_ok() && is_some)
        }) as Later
    });
    let compute = compute.clone();
    let (project, response) = (project.clone(), calibration.response);
    // f16 fits twice as many frames into memory.
    let mut encoder = FieldEncoder::default();
    let comparisons = ComparisonReader::new(&project, response, &predictor, &compute);
    Ok(Source {
        rig: calibration.rig,
        device: match predictor.network() {
            Some(_) => compute.description.clone(),
            None => format!("{}. Not trained yet: poses carried over", compute.description),
        },
        later,
        comparison: Box::new(comparisons.find()),
        predict: Box::new(move |index| {
            let (frame, filmed) = Frame::load_filmed(&project, &response, index)?;
            let (field, fine) = compute.guarded(|| {
                let (field, fine) = predictor.predict_fine(&frame)?;
                Ok((encoder.encode(field, compute.passes())?, fine))
            })?;
            let plate = Some(FineField::on(fine, Plate::from_filmed(filmed, &frame)?));
            Ok(Prediction { frame, plate, field })
        }),
    })
}
