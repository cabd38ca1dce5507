//! The thread that owns the network: it predicts the newest frame asked for, and takes a newer network
//! when a job brings one.

use super::PredictedFrame;
use super::catch_panic::catch_panic;
use super::comparison::ComparisonSource;
use super::comparison_sources::ComparisonReader;
use super::event::{Blocked, Event, Need};
use super::latest::Latest;
use base::error::Error;
use base::progress::Control;
use calibration::Calibration;
use compositor::{Field, FieldEncoder};
use footage::Frame;
use gpu::ComputeDevice;
use light::Rig;
use project::Project;
use reflectance::Predictor;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

/// Reads a frame by its number and predicts its field.
pub type Predict = Box<dyn FnMut(usize) -> Result<(Frame, Field), Error>>;

/// Finds the OLATs of a frame elsewhere than at the network in use.
pub type FindComparison = Box<dyn FnMut(&ComparisonSource, usize) -> Result<(Frame, Field), Error>>;

/// Where predicted frames come from.
pub struct Source {
    pub rig: Rig,
    /// Where the prediction runs, and why there.
    pub device: String,
    /// Stays on the thread that made it.
    pub predict: Predict,
    /// What predictions are compared with.
    pub comparison: FindComparison,
}

/// Opens a project's calibration and network.
///
/// # Errors
/// When the project is not that far, or its files cannot be read.
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
    // In f16 twice as many frames stay at hand.
    let mut encoder = FieldEncoder::default();
    let rivals = ComparisonReader::new(&project, &calibration, &compute);
    Ok(Source {
        rig: calibration.rig,
        device: compute.description.clone(),
        comparison: Box::new(rivals.find()),
        predict: Box::new(move |index| {
            let frame = Frame::load(&project, &response, index)?;
            let field = compute.guarded(|| {
                encoder.encode(predictor.predict_on_device(&frame)?, compute.passes())
            })?;
            Ok((frame, field))
        }),
    })
}

/// A source that was opened. The generation counts openings: each may have another network.
pub(super) struct OpenedSource {
    pub generation: u64,
    pub rig: Arc<Rig>,
}

/// A frame to be predicted by the network of a generation.
pub(super) struct FrameRequest {
    pub generation: u64,
    pub frame: usize,
}

/// OLATs to compare a frame of a generation with.
#[derive(Clone, PartialEq)]
pub(super) struct ComparisonRequest {
    pub generation: u64,
    pub source: ComparisonSource,
    pub frame: usize,
}

/// Those that were found.
pub(super) struct FoundComparison {
    pub of: ComparisonRequest,
    pub found: Arc<PredictedFrame>,
}

/// The thread's ends of what connects it.
pub(super) struct Network<Open, Tell> {
    pub open: Open,
    pub wanted: Arc<Latest<FrameRequest>>,
    /// There may be a newer network.
    pub renew: Arc<Latest<()>>,
    pub opened: Arc<Latest<OpenedSource>>,
    pub fields: Arc<Latest<Arc<PredictedFrame>>>,
    /// What is to be compared, and what was found, for the first picture and the second.
    pub challenge: [Arc<Latest<ComparisonRequest>>; 2],
    pub rivals: [Arc<Latest<FoundComparison>>; 2],
    pub tell: Tell,
    pub stop: Control,
}

impl<Open, Tell> Network<Open, Tell>
where
    Open: FnMut() -> Result<Source, Blocked>,
    Tell: Fn(Event),
{
    /// Works until it is stopped.
    pub fn run(mut self, bell: &Receiver<()>) {
        let mut generation = 0;
        let mut source = self.open(None, &mut generation);
        while !self.stop.stopped() {
            if self.renew.take().is_some() {
                source = self.open(source, &mut generation);
            } else if let Some(wanted) = self.wanted.take() {
                // What was wanted of an older network is asked for again by whoever still wants it.
                let current = source.as_mut().filter(|_| wanted.generation == generation);
                let done = current.map(|source| self.predict(source, &wanted));
                if self.lost(done) {
                    source = self.open(source, &mut generation);
                }
            } else if let Some((side, challenge)) =
                (0..2).find_map(|side| Some((side, self.challenge[side].take()?)))
            {
                let current = source
                    .as_mut()
                    .filter(|_| challenge.generation == generation);
                let done = current.map(|source| self.find(source, side, challenge));
                if self.lost(done) {
                    source = self.open(source, &mut generation);
                }
            } else if bell.recv().is_err() {
                break;
            }
        }
    }

    /// Opens the source in place of `old`, which stays at hand where that fails.
    fn open(&mut self, old: Option<Source>, generation: &mut u64) -> Option<Source> {
        if old.is_none() {
            (self.tell)(Event::Opening);
        }
        match (self.open)() {
            Ok(source) => {
                *generation += 1;
                self.opened.put(OpenedSource {
                    generation: *generation,
                    rig: Arc::new(source.rig.clone()),
                });
                (self.tell)(Event::Ready {
                    device: source.device.clone(),
                });
                Some(source)
            }
            Err(blocked) => {
                (self.tell)(if old.is_some() {
                    Event::Failed {
                        sentence: blocked.sentence,
                    }
                } else {
                    Event::Blocked(blocked)
                });
                old
            }
        }
    }

    /// Tells what went wrong, and whether the device is gone, so that another is needed. What was wanted of it
    /// is asked for again by whoever still wants it.
    fn lost(&self, done: Option<Result<(), Error>>) -> bool {
        let Some(Err(error)) = done else {
            return false;
        };
        (self.tell)(Event::Failed {
            sentence: error.to_string(),
        });
        matches!(error, Error::GpuLost)
    }

    fn find(&self, source: &mut Source, side: usize, of: ComparisonRequest) -> Result<(), Error> {
        let started = Instant::now();
        let (frame, field) = catch_panic(|| (source.comparison)(&of.source, of.frame))?;
        self.rivals[side].put(FoundComparison {
            found: Arc::new(PredictedFrame {
                frame: Arc::new(frame),
                field: Arc::new(field),
                generation: of.generation,
                ms: started.elapsed().as_secs_f64() * 1e3,
            }),
            of,
        });
        Ok(())
    }

    fn predict(&self, source: &mut Source, wanted: &FrameRequest) -> Result<(), Error> {
        let started = Instant::now();
        let (frame, field) = catch_panic(|| (source.predict)(wanted.frame))?;
        self.fields.put(Arc::new(PredictedFrame {
            frame: Arc::new(frame),
            field: Arc::new(field),
            generation: wanted.generation,
            ms: started.elapsed().as_secs_f64() * 1e3,
        }));
        Ok(())
    }
}
