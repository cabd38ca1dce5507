//! How long work talks to whoever started it: progress out, a request to stop in.

use crate::error::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// One report of a long action.
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// `done` of `total` units of `stage` are finished; `note` is a short live remark (a loss, a file).
    Step {
        stage: &'static str,
        done: u64,
        total: u64,
        note: String,
    },
    /// A sentence worth keeping in the log: a warning, a fallback, where something was written.
    Say(String),
}

/// A flag that asks running work to stop at the next safe point. Clones share the flag.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Asks for the stop.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether a stop was asked for.
    pub fn requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// What long-running functions take: where reports go and whether to go on.
pub struct Progress<'a> {
    sink: &'a (dyn Fn(Report) + Sync),
    cancel: Cancel,
}

impl<'a> Progress<'a> {
    /// Reports go to `sink`; work stops once `cancel` is requested.
    pub fn new(sink: &'a (dyn Fn(Report) + Sync), cancel: Cancel) -> Self {
        Self { sink, cancel }
    }

    /// Reports nothing and never stops: for tests and short work.
    pub fn silent() -> Progress<'static> {
        Progress {
            sink: &|_| {},
            cancel: Cancel::default(),
        }
    }

    /// Reports that `done` of `total` units are finished.
    pub fn step(&self, stage: &'static str, done: u64, total: u64, note: impl Into<String>) {
        (self.sink)(Report::Step {
            stage,
            done,
            total,
            note: note.into(),
        });
    }

    /// Reports a sentence for the log.
    pub fn say(&self, sentence: impl Into<String>) {
        (self.sink)(Report::Say(sentence.into()));
    }

    /// Whether a stop was asked for.
    pub fn cancelled(&self) -> bool {
        self.cancel.requested()
    }

    /// Fails with [`Error::Cancelled`] once a stop was asked for. `kept` says what survives.
    pub fn check(&self, kept: &str) -> Result<()> {
        if self.cancelled() {
            Err(Error::Cancelled {
                kept: kept.to_owned(),
            })
        } else {
            Ok(())
        }
    }
}
