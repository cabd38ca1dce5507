//! The work behind a window: one thread owns the network, one relights, one runs jobs. Others read panoramas,
//! write the list of environments and answer the window's questions ([`Query`]): about the calibration, the project's
//! checks, the review, the disk. All are of one kind, [`background::Background`]. The window never waits for them; numbers and
//! sentences come back as [`Event`]s, pictures through [`Latest`] slots.
//!
//! ```text
//! window ─ PreviewRequest ─► relighter ─ FrameRequest ─► network ◄─ saved, finished ─ jobs ◄─ Job, Export ─ window
//!    ▲                         │  ▲                         │
//!    └───── PreviewPicture ────┘  └───── PredictedFrame ────┘
//! ```
//!
//! While a job runs, frames are predicted by the current network. Whenever the job has saved a newer one, the
//! source is opened again: fields belong to a generation, and those of an older one are predicted again on
//! request.

mod adaptive_resolution;
pub mod background;
mod behind;
mod cache;
mod calibration_study;
mod comparison;
mod comparison_reader;
pub mod demo;
mod environment_list_writer;
mod event;
mod export_queue;
mod job;
mod job_thread;
mod latest;
mod look_pictures;
mod mailbox;
mod messages;
mod network;
mod outcome;
mod panorama_loader;
mod prediction;
mod preview;
mod preview_maker;
mod query;
mod relighter;
mod relit_frame;
mod review;
mod source;
mod srgb_picture;
mod view_table;

pub use calibration_study::{CalibrationStudy, GammaView, ProbeView, SeenLamp};
pub use comparison::{Comparison, ComparisonSource, LookView};
pub use environment_list_writer::EnvironmentListWriter;
pub use event::{Blocked, Event, Need};
pub use export_queue::{Export, ExportStatus, WrittenExport};
pub use job::{Job, TRAINING, find_person};
pub use latest::Latest;
pub use outcome::{Outcome, WentBack};
pub use panorama_loader::{Origin, Panorama, PanoramaLoader};
pub use prediction::{PredictedFrame, Prediction};
pub use preview::{LookPicture, PreviewPicture, PreviewRequest};
pub use query::Query;
pub use review::{Cell, CellPictures, CellReader, LampSheet, SavedReview};
pub use source::{FindComparison, KeptExemplars, Predict, Source, open_project};
pub use srgb_picture::{SrgbPicture, mirrored, on_mirror_ball};

use background::Background;
use base::error::Error;
use base::progress::{Control, Progress, TrainingPictures};
use gpu::{ComputeDevice, DeviceChoice};
use job_thread::{JobRequest, JobThread, Task};
use mailbox::Mailbox;
use messages::{NetworkRequest, RelighterRequest};
use network::Network;
use project::Project;
use relighter::Relighter;
use std::sync::Arc;
use std::time::Duration;

/// The threads behind one open project. Dropping it stops and joins them, which takes up to one prediction or one
/// training step.
pub struct Worker {
    network: Background<NetworkRequest>,
    relighter: Background<RelighterRequest>,
    jobs: Background<JobRequest>,
    current_job: job_thread::CurrentJob,
    queue: export_queue::ExportQueue,
    relit: Arc<Latest<Arc<PreviewPicture>>>,
    pictures: Arc<Latest<Arc<TrainingPictures>>>,
    events: Arc<event::UnreadEvents>,
    /// Reason that no job may write into the project; None if jobs may.
    read_only: Option<String>,
}

impl Worker {
    /// Starts work on a project; `wake` is called whenever there is something new to show.
    pub fn start(project: Project, device: DeviceChoice, wake: impl Fn() + Clone + Send + Sync + 'static) -> Self {
        // Finding a GPU takes a while, and the result does not change.
        let mut compute: Option<ComputeDevice> = None;
        let mut exemplars = KeptExemplars::default();
        let open = move || {
            if compute.as_ref().is_some_and(ComputeDevice::is_lost) {
                compute = None;
            }
            let compute = compute.get_or_insert_with(|| ComputeDevice::choose(device));
            open_project(&project, compute, &mut exemplars)
        };
        Self::over(open, wake)
    }

    /// Starts work on frames from any source. `open` is called on the network's thread: at the start, whenever a
    /// job has saved a network, and after each job.
    pub fn over(
        open: impl FnMut() -> Result<Source, Blocked> + Send + 'static,
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) -> Self {
        Self::within(adaptive_resolution::WINDOW_FRAME_MS, relighter::STILL, open, wake)
    }

    /// Same as [`Self::over`], with a time budget per picture in milliseconds while something moves, and the rest
    /// time before a drag is shown at full size.
    pub fn within(
        budget_ms: f64,
        rest: Duration,
        open: impl FnMut() -> Result<Source, Blocked> + Send + 'static,
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) -> Self {
        let events = Arc::new(event::UnreadEvents::default());
        let tell = {
            let (events, wake) = (events.clone(), wake.clone());
            move |event| {
                events.push(event);
                wake();
            }
        };
        let pictures = Arc::new(Latest::new(wake.clone()));
        let relit = Arc::new(Latest::new(wake));
        let (to_network, to_relighter) = (Mailbox::new(), Mailbox::new());
        let network = {
            let (own, relighter) = (to_network.clone(), to_relighter.clone());
            let tell = tell.clone();
            move || Network::new(open, own, relighter, tell)
        };
        let relighter = Relighter::new(to_network.clone(), relit.clone(), tell.clone(), budget_ms, rest);
        let current_job = job_thread::CurrentJob::default();
        let queue = export_queue::ExportQueue::default();
        let jobs = JobThread {
            current_job: current_job.clone(),
            queue: queue.clone(),
            exporting: None,
            network: to_network.clone(),
            pictures: pictures.clone(),
            tell,
        };
        to_network.put(NetworkRequest::Open);
        let never = Control::default;
        Self {
            network: Background::start("network", to_network, never(), network),
            relighter: Background::start("relighter", to_relighter, never(), || relighter),
            jobs: Background::spawn("jobs", |_| jobs),
            current_job,
            queue,
            relit,
            pictures,
            events,
            read_only: None,
        }
    }

    /// Requests a picture; replaces an earlier request that has not begun.
    pub fn show(&self, request: PreviewRequest) {
        self.relighter.put(RelighterRequest::Show(Box::new(request)));
    }

    /// The newest picture, once.
    pub fn relit(&self) -> Option<Arc<PreviewPicture>> {
        self.relit.take()
    }

    /// True if [`Self::relit`] would return a picture.
    pub fn has_picture(&self) -> bool {
        self.relit.is_full()
    }

    /// The newest pictures of a network in training, once.
    pub fn pictures(&self) -> Option<Arc<TrainingPictures>> {
        self.pictures.take()
    }

    /// Events since the last call.
    pub fn events(&self) -> impl Iterator<Item = Event> {
        self.events.take().into_iter()
    }

    /// Rejects jobs that write into their project from now on; `why` is the reason shown.
    pub fn refuse_writes(&mut self, why: String) {
        self.read_only = Some(why);
    }

    /// Checks that jobs may write into their project.
    ///
    /// # Errors
    /// [`Error::Busy`] after [`Self::refuse_writes`].
    pub fn writable(&self) -> Result<(), Error> {
        match &self.read_only {
            Some(why) => Err(Error::busy("Read-only", why)),
            None => Ok(()),
        }
    }

    /// Checks that a job could begin now: neither a job nor an export runs.
    ///
    /// # Errors
    /// [`Error::Busy`] if one does.
    pub fn idle(&self) -> Result<(), Error> {
        self.current_job.idle()
    }

    /// The running job's work, in words; None if none runs. Exports do not count.
    pub fn running_job(&self) -> Option<&'static str> {
        self.current_job.job()
    }

    /// Begins a job beside the picture. Its result is an [`Event`].
    ///
    /// # Errors
    /// As [`Self::idle`], and as [`Self::writable`] if the job writes into its project. The job is then not
    /// begun.
    pub fn run(&self, job: Job) -> Result<(), Error> {
        if job.writes().is_some() {
            self.writable()?;
        }
        self.work(job.what(), move |progress| job.run(progress).map(|outcome| outcome.sentence()))
    }

    /// Begins any long action as [`Self::run`] begins a job. `what` names the work; the action returns a sentence
    /// about its result.
    ///
    /// # Errors
    /// As [`Self::idle`].
    pub fn work(
        &self,
        what: &'static str,
        action: impl FnOnce(&Progress) -> Result<String, Error> + Send + 'static,
    ) -> Result<(), Error> {
        let control = self.current_job.begin(Some(what))?;
        self.jobs.put(JobRequest::Run(Task { what, control, action: Some(Box::new(action)) }));
        Ok(())
    }

    /// Puts an export at the end of the queue and returns its number. It is written when those before it are over
    /// and no job runs. `name` and `settings` are shown to the user.
    pub fn export(
        &self,
        name: String,
        settings: String,
        write: impl FnMut(&Progress) -> Result<WrittenExport, Error> + Send + 'static,
    ) -> u64 {
        let id = self.queue.push(name, settings, Box::new(write));
        self.jobs.put(JobRequest::Export);
        id
    }

    /// The exports that wait, run or are over, in the order of writing.
    pub fn exports(&self) -> Vec<Export> {
        self.queue.exports()
    }

    /// Moves a waiting export before all others that wait.
    pub fn write_export_next(&self, id: u64) {
        self.queue.write_next(id);
    }

    /// Writes an export that failed or was stopped again, behind those that wait.
    pub fn retry_export(&self, id: u64) {
        self.queue.retry(id);
        self.jobs.put(JobRequest::Export);
    }

    /// Removes an export that waits or is over from the queue. [`Self::cancel`] stops the running one.
    pub fn withdraw(&self, id: u64) {
        self.queue.remove(id);
    }

    /// Pauses the running job or export at its next safe point, or resumes it.
    pub fn pause(&self, pause: bool) {
        if let Some(control) = self.current_job.control() {
            control.pause(pause);
        }
    }

    /// Stops the running job or export; finished output is kept.
    pub fn cancel(&self) {
        if let Some(control) = self.current_job.control() {
            control.stop();
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // All at once: the fields are joined one after the other.
        self.network.stop();
        self.relighter.stop();
        self.jobs.stop();
        // The jobs' thread may be about to begin an export.
        self.current_job.close();
    }
}

#[cfg(test)]
mod tests;
