//! Channel between long work and its caller: progress out, stop requests in.

mod training;

pub use training::{LossPoint, TrainingPhase, TrainingPictures, TrainingPoint};

use crate::error::{Error, Result};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// One report of a long action.
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// `done` of `total` units of `stage` are finished; `note` is a short live remark (a loss, a file).
    Step { stage: &'static str, done: u64, total: u64, note: String },
    /// A usable network has been saved.
    Saved,
    /// State of a training run.
    Training(TrainingPoint),
    /// The work waits until the user has solved the problem in the sentence and lets it continue.
    Blocked(String),
    /// A sentence worth logging: a warning, a fallback, a written file.
    Say(String),
    /// A sentence with its remedy on the command line, which is shown only in a terminal.
    Advise { sentence: String, how: String },
}

/// Stops and pauses running work. Clones control the same work.
#[derive(Clone, Debug, Default)]
pub struct Control {
    stop: Arc<AtomicBool>,
    pause: Arc<AtomicBool>,
}

impl Control {
    /// Requests a stop at the next safe point.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// True if a stop was requested.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Requests a pause at the next safe point, or its end.
    pub fn pause(&self, pause: bool) {
        self.pause.store(pause, Ordering::Relaxed);
    }

    /// True if a pause was requested.
    pub fn paused(&self) -> bool {
        self.pause.load(Ordering::Relaxed)
    }
}

/// Time between checks for the end of a pause.
const PAUSE_INTERVAL: Duration = Duration::from_millis(20);

/// Input of long-running functions: the receiver of reports, and the control that stops and pauses them.
pub struct Progress<'a> {
    sink: &'a (dyn Fn(Report) + Sync),
    pictures: Option<&'a (dyn Fn(TrainingPictures) + Sync)>,
    /// True if a user is there to end a pause.
    attended: bool,
    control: Control,
}

impl<'a> Progress<'a> {
    /// Sends reports to `sink`; `control` stops and pauses the work.
    pub fn new(sink: &'a (dyn Fn(Report) + Sync), control: Control) -> Self {
        Self { sink, pictures: None, attended: false, control }
    }

    /// The same, with training's pictures sent to `pictures`, which may skip all but the newest.
    pub fn with_pictures(self, pictures: &'a (dyn Fn(TrainingPictures) + Sync)) -> Self {
        Self { pictures: Some(pictures), ..self }
    }

    /// The same, with a user there to end a pause.
    pub fn attended(self) -> Self {
        Self { attended: true, ..self }
    }

    /// Reports nothing and never stops: for tests and short work.
    pub fn silent() -> Progress<'static> {
        Progress { sink: &|_| {}, pictures: None, attended: false, control: Control::default() }
    }

    /// Result of `act`, and the sentences it reports, a line each: for tests.
    pub fn heard<T>(act: impl FnOnce(&Progress) -> T) -> (T, String) {
        let said = Mutex::new(String::new());
        let sink = |report: Report| {
            if let Report::Say(sentence) | Report::Advise { sentence, .. } = report {
                *said.lock().unwrap_or_else(PoisonError::into_inner) += &format!("{sentence}\n");
            }
        };
        let result = act(&Progress::new(&sink, Control::default()));
        (result, said.into_inner().unwrap_or_else(PoisonError::into_inner))
    }

    /// Reports that `done` of `total` units are finished.
    pub fn step(&self, stage: &'static str, done: u64, total: u64, note: impl Into<String>) {
        (self.sink)(Report::Step { stage, done, total, note: note.into() });
    }

    /// Reports a sentence for the log.
    pub fn say(&self, sentence: impl Into<String>) {
        (self.sink)(Report::Say(sentence.into()));
    }

    /// Reports a sentence for the log, and its remedy on the command line.
    pub fn advise(&self, sentence: impl Into<String>, how: impl Into<String>) {
        (self.sink)(Report::Advise { sentence: sentence.into(), how: how.into() });
    }

    /// Reports a sentence about an error, with the error's command-line remedy if it has one.
    pub fn report(&self, sentence: impl Into<String>, error: &Error) {
        match error.how() {
            Some(how) => self.advise(sentence, how),
            None => self.say(sentence),
        }
    }

    /// Reports that a usable network has been saved.
    pub fn saved(&self) {
        (self.sink)(Report::Saved);
    }

    /// Reports the state of a training run.
    pub fn training(&self, point: TrainingPoint) {
        (self.sink)(Report::Training(point));
    }

    /// True if pictures are shown anywhere.
    pub fn wants_pictures(&self) -> bool {
        self.pictures.is_some()
    }

    /// Shows training's pictures, if they are shown anywhere.
    pub fn show(&self, pictures: TrainingPictures) {
        if let Some(show) = self.pictures {
            show(pictures);
        }
    }

    /// True if a stop was requested.
    pub fn cancelled(&self) -> bool {
        self.control.stopped()
    }

    /// True if a pause was requested.
    pub fn paused(&self) -> bool {
        self.control.paused()
    }

    /// Waits for the end of a pause, or a stop.
    pub fn wait_while_paused(&self) {
        while self.paused() && !self.cancelled() {
            std::thread::sleep(PAUSE_INTERVAL);
        }
    }

    /// Runs `act`. If the operating system refuses a file, as on a full disk, and a user is there: pauses,
    /// reports the problem, and tries again when the user lets it continue.
    ///
    /// # Errors
    /// When it fails for another reason, no user is there, or a stop was requested.
    pub fn retry<T>(&self, mut act: impl FnMut() -> Result<T>) -> Result<T> {
        loop {
            let done = act();
            let Err(error @ Error::Io { .. }) = &done else { return done };
            if !self.attended || self.cancelled() {
                return done;
            }
            self.control.pause(true);
            (self.sink)(Report::Blocked(error.to_string()));
            self.wait_while_paused();
        }
    }

    /// A safe point: waits for the end of a pause, and fails with [`Error::Cancelled`] once a stop was requested.
    /// `kept` names the output that survives.
    pub fn check(&self, kept: &str) -> Result<()> {
        // Threads of the pool also make pictures, so they do not wait here.
        if rayon::current_thread_index().is_none() {
            self.wait_while_paused();
        }
        if self.cancelled() { Err(Error::Cancelled { kept: kept.to_owned() }) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full() -> Result<()> {
        let remedy = "Check that the disk has room";
        Err(Error::io("write", "weights.bpk", std::io::ErrorKind::StorageFull.into(), remedy))
    }

    #[test]
    fn what_a_person_can_put_right_is_tried_again_when_they_let_it_go_on() {
        let control = Control::default();
        let said = Mutex::new(Vec::new());
        let sink = |report| {
            assert!(control.paused(), "it pauses before it reports");
            said.lock().unwrap().push(report);
            control.pause(false);
        };
        let progress = Progress::new(&sink, control.clone()).attended();
        let mut tries = 0;
        let written = progress.retry(|| {
            tries += 1;
            if tries < 3 { full() } else { Ok(()) }
        });
        assert!(written.is_ok() && tries == 3);
        let held = Report::Blocked(full().unwrap_err().to_string());
        assert_eq!(*said.lock().unwrap(), [held.clone(), held]);
    }

    #[test]
    fn nobody_is_waited_for_where_nobody_is_and_a_stop_ends_the_wait() {
        assert!(Progress::silent().retry(full).is_err());
        let control = Control::default();
        let sink = |_| control.stop();
        let progress = Progress::new(&sink, control.clone()).attended();
        assert!(progress.retry(full).is_err());
    }

    #[test]
    fn what_no_person_can_put_right_is_not_tried_again() {
        let control = Control::default();
        let said = AtomicBool::new(false);
        let sink = |_| said.store(true, Ordering::Relaxed);
        let progress = Progress::new(&sink, control.clone()).attended();
        let mut tries = 0;
        let failed = progress.retry(|| -> Result<()> {
            tries += 1;
            Err(Error::bug("a state that cannot be packed"))
        });
        assert!(matches!(failed, Err(Error::Bug { .. })) && tries == 1);
        assert!(!control.paused() && !said.into_inner());
    }
}
