//! The thread that owns the network: it predicts the newest frame asked for, and runs jobs.

use super::PredictedFrame;
use super::event::{Blocked, Event, Need};
use super::job::Job;
use super::latest::Latest;
use crate::calibration::Calibration;
use crate::compositor::Field;
use crate::compositor::passes::RelightPass;
use crate::error::Error;
use crate::footage::Frame;
use crate::gpu::{ComputeDevice, DeviceChoice};
use crate::light::Rig;
use crate::progress::{Control, Progress, Report};
use crate::project::Project;
use crate::reflectance::Predictor;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

/// Reads a frame by its number and predicts its field.
pub type Predict = Box<dyn FnMut(usize) -> Result<(Frame, Field), Error>>;

/// Where predicted frames come from.
pub struct Source {
    pub rig: Rig,
    /// Where the prediction runs, and why there.
    pub device: String,
    /// Stays on the thread that made it.
    pub predict: Predict,
}

/// Opens a project's calibration and network.
///
/// # Errors
/// When the project is not that far, or its files cannot be read.
pub fn open_project(project: &Project, device: DeviceChoice) -> Result<Source, Blocked> {
    let blocked = |need| {
        move |e: Error| Blocked {
            sentence: e.to_string(),
            need,
        }
    };
    // Whatever is wrong with a calibration, another one mends it.
    let calibration = Calibration::load(project).map_err(blocked(Some(Need::Calibration)))?;
    let compute = ComputeDevice::choose(device);
    // A network that is there and cannot be used is not replaced unasked.
    let untrained = !project.checkpoint_path().exists();
    let need = untrained.then_some(Need::Network);
    let predictor = Predictor::open(project, &compute.device).map_err(blocked(need))?;
    let pass = RelightPass::beside(&compute).map(Arc::new);
    let (project, response) = (project.clone(), calibration.response);
    Ok(Source {
        rig: calibration.rig,
        device: compute.description,
        predict: Box::new(move |index| {
            let frame = Frame::load(&project, &response, index)?;
            let field = Field::predicted(predictor.predict_on_device(&frame)?, pass.as_ref())?;
            Ok((frame, field))
        }),
    })
}

/// The thread's ends of what connects it.
pub(super) struct Network<Open, Tell> {
    pub open: Open,
    pub frames: Arc<Latest<usize>>,
    pub jobs: Arc<Latest<(Job, Control)>>,
    pub rigs: Arc<Latest<Arc<Rig>>>,
    pub fields: Arc<Latest<Arc<PredictedFrame>>>,
    pub tell: Tell,
    pub stop: Control,
}

impl<Open, Tell> Network<Open, Tell>
where
    Open: FnMut() -> Result<Source, Blocked>,
    Tell: Fn(Event) + Sync,
{
    /// Works until it is stopped.
    pub fn run(mut self, bell: &Receiver<()>) {
        let mut source = self.open();
        while !self.stop.stopped() {
            if let Some((job, cancel)) = self.jobs.take() {
                // What the job is about to replace must not take memory beside it.
                drop(source.take());
                self.work(job, cancel);
                source = self.open();
            } else if let Some(index) = self.frames.take() {
                if let Some(source) = &mut source {
                    self.predict(source, index);
                }
            } else if bell.recv().is_err() {
                break;
            }
        }
    }

    fn open(&mut self) -> Option<Source> {
        (self.tell)(Event::Opening);
        match (self.open)() {
            Ok(source) => {
                self.rigs.put(Arc::new(source.rig.clone()));
                (self.tell)(Event::Ready {
                    device: source.device.clone(),
                });
                Some(source)
            }
            Err(blocked) => {
                (self.tell)(Event::Blocked(blocked));
                None
            }
        }
    }

    fn predict(&self, source: &mut Source, index: usize) {
        let started = Instant::now();
        match (source.predict)(index) {
            Ok((frame, field)) => self.fields.put(Arc::new(PredictedFrame {
                frame: Arc::new(frame),
                field: Arc::new(field),
                ms: started.elapsed().as_secs_f64() * 1e3,
            })),
            Err(e) => (self.tell)(Event::Failed {
                sentence: e.to_string(),
            }),
        }
    }

    fn work(&self, job: Job, cancel: Control) {
        let tell = &self.tell;
        tell(Event::Started { what: job.what() });
        let report = |report: Report| tell(Event::Report(report));
        let sentence = match job.run(&Progress::new(&report, cancel)) {
            Ok(outcome) => outcome.sentence(),
            Err(e) => e.to_string(),
        };
        tell(Event::Finished { sentence });
    }
}
