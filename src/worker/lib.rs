//! The work behind a window: one thread owns the network, one relights, one runs jobs, one reads
//! panoramas. None of them is ever waited for; numbers and sentences come back as [`Event`]s, pictures
//! through [`Latest`] slots.
//!
//! ```text
//! window ─ PreviewRequest ─► relighter ─ FrameRequest ─► network ◄─ saved, finished ─ jobs ◄─ Job, Export ─ window
//!    ▲                         │  ▲                         │
//!    └───── PreviewPicture ────┘  └───── PredictedFrame ────┘
//! ```
//!
//! While a job runs, frames are predicted by the network at hand. Whenever the job has saved a newer
//! one, the source is opened again: fields belong to a generation, and those of an older one are
//! predicted anew when they are asked for.

mod adaptive_resolution;
mod cache;
mod calibration_thread;
mod catch_panic;
mod comparison;
mod comparison_sources;
pub mod demo;
mod environment_list_writer;
mod event;
mod export_queue;
mod job;
mod job_thread;
mod latest;
mod lookup;
mod network;
mod panorama_loader;
mod relighter;
mod review_thread;
mod srgb_picture;
mod stage;

pub use calibration_thread::{
    CalibrationRequest, CalibrationThread, GammaView, ProbeView, SeenLamp,
};
pub use comparison::{Comparison, ComparisonSource};
pub use environment_list_writer::EnvironmentListWriter;
pub use event::{Blocked, Event, Need};
pub use export_queue::{Export, ExportStatus, WrittenExport};
pub use job::{Job, Outcome, TRAINING, WentBack};
pub use latest::Latest;
pub use lookup::Lookup;
pub use network::{FindComparison, Predict, Source, open_project};
pub use panorama_loader::{Origin, Panorama, PanoramaLoader};
pub use relighter::{PreviewPicture, PreviewRequest};
pub use review_thread::{LampSheet, ReviewThread, SavedReview};
pub use srgb_picture::SrgbPicture;

use base::error::Error;
use base::progress::{Control, Progress, TrainingPictures};
use compositor::Field;
use footage::Frame;
use gpu::{ComputeDevice, DeviceChoice};
use project::Project;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// Memory for reflectance fields: about 130 frames of 41 lamps at 128 pixels, or 8 at 512.
const FIELD_BUDGET_BYTES: usize = 1 << 30;

/// A frame with its reflectance field.
#[derive(Clone, Debug)]
pub struct PredictedFrame {
    pub frame: Arc<Frame>,
    pub field: Arc<Field>,
    /// Which opening of the source predicted it.
    pub generation: u64,
    /// What the prediction took in milliseconds, reading the frame included.
    pub ms: f64,
}

/// The threads behind one open project. Dropping it stops and joins them: that takes as long as one
/// prediction or one training step.
pub struct Worker {
    asks: Arc<Latest<PreviewRequest>>,
    tasks: Arc<Latest<job_thread::Task>>,
    current_job: job_thread::CurrentJob,
    queue: export_queue::ExportQueue,
    ring_jobs: Box<dyn Fn() + Send>,
    relit: Arc<Latest<Arc<PreviewPicture>>>,
    pictures: Arc<Latest<Arc<TrainingPictures>>>,
    events: Arc<event::UnreadEvents>,
    /// Why no job may write into the project, where none may.
    read_only: Option<String>,
    stop: Control,
    ring: Vec<Box<dyn Fn() + Send>>,
    threads: Vec<JoinHandle<()>>,
}

impl Worker {
    /// Starts work on a project; `wake` is called whenever there is something new to show.
    pub fn start(
        project: Project,
        device: DeviceChoice,
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) -> Self {
        // To look for a GPU takes a while, and what it finds does not change.
        let mut compute: Option<ComputeDevice> = None;
        let open = move || {
            if compute.as_ref().is_some_and(ComputeDevice::is_lost) {
                compute = None;
            }
            let compute = compute.get_or_insert_with(|| ComputeDevice::choose(device));
            open_project(&project, compute)
        };
        Self::over(open, wake)
    }

    /// Starts work on frames from anywhere. `open` is called on the network's thread: at the start,
    /// whenever a job has saved a network, and after each job.
    pub fn over(
        open: impl FnMut() -> Result<Source, Blocked> + Send + 'static,
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) -> Self {
        Self::within(
            adaptive_resolution::WINDOW_FRAME_MS,
            relighter::STILL,
            open,
            wake,
        )
    }

    /// [`Self::over`], with what a picture may take in milliseconds while something is dragged, and how long a drag
    /// has to rest before the picture is made at its full size.
    fn within(
        budget_ms: f64,
        rest: Duration,
        open: impl FnMut() -> Result<Source, Blocked> + Send + 'static,
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) -> Self {
        let stop = Control::default();
        let events = Arc::new(event::UnreadEvents::default());
        let tell = {
            let (events, wake) = (events.clone(), wake.clone());
            move |event| {
                events.push(event);
                wake();
            }
        };
        let (ring_network, network_bell) = latest::doorbell();
        let (ring_relighter, relighter_bell) = latest::doorbell();
        let (ring_jobs, job_bell) = latest::doorbell();
        let wanted = Arc::new(Latest::new(ring_network.clone()));
        let renew = Arc::new(Latest::new(ring_network.clone()));
        let tasks = Arc::new(Latest::new(ring_jobs.clone()));
        let opened = Arc::new(Latest::new(ring_relighter.clone()));
        let fields = Arc::new(Latest::new(ring_relighter.clone()));
        let rivals = [(); 2].map(|()| Arc::new(Latest::new(ring_relighter.clone())));
        let challenge = [(); 2].map(|()| Arc::new(Latest::new(ring_network.clone())));
        let asks = Arc::new(Latest::new(ring_relighter.clone()));
        let pictures = Arc::new(Latest::new(wake.clone()));
        let relit = Arc::new(Latest::new(wake));
        let network = network::Network {
            open,
            wanted: wanted.clone(),
            renew: renew.clone(),
            opened: opened.clone(),
            fields: fields.clone(),
            challenge: challenge.clone(),
            rivals: rivals.clone(),
            tell: tell.clone(),
            stop: stop.clone(),
        };
        let relighter = relighter::Relighter {
            asks: asks.clone(),
            opened,
            fields,
            wanted,
            challenge,
            rivals,
            relit: relit.clone(),
            tell: tell.clone(),
            stop: stop.clone(),
            cache: cache::FieldCache::new(FIELD_BUDGET_BYTES),
            renew: renew.clone(),
            budget_ms,
            rest,
        };
        let current_job = job_thread::CurrentJob::default();
        let queue = export_queue::ExportQueue::default();
        let jobs = job_thread::JobThread {
            tasks: tasks.clone(),
            current_job: current_job.clone(),
            queue: queue.clone(),
            renew,
            pictures: pictures.clone(),
            tell,
            stop: stop.clone(),
        };
        Self {
            asks,
            tasks,
            current_job,
            queue,
            ring_jobs: Box::new(ring_jobs),
            relit,
            pictures,
            events,
            read_only: None,
            stop,
            ring: vec![Box::new(ring_network), Box::new(ring_relighter)],
            threads: vec![
                std::thread::spawn(move || network.run(&network_bell)),
                std::thread::spawn(move || relighter.run(&relighter_bell)),
                std::thread::spawn(move || jobs.run(&job_bell)),
            ],
        }
    }

    /// Asks for a picture in place of any that was asked for before and is not begun.
    pub fn show(&self, ask: PreviewRequest) {
        self.asks.put(ask);
    }

    /// The newest picture, once.
    pub fn relit(&self) -> Option<Arc<PreviewPicture>> {
        self.relit.take()
    }

    /// Whether there is a picture that [`Self::relit`] would give.
    pub fn has_picture(&self) -> bool {
        self.relit.is_full()
    }

    /// The newest pictures of a network in training, once.
    pub fn pictures(&self) -> Option<Arc<TrainingPictures>> {
        self.pictures.take()
    }

    /// What happened since the last call.
    pub fn events(&self) -> impl Iterator<Item = Event> {
        self.events.take().into_iter()
    }

    /// From now on refuses jobs that write into their project, for the reason `why`.
    pub fn refuse_writes(&mut self, why: String) {
        self.read_only = Some(why);
    }

    /// Runs a job beside the picture, unless one or an export is in hand already; tells whether it will.
    pub fn run(&self, job: Job) -> bool {
        if let (Some(why), true) = (&self.read_only, job.writes().is_some()) {
            let sentence = format!("Nothing can be written here. {why}");
            self.events.push(Event::Failed { sentence });
            return false;
        }
        self.work(job.what(), move |progress| {
            job.run(progress).map(|outcome| outcome.sentence())
        })
    }

    /// Runs any long action as [`Self::run`] runs a job. `what` says what is being done, and the action
    /// returns what came of it, as a sentence.
    pub fn work(
        &self,
        what: &'static str,
        action: impl FnOnce(&Progress) -> Result<String, Error> + Send + 'static,
    ) -> bool {
        let control = self.current_job.begin();
        let begun = control.is_some();
        if let Some(control) = control {
            self.tasks.put(job_thread::Task {
                what,
                control,
                action: Box::new(action),
            });
        }
        begun
    }

    /// Puts an export at the end of the line: it is written when those before it are over and no job is in
    /// hand. `name` is what people call it; the number is the line's own.
    pub fn export(
        &self,
        name: String,
        write: impl FnOnce(&Progress) -> Result<WrittenExport, Error> + Send + 'static,
    ) -> u64 {
        let id = self.queue.push(name, Box::new(write));
        (self.ring_jobs)();
        id
    }

    /// The exports that wait, run or are over, in the order in which they were asked for.
    pub fn exports(&self) -> Vec<Export> {
        self.queue.exports()
    }

    /// Takes an export that waits or is over out of the line. The one in hand is asked to stop by
    /// [`Self::cancel`].
    pub fn withdraw(&self, id: u64) {
        self.queue.remove(id);
    }

    /// Asks the job in hand to pause after what it is at, or to go on.
    pub fn pause(&self, pause: bool) {
        if let Some(control) = self.current_job.control() {
            control.pause(pause);
        }
    }

    /// Asks the job in hand to stop; what it has finished is kept.
    pub fn cancel(&self) {
        if let Some(control) = self.current_job.control() {
            control.stop();
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.stop.stop();
        self.cancel();
        self.ring.iter().for_each(|ring| ring());
        (self.ring_jobs)();
        for thread in self.threads.drain(..) {
            // A thread that panicked has said so on stderr; there is nothing left to stop.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests;
