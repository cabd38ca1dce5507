//! What the worker tells the window: numbers and sentences. Heavy things go through [`super::Latest`].

use crate::progress::Report;
use std::sync::{Mutex, PoisonError};

/// One piece of news.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The calibration and the network are being read.
    Opening,
    /// Frames can be predicted; `device` says where and why there.
    Ready { device: String },
    /// Nothing can be predicted.
    Blocked(Blocked),
    /// A frame or a picture could not be made.
    Failed { sentence: String },
    /// A job began.
    Started { what: &'static str },
    /// A running job reports.
    Report(Report),
    /// A job is over; the sentence says what came of it.
    Finished { sentence: String },
}

/// Why a project cannot be relit.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocked {
    /// Why, and what to do.
    pub sentence: String,
    /// What a job would bring.
    pub need: Option<Need>,
}

/// What a project lacks before it can be relit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// The shoot, which is not where it was.
    Shoot,
    Calibration,
    Network,
}

/// Events that the window has not read yet. A job's step replaces the step before it, so that a window
/// that is not drawn for hours finds a handful, and misses no end of a job.
#[derive(Default)]
pub(super) struct Unread(Mutex<Vec<Event>>);

impl Unread {
    pub fn push(&self, event: Event) {
        let step = |event: &Event| matches!(event, Event::Report(Report::Step { .. }));
        // A list is whole at any time, even where a thread panicked with the lock in hand.
        let mut events = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match events.last_mut() {
            Some(last) if step(last) && step(&event) => *last = event,
            _ => events.push(event),
        }
    }

    pub fn take(&self) -> Vec<Event> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_that_looks_away_finds_the_newest_step_and_every_end() {
        let unread = Unread::default();
        let step = |done| {
            Event::Report(Report::Step {
                stage: "training",
                done,
                total: 1000,
                note: String::new(),
            })
        };
        let finished = Event::Finished {
            sentence: "trained".to_owned(),
        };
        unread.push(Event::Started { what: "training" });
        (0..1000).for_each(|done| unread.push(step(done)));
        unread.push(finished.clone());
        let started = Event::Started { what: "training" };
        assert_eq!(unread.take(), [started, step(999), finished]);
        assert_eq!(unread.take(), []);
    }
}
