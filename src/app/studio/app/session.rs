//! The open project, the threads behind it, and the right to write into it.

use base::error::Error;
use project::{Lock, Project};
use std::path::Path;
use worker::background::drop_later;
use worker::{Job, Worker};

/// The open project, its worker and its lock.
#[derive(Default)]
pub struct Session {
    pub project: Option<Project>,
    /// It may run before a project is open, for the job that makes one.
    pub worker: Option<Worker>,
    /// Keeps others from writing into the project.
    lock: Option<Lock>,
    /// Reason nothing can be written into it: another process holds its lock.
    pub read_only: Option<String>,
}

impl Session {
    /// Opens `project`, with `worker` behind it, in place of the one before.
    pub fn open(&mut self, project: Project, mut worker: Worker) {
        let before = self.take_lock(&project.root);
        if let Some(why) = &self.read_only {
            worker.refuse_writes(why.clone());
        }
        self.project = Some(project);
        // The old worker is joined in the background: it may be in a training step, and keeps the right to
        // write its checkpoint until then.
        let old = (self.worker.replace(worker), before);
        drop_later(old);
    }

    /// True if the open project is the one in `root`, by whatever path.
    pub fn is_of(&self, root: &Path) -> bool {
        let full = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let mut open = self.project.iter().map(|project| &project.root);
        open.any(|open| open == root || full(open) == full(root))
    }

    /// Takes the lock of the project in `root`, unless it is held already; returns the one before.
    fn take_lock(&mut self, root: &Path) -> Option<Lock> {
        let is_open = self.is_of(root);
        let before = self.lock.take();
        if is_open && before.is_some() {
            self.lock = before;
            return None;
        }
        let taken = Lock::take(root, "the studio");
        self.read_only = taken.as_ref().err().map(ToString::to_string);
        self.lock = taken.ok();
        before
    }

    /// Check that the project can be written.
    ///
    /// # Errors
    /// The reason it cannot.
    pub fn writable(&self) -> Result<(), String> {
        said(self.worker.as_ref().map_or(Ok(()), Worker::writable))
    }

    /// Check that neither a job nor an export runs.
    ///
    /// # Errors
    /// The reason for the wait.
    pub fn idle(&self) -> Result<(), String> {
        said(self.worker.as_ref().map_or(Ok(()), Worker::idle))
    }

    /// Check that no job runs, which another project would stop.
    ///
    /// # Errors
    /// The job that runs, and the way to stop it.
    pub fn can_leave(&self) -> Result<(), String> {
        match self.worker.as_ref().and_then(Worker::running_job) {
            Some(job) => {
                Err(format!("A job is running: {job}. Wait until it ends, or stop it first"))
            }
            None => Ok(()),
        }
    }

    /// Runs a job on the open project.
    ///
    /// # Errors
    /// Why it cannot run now, and what to do.
    pub fn run(&self, job: impl FnOnce(&Project) -> Job) -> Result<(), String> {
        let (Some(project), Some(worker)) = (&self.project, &self.worker) else {
            return Err("Open a project first".to_owned());
        };
        said(worker.run(job(project)))
    }
}

/// The error as the sentence that the window shows.
fn said(done: Result<(), Error>) -> Result<(), String> {
    done.map_err(|e| e.to_string())
}
