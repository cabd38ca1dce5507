//! The open project, its threads, and its write lock.

use crate::panel_context::OpenProject;
use base::error::Error;
use project::{Lock, Project};
use std::path::Path;
use worker::background::drop_later;
use worker::{Job, Worker};

/// The open project, its worker and its lock.
#[derive(Default)]
pub struct Session {
    pub project: Option<Project>,
    /// May run before a project is open, for the job that makes one.
    pub worker: Option<Worker>,
    /// Keeps other processes from writing to the project.
    lock: Option<Lock>,
    /// Reason the project is read-only: another process holds its lock.
    pub read_only: Option<String>,
}

impl Session {
    /// Replaces the open project with `project` and its `worker`.
    pub fn open(&mut self, project: Project, mut worker: Worker) {
        let before = self.take_lock(&project.root);
        if let Some(why) = &self.read_only {
            worker.refuse_writes(why.clone());
        }
        self.project = Some(project);
        // The old worker is joined in the background: it may be in a training step, and keeps its write lock until the
        // checkpoint is saved.
        let old = (self.worker.replace(worker), before);
        drop_later(old);
    }

    /// The open project for the panels.
    pub fn shown(&self) -> OpenProject<'_> {
        OpenProject { project: self.project.as_ref(), read_only: self.read_only.as_deref() }
    }

    /// True if the open project is the one in `root`; symbolic links are resolved.
    pub fn is_of(&self, root: &Path) -> bool {
        let full = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let mut open = self.project.iter().map(|project| &project.root);
        open.any(|open| open == root || full(open) == full(root))
    }

    /// Takes the lock of the project in `root` unless already held. Returns the previous lock.
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

    /// Checks that the project can be written.
    ///
    /// # Errors
    /// The reason it is read-only.
    pub fn writable(&self) -> Result<(), String> {
        said(self.worker.as_ref().map_or(Ok(()), Worker::writable))
    }

    /// Checks that no job and no export is running.
    ///
    /// # Errors
    /// The reason to wait.
    pub fn idle(&self) -> Result<(), String> {
        said(self.worker.as_ref().map_or(Ok(()), Worker::idle))
    }

    /// Checks that no job is running, which opening another project would stop.
    ///
    /// # Errors
    /// The running job, and how to stop it.
    pub fn can_leave(&self) -> Result<(), String> {
        match self.worker.as_ref().and_then(Worker::running_job) {
            Some(job) => Err(format!("A job is running: {job}. Wait until it ends, or stop it first")),
            None => Ok(()),
        }
    }

    /// Runs a job on the open project.
    ///
    /// # Errors
    /// The reason it cannot run now, and the remedy.
    pub fn run(&self, job: impl FnOnce(&Project) -> Job) -> Result<(), String> {
        let (Some(project), Some(worker)) = (&self.project, &self.worker) else {
            return Err("Open a project first".to_owned());
        };
        said(worker.run(job(project)))
    }
}

/// The error as a sentence for the window.
fn said(done: Result<(), Error>) -> Result<(), String> {
    done.map_err(|e| e.to_string())
}
