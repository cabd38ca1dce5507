//! The thread behind the window's badge: reads the project once, and checks it under the current light.

use super::background::{Background, Handler};
use super::latest::Latest;
use super::mailbox::Request;
use base::error::Result;
use base::progress::{Control, Progress};
use check::{CheckReport, Evidence, LitEnvironment};
use project::Project;
use std::path::PathBuf;
use std::sync::Arc;

/// An answer, or the reason that there is none.
type Answer = std::result::Result<Arc<CheckReport>, String>;

/// A request for a check.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckRequest {
    /// Count of possible changes of the project. The project is read again when it grows.
    pub changes: u64,
    /// The current light; None if there is none.
    pub environment: Option<LitEnvironment>,
}

/// The thread. Dropping it stops it after the current picture.
pub struct CheckThread {
    thread: Background<CheckRequest>,
    answers: Arc<Latest<Answer>>,
}

struct Checking {
    root: PathBuf,
    stop: Control,
    /// The last evidence, and the count of changes before it.
    evidence: Option<(u64, Evidence)>,
    answers: Arc<Latest<Answer>>,
}

impl CheckThread {
    /// Starts the thread on the project in `root`; `wake` is called after each answer.
    pub fn start(root: PathBuf, wake: impl Fn() + Send + Sync + 'static) -> Self {
        let answers = Arc::new(Latest::new(wake));
        let own = answers.clone();
        let thread = Background::spawn("check", move |stop| Checking {
            root,
            stop,
            evidence: None,
            answers: own,
        });
        Self { thread, answers }
    }

    /// Requests a report; replaces an earlier request that has not begun.
    pub fn ask(&self, request: CheckRequest) {
        self.thread.put(request);
    }

    /// The newest report, once.
    pub fn report(&self) -> Option<Answer> {
        self.answers.take()
    }
}

impl Request for CheckRequest {}

impl Handler for Checking {
    type Request = CheckRequest;
    type Answer = CheckReport;

    fn work(&mut self, request: &mut CheckRequest) -> Result<CheckReport> {
        let known = self.evidence.take();
        let known = known.filter(|(changes, _)| *changes == request.changes);
        let evidence = match known {
            Some((_, evidence)) => evidence,
            None => {
                let progress = Progress::new(&|_| {}, self.stop.clone());
                Evidence::read(&Project::open(&self.root)?, &progress)?
            }
        };
        let report = evidence.report(request.environment.as_slice());
        self.evidence = Some((request.changes, evidence));
        Ok(report)
    }

    fn deliver(&mut self, _: CheckRequest, answer: Result<CheckReport>) {
        self.answers.put(answer.map(Arc::new).map_err(|e| e.to_string()));
    }
}
