//! The jobs' thread: runs long actions one after the other, beside the network's thread, and tells that thread of
//! each readable checkpoint. Without a job, it writes the waiting exports.

use super::background::Handler;
use super::event::Event;
use super::export_queue::{ExportQueue, WrittenExport};
use super::latest::Latest;
use super::mailbox::{Mailbox, Request};
use super::messages::NetworkRequest;
use base::error::{Error, Result};
use base::progress::{Control, Progress, Report, TrainingPictures};
use parking_lot::Mutex;
use std::sync::Arc;
use std::time::Duration;

/// Request to the thread.
pub(super) enum JobRequest {
    Run(Task),
    /// Write the first waiting export.
    Export,
}

/// A long action to run.
pub(super) struct Task {
    pub what: &'static str,
    pub control: Control,
    /// None once it has begun.
    pub action: Option<Action>,
}

/// Runs the action and returns a sentence about its result.
pub(super) type Action = Box<dyn FnOnce(&Progress) -> Result<String> + Send>;

/// Result of a request.
pub(super) enum Done {
    /// A job, with its sentence.
    Job(String),
    /// The export with this number.
    Export(u64, WrittenExport),
    /// Nothing was left to do.
    Nothing,
}

/// The requested or running job or export, if there is one.
#[derive(Clone, Default)]
pub(super) struct CurrentJob(Arc<Mutex<Current>>);

#[derive(Default)]
struct Current {
    running: Option<Running>,
    /// No further job may begin.
    closed: bool,
}

struct Running {
    /// The job's work, in words; None for an export.
    job: Option<&'static str>,
    /// Control that pauses and stops it.
    control: Control,
}

impl CurrentJob {
    /// Begins a job, named by its work, or an export.
    ///
    /// # Errors
    /// [`Error::Busy`] while another job or export runs, and after [`Self::close`].
    pub fn begin(&self, job: Option<&'static str>) -> Result<Control> {
        let mut current = self.0.lock();
        current.idle()?;
        if current.closed {
            return Err(Error::busy("The project is closing", "Open it again"));
        }
        let control = Control::default();
        current.running = Some(Running { job, control: control.clone() });
        Ok(control)
    }

    fn end(&self) {
        self.0.lock().running = None;
    }

    /// Stops the current job or export, and prevents further ones.
    pub fn close(&self) {
        let mut current = self.0.lock();
        current.closed = true;
        if let Some(running) = &current.running {
            running.control.stop();
        }
    }

    /// Control that pauses and stops the current job or export.
    pub fn control(&self) -> Option<Control> {
        let current = self.0.lock();
        (current.running.as_ref()).map(|running| running.control.clone())
    }

    /// The current job's work, in words.
    pub fn job(&self) -> Option<&'static str> {
        self.0.lock().running.as_ref()?.job
    }

    /// Checks that neither a job nor an export runs.
    ///
    /// # Errors
    /// [`Error::Busy`] if one does.
    pub fn idle(&self) -> Result<()> {
        self.0.lock().idle()
    }
}

impl Current {
    fn idle(&self) -> Result<()> {
        match self.running {
            None => Ok(()),
            Some(_) => Err(Error::busy("Another job is running", "Wait until it ends, or stop it")),
        }
    }
}

/// The thread's ends of its connections.
pub(super) struct JobThread<Tell> {
    pub current_job: CurrentJob,
    pub queue: ExportQueue,
    /// Number of the export that is being written.
    pub exporting: Option<u64>,
    pub network: Arc<Mailbox<NetworkRequest>>,
    /// Preview of a network in training, for one pose.
    pub pictures: Arc<Latest<Arc<TrainingPictures>>>,
    pub tell: Tell,
}

impl Request for JobRequest {
    fn lane(&self) -> Option<usize> {
        Some(match self {
            Self::Run(_) => 0,
            Self::Export => 1,
        })
    }
}

impl<Tell: Fn(Event) + Sync> Handler for JobThread<Tell> {
    type Request = JobRequest;
    type Answer = Done;

    fn work(&mut self, request: &mut JobRequest) -> Result<Done> {
        match request {
            JobRequest::Run(task) => self.run(task),
            JobRequest::Export => self.export(),
        }
    }

    fn deliver(&mut self, _: JobRequest, answer: Result<Done>) {
        match (answer, self.exporting.take()) {
            (Ok(Done::Job(sentence)), _) => self.finished(sentence),
            (Ok(Done::Export(id, written)), _) => self.exported(id, Ok(written)),
            (Ok(Done::Nothing), _) => {}
            (Err(e), Some(id)) => self.exported(id, Err(e)),
            (Err(e), None) => self.finished(e.to_string()),
        }
    }

    /// Waiting exports are written one after the other.
    fn rest(&self) -> Option<(Duration, JobRequest)> {
        let next = self.queue.waits() && self.current_job.control().is_none();
        next.then_some((Duration::ZERO, JobRequest::Export))
    }
}

impl<Tell: Fn(Event) + Sync> JobThread<Tell> {
    fn run(&self, task: &mut Task) -> Result<Done> {
        let Some(action) = task.action.take() else { return Ok(Done::Nothing) };
        (self.tell)(Event::Started { what: task.what });
        let report = |report: Report| {
            if report == Report::Saved {
                self.network.put(NetworkRequest::Open);
            }
            (self.tell)(Event::Report(report));
        };
        let show = |pictures| self.pictures.put(Arc::new(pictures));
        let progress = Progress::new(&report, task.control.clone()).with_pictures(&show).attended();
        action(&progress).map(Done::Job)
    }

    fn finished(&self, sentence: String) {
        self.current_job.end();
        // Before the network's next event, which describes the time after the job.
        (self.tell)(Event::Finished { sentence });
        self.network.put(NetworkRequest::Open);
    }

    /// Writes the first waiting export, unless a job has begun or the export was withdrawn.
    fn export(&mut self) -> Result<Done> {
        let Ok(control) = self.current_job.begin(None) else { return Ok(Done::Nothing) };
        let Some((id, mut write)) = self.queue.begin() else {
            self.current_job.end();
            return Ok(Done::Nothing);
        };
        self.exporting = Some(id);
        (self.tell)(Event::Started { what: "exporting" });
        let report = |report: Report| (self.tell)(Event::Report(report));
        let progress = Progress::new(&report, control);
        let written = write(&progress);
        footage::report_mended(&progress);
        if written.is_err() {
            self.queue.keep(id, write);
        }
        Ok(Done::Export(id, written?))
    }

    /// Pictures do not change, so the network's thread needs no message.
    fn exported(&self, id: u64, written: Result<WrittenExport>) {
        let status = self.queue.end(id, written);
        self.current_job.end();
        (self.tell)(Event::Exported(status));
    }
}
