//! The thread that works: it runs long actions one after the other, beside the network's thread, which
//! is told of each checkpoint that can be read. Where no job was asked for it writes the exports in line.

use super::catch_panic::catch_panic;
use super::event::Event;
use super::export_queue::ExportQueue;
use super::latest::Latest;
use base::error::Result;
use base::progress::{Control, Progress, Report, TrainingPictures};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};

/// A long action in hand.
pub(super) struct Task {
    pub what: &'static str,
    pub control: Control,
    pub action: Action,
}

/// Does it, and says what came of it.
pub(super) type Action = Box<dyn FnOnce(&Progress) -> Result<String> + Send>;

/// The wishes for the task that was asked for or runs; none where there is no such task.
#[derive(Clone, Default)]
pub(super) struct CurrentJob(Arc<Mutex<Option<Control>>>);

impl CurrentJob {
    /// Takes a task in hand; none while another is.
    pub fn begin(&self) -> Option<Control> {
        let mut control = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        control
            .is_none()
            .then(|| control.insert(Control::default()).clone())
    }

    fn end(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// The wishes for the task in hand.
    pub fn control(&self) -> Option<Control> {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }
}

/// The thread's ends of what connects it.
pub(super) struct JobThread<Tell> {
    pub tasks: Arc<Latest<Task>>,
    pub current_job: CurrentJob,
    pub queue: ExportQueue,
    /// Asks the network's thread to open its source again.
    pub renew: Arc<Latest<()>>,
    /// What a network in training makes of a pose.
    pub pictures: Arc<Latest<Arc<TrainingPictures>>>,
    pub tell: Tell,
    pub stop: Control,
}

impl<Tell: Fn(Event) + Sync> JobThread<Tell> {
    /// Works until it is stopped.
    pub fn run(self, bell: &Receiver<()>) {
        while !self.stop.stopped() {
            if let Some(task) = self.tasks.take() {
                self.work(task);
            } else if self.queue.waits()
                && let Some(control) = self.current_job.begin()
            {
                self.export(control);
            } else if bell.recv().is_err() {
                break;
            }
        }
    }

    fn work(&self, task: Task) {
        (self.tell)(Event::Started { what: task.what });
        let report = |report: Report| {
            if report == Report::Saved {
                self.renew.put(());
            }
            (self.tell)(Event::Report(report));
        };
        let show = |pictures| self.pictures.put(Arc::new(pictures));
        let progress = Progress::new(&report, task.control)
            .with_pictures(&show)
            .attended();
        let done = catch_panic(|| (task.action)(&progress));
        let sentence = done.unwrap_or_else(|e| e.to_string());
        self.current_job.end();
        // In this order: what the network's thread says next is about the time after the job.
        (self.tell)(Event::Finished { sentence });
        self.renew.put(());
    }

    /// Writes the first export in line. It changes nothing that pictures are made of, so the network's thread
    /// need not hear of it.
    fn export(&self, control: Control) {
        // Whatever waited may have been taken out of the line in the meantime.
        let Some((id, write)) = self.queue.begin() else {
            return self.current_job.end();
        };
        (self.tell)(Event::Started { what: "exporting" });
        let report = |report: Report| (self.tell)(Event::Report(report));
        let done = catch_panic(|| write(&Progress::new(&report, control)));
        let status = self.queue.end(id, done);
        self.current_job.end();
        (self.tell)(Event::Exported(status));
    }
}
