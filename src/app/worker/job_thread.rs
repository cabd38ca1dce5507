//! The thread that works: it runs long actions one after the other, beside the network's thread, which
//! is told of each checkpoint that can be read. When no job was asked for, it writes the exports that wait.

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
    /// To write the first export that waits.
    Export,
}

/// A long action that is to be run.
pub(super) struct Task {
    pub what: &'static str,
    pub control: Control,
    /// None once it was begun.
    pub action: Option<Action>,
}

/// Does it, and says what came of it.
pub(super) type Action = Box<dyn FnOnce(&Progress) -> Result<String> + Send>;

/// Result of a request.
pub(super) enum Done {
    /// A job, in a sentence.
    Job(String),
    /// The export of this number.
    Export(u64, WrittenExport),
    /// There was nothing to do any more.
    Nothing,
}

/// The job or export that was asked for or runs, if there is one.
#[derive(Clone, Default)]
pub(super) struct CurrentJob(Arc<Mutex<Current>>);

#[derive(Default)]
struct Current {
    running: Option<Running>,
    /// None may be begun any more.
    closed: bool,
}

struct Running {
    /// The job's work, in words; None for an export.
    job: Option<&'static str>,
    /// Control that pauses and stops it.
    control: Control,
}

impl CurrentJob {
    /// Begins a job, named by what it does, or an export.
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

    /// Asks what runs to stop, and lets nothing be begun any more.
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

/// The thread's ends of what connects it.
pub(super) struct JobThread<Tell> {
    pub current_job: CurrentJob,
    pub queue: ExportQueue,
    /// The number of the export that is being written.
    pub exporting: Option<u64>,
    pub network: Arc<Mailbox<NetworkRequest>>,
    /// Output of a network in training for a pose.
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

    /// Exports that wait are written one after the other.
    fn rest(&self) -> Option<(Duration, JobRequest)> {
        let next = self.queue.waits() && self.current_job.control().is_none();
        next.then_some((Duration::ZERO, JobRequest::Export))
    }
}

impl<Tell: Fn(Event) + Sync> JobThread<Tell> {
    fn run(&self, task: &mut Task) -> Result<Done> {
        let Some(action) = task.action.take() else {
            return Ok(Done::Nothing);
        };
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
        // In this order: what the network's thread says next is about the time after the job.
        (self.tell)(Event::Finished { sentence });
        self.network.put(NetworkRequest::Open);
    }

    /// Writes the first export that waits, unless a job was begun or the export was withdrawn in the meantime.
    fn export(&mut self) -> Result<Done> {
        let Ok(control) = self.current_job.begin(None) else {
            return Ok(Done::Nothing);
        };
        let Some((id, write)) = self.queue.begin() else {
            self.current_job.end();
            return Ok(Done::Nothing);
        };
        self.exporting = Some(id);
        (self.tell)(Event::Started { what: "exporting" });
        let report = |report: Report| (self.tell)(Event::Report(report));
        let written = write(&Progress::new(&report, control))?;
        Ok(Done::Export(id, written))
    }

    /// Pictures are made as before: the network's thread need not hear of it.
    fn exported(&self, id: u64, written: Result<WrittenExport>) {
        let status = self.queue.end(id, written);
        self.current_job.end();
        (self.tell)(Event::Exported(status));
    }
}
