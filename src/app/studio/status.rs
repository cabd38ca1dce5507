//! Status from the worker's events: possible actions, the running job, and failures.

use base::progress::Report;
use std::collections::VecDeque;
use std::time::{Duration, Instant};
use worker::{Blocked, Event, ExportStatus, Need};

/// Possible actions at present.
#[derive(Clone, Debug, PartialEq)]
pub enum Phase {
    /// No project is open.
    NoProject,
    /// The calibration and the network are being read.
    Opening,
    /// Nothing can be predicted, with the reason.
    Blocked(Blocked),
    /// Pictures can be made; with the device of the network.
    Ready { device: String },
}

impl Phase {
    /// True while the project waits for its mattes or its calibration. Its footage can already be read.
    pub fn waits_for_job(&self) -> bool {
        let needs = [Some(Need::Mattes), Some(Need::Calibration)];
        matches!(self, Self::Blocked(blocked) if needs.contains(&blocked.need))
    }
}

/// A running job.
#[derive(Clone, Debug, PartialEq)]
pub struct RunningJob {
    pub what: &'static str,
    pub stage: &'static str,
    /// Finished share of the stage, from 0 to 1.
    pub share: f32,
    pub note: String,
    /// Its last message; the log keeps all messages.
    pub said: Option<String>,
    /// Problem to fix before it can continue.
    pub held: Option<String>,
    /// A stop was requested.
    pub stopping: bool,
    /// Start of the stage, not counting pauses, and the share finished at that time.
    since: Instant,
    first_share: f32,
    /// Time of the pause request.
    paused: Option<Instant>,
}

/// End of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lasts {
    /// With the next key or click, or after some seconds.
    ToPress,
    /// After some seconds.
    Seconds,
    /// When it is closed: it asks for something.
    ToClose,
}

/// Style of a log line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    Info,
    Error,
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// Minutes and seconds since the window was opened.
    pub time: String,
    pub severity: Severity,
    pub sentence: String,
}

impl std::fmt::Display for LogLine {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} {}", self.time, self.sentence)
    }
}

/// Time for which a message that asks for nothing stays.
const MESSAGE_STAYS: Duration = Duration::from_secs(6);

/// Most lines in the log.
const LOG_LINES: usize = 1000;

/// Possible actions at present, the running job, and failures.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    pub phase: Phase,
    /// The running job. Pictures are made concurrently.
    pub job: Option<RunningJob>,
    /// Reason that the last requested picture could not be made.
    pub failure: Option<String>,
    /// Reason that a command was refused. It stays until dismissed, or until a later action answers it.
    pub refusal: Option<String>,
    /// Message over the window: the end of the last job, or its advice.
    pub message: Option<String>,
    lasts: Lasts,
    /// Time of the message.
    said: Instant,
    /// All messages, newest last.
    pub log: VecDeque<LogLine>,
    /// Opening time of the window.
    opened: Instant,
}

impl Status {
    /// Status of a new window.
    pub fn new(phase: Phase) -> Self {
        Self {
            phase,
            job: None,
            failure: None,
            refusal: None,
            message: None,
            lasts: Lasts::Seconds,
            said: Instant::now(),
            log: VecDeque::new(),
            opened: Instant::now(),
        }
    }

    /// Resets the status for another project; the log stays.
    pub fn begin(&mut self, phase: Phase) {
        *self = Self { log: std::mem::take(&mut self.log), opened: self.opened, ..Self::new(phase) };
    }

    /// Shows the reason that something could not be done or written.
    pub fn refuse(&mut self, sentence: String) {
        self.note(Severity::Error, &sentence);
        self.refusal = Some(sentence);
    }

    /// Shows a message for some seconds.
    pub fn say(&mut self, sentence: String) {
        self.show(Severity::Info, sentence, Lasts::Seconds);
    }

    /// Shows a message until it is closed: something is to be done about it.
    pub fn advise(&mut self, sentence: String) {
        self.show(Severity::Info, sentence, Lasts::ToClose);
    }

    /// Shows a message until the next key or click, for some seconds at most.
    pub fn mention(&mut self, sentence: String) {
        self.show(Severity::Info, sentence, Lasts::ToPress);
    }

    fn show(&mut self, severity: Severity, sentence: String, lasts: Lasts) {
        self.note(severity, &sentence);
        (self.message, self.lasts, self.said) = (Some(sentence), lasts, Instant::now());
    }

    /// Time until the message goes; None if it stays until it is closed.
    pub fn message_left(&self) -> Option<Duration> {
        let left = MESSAGE_STAYS.saturating_sub(self.said.elapsed());
        (self.lasts != Lasts::ToClose).then_some(left)
    }

    /// Handles a key press or a pointer button.
    pub fn pressed(&mut self) {
        if self.lasts == Lasts::ToPress {
            self.message = None;
        }
    }

    fn note(&mut self, severity: Severity, sentence: &str) {
        let seconds = self.opened.elapsed().as_secs();
        let line =
            LogLine { time: format!("{}:{:02}", seconds / 60, seconds % 60), severity, sentence: sentence.to_owned() };
        // Repeats are skipped: a failing picture is requested again and again.
        let last = self.log.back();
        if last.is_none_or(|last| (last.severity, &last.sentence) != (severity, &line.sentence)) {
            self.log.push_back(line);
            if self.log.len() > LOG_LINES {
                self.log.pop_front();
            }
        }
    }

    /// Takes in an event.
    pub fn on_event(&mut self, event: Event) {
        match event {
            Event::Opening => self.phase = Phase::Opening,
            Event::Ready { device } => {
                // The library's name belongs in reports only.
                let device = device.replacen(" (flex)", "", 1).replacen(" (wgpu)", "", 1);
                self.phase = Phase::Ready { device };
            }
            Event::Blocked(why) => {
                self.note(Severity::Error, &why.sentence);
                self.phase = Phase::Blocked(why);
            }
            Event::Failed { sentence } => {
                self.note(Severity::Error, &sentence);
                self.failure = Some(sentence);
            }
            Event::Started { what } => {
                (self.failure, self.refusal, self.message) = (None, None, None);
                self.job = Some(RunningJob::new(what));
            }
            Event::Report(Report::Say(sentence)) => {
                self.note(Severity::Info, &sentence);
                if let Some(job) = &mut self.job {
                    job.said = Some(sentence);
                }
            }
            Event::Report(Report::Advise { sentence, .. }) => self.advise(sentence),
            Event::Finished { sentence } => {
                self.say(sentence);
                self.job = None;
                if matches!(self.phase, Phase::Blocked(_)) {
                    // The job may have made what was missing; the worker checks now.
                    self.phase = Phase::Opening;
                }
            }
            Event::Exported(standing) => {
                let (severity, lasts) = match standing {
                    ExportStatus::Failed(_) => (Severity::Error, Lasts::ToClose),
                    _ => (Severity::Info, Lasts::Seconds),
                };
                self.job = None;
                if let Some(sentence) = standing.sentence() {
                    self.show(severity, sentence.to_owned(), lasts);
                }
            }
            Event::Report(Report::Blocked(sentence)) => {
                if let Some(job) = &mut self.job {
                    job.pause(true, Instant::now());
                    job.held = Some(sentence.clone());
                }
                self.note(Severity::Error, &sentence);
            }
            Event::Report(Report::Saved | Report::Training(_)) => {}
            Event::Report(Report::Step { stage, done, total, note }) => {
                if let Some(job) = &mut self.job {
                    let share = (done as f32 / total.max(1) as f32).clamp(0.0, 1.0);
                    job.step(stage, share, note, Instant::now());
                }
            }
        }
    }
}

impl RunningJob {
    fn new(what: &'static str) -> Self {
        Self {
            what,
            stage: what,
            share: 0.0,
            note: String::new(),
            said: None,
            held: None,
            stopping: false,
            since: Instant::now(),
            first_share: 0.0,
            paused: None,
        }
    }

    fn step(&mut self, stage: &'static str, share: f32, note: String, now: Instant) {
        if self.stage != stage {
            (self.stage, self.since, self.first_share) = (stage, now, share);
        }
        (self.share, self.note) = (share, note);
    }

    /// True if a pause was requested.
    pub fn is_paused(&self) -> bool {
        self.paused.is_some()
    }

    /// Records a request at `now` to pause or to resume.
    pub fn pause(&mut self, pause: bool, now: Instant) {
        match (self.paused, pause) {
            (None, true) => self.paused = Some(now),
            (Some(since), false) => {
                self.since += now.saturating_duration_since(since);
                self.paused = None;
                self.held = None;
            }
            _ => {}
        }
    }

    /// Time left of the stage at `now`; None while paused, and until it can be estimated.
    pub fn left(&self, now: Instant) -> Option<Duration> {
        let gone = self.share - self.first_share;
        (gone >= 0.01 && !self.is_paused()).then(|| {
            let elapsed = now.saturating_duration_since(self.since);
            elapsed.mul_f32((1.0 - self.share) / gone)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use worker::Need;

    fn step(stage: &'static str, done: u64) -> Event {
        Event::Report(Report::Step { stage, done, total: 4, note: String::new() })
    }

    fn ready() -> Phase {
        Phase::Ready { device: "CPU".into() }
    }

    #[test]
    fn a_job_shows_its_share_and_its_end() {
        let mut status = Status::new(Phase::Opening);
        let blocked = Blocked { sentence: "no network".into(), need: Some(Need::Calibration) };
        status.on_event(Event::Blocked(blocked.clone()));
        status.on_event(Event::Started { what: "training the network" });
        status.on_event(step("reading", 4));
        status.on_event(step("training", 0));
        status.on_event(step("training", 1));
        let job = status.job.as_ref().unwrap();
        assert_eq!((job.stage, job.share), ("training", 0.25));
        assert_eq!(status.phase, Phase::Blocked(blocked));
        status.on_event(Event::Finished { sentence: "trained".into() });
        assert_eq!(status.phase, Phase::Opening, "the network is opened again after the job");
        status.on_event(Event::Opening);
        status.on_event(Event::Ready { device: "CPU".into() });
        assert_eq!((&status.phase, &status.job), (&ready(), &None));
        assert_eq!(status.message.as_deref(), Some("trained"));
    }

    #[test]
    fn the_device_is_named_without_the_library_that_computes() {
        let mut status = Status::new(Phase::Opening);
        for (told, shown) in [
            ("CPU (flex): no GPU was found", "CPU: no GPU was found"),
            ("GPU (wgpu): RTX (TM) 4090", "GPU: RTX (TM) 4090"),
            ("CPU (flex); pictures: GPU RTX (TM) 4090", "CPU; pictures: GPU RTX (TM) 4090"),
        ] {
            let device = told.to_owned();
            status.on_event(Event::Ready { device });
            let device = shown.to_owned();
            assert_eq!(status.phase, Phase::Ready { device });
        }
    }

    #[test]
    fn a_job_leaves_the_window_as_ready_as_it_was() {
        let mut status = Status::new(ready());
        status.on_event(Event::Started { what: "measuring" });
        status.on_event(step("measuring", 1));
        status.on_event(Event::Report(Report::Saved));
        assert_eq!(status.phase, ready());
        status.on_event(Event::Finished { sentence: "measured".into() });
        assert_eq!(status.phase, ready());
    }

    #[test]
    fn what_was_said_stays_in_the_log_of_the_next_project_and_is_bounded() {
        let mut status = Status::new(ready());
        status.on_event(Event::Failed { sentence: "no such file".into() });
        status.refuse("no such file".into());
        status.on_event(Event::Finished { sentence: "trained".into() });
        status.begin(Phase::Opening);
        let kinds: Vec<Severity> = status.log.iter().map(|line| line.severity).collect();
        assert_eq!(kinds, [Severity::Error, Severity::Info]);
        assert_eq!((&status.failure, &status.refusal, &status.message), (&None, &None, &None));
        (0..2 * LOG_LINES).for_each(|i| status.refuse(i.to_string()));
        assert_eq!(status.log.len(), LOG_LINES);
        assert!(status.log[LOG_LINES - 1].to_string().ends_with("1999"));
    }

    #[test]
    fn an_export_leaves_a_sentence_and_the_window_as_it_was() {
        let blocked = Phase::Blocked(Blocked { sentence: "no network".into(), need: None });
        let mut status = Status::new(blocked.clone());
        for (standing, severity) in [
            (ExportStatus::Failed("disk full".into()), Severity::Error),
            (ExportStatus::Cancelled("2 frames are kept".into()), Severity::Info),
        ] {
            status.on_event(Event::Started { what: "exporting" });
            assert!(status.job.is_some());
            status.on_event(Event::Exported(standing.clone()));
            assert_eq!((&status.job, &status.phase), (&None, &blocked));
            assert_eq!(status.message.as_deref(), standing.sentence());
            assert_eq!(status.log.back().unwrap().severity, severity);
        }
    }

    #[test]
    fn what_is_mentioned_goes_with_the_next_press_and_what_is_said_stays() {
        let mut status = Status::new(ready());
        status.mention("solo ended".into());
        assert_eq!(status.message.as_deref(), Some("solo ended"));
        status.pressed();
        assert_eq!(status.message, None);
        assert_eq!(status.log.back().unwrap().sentence, "solo ended");
        status.mention("solo ended".into());
        status.say("saved".into());
        status.pressed();
        assert_eq!(status.message.as_deref(), Some("saved"));
        assert!(status.message_left().is_some_and(|left| left <= MESSAGE_STAYS));
        status.advise("add an environment".into());
        assert_eq!(status.message_left(), None);
    }

    #[test]
    fn a_running_job_shows_what_it_advises_and_logs_what_it_says() {
        let mut status = Status::new(ready());
        status.on_event(Event::Started { what: "training" });
        status.on_event(Event::Report(Report::Say("on the CPU".into())));
        assert_eq!(status.message, None);
        let job = status.job.as_ref().unwrap();
        assert_eq!(job.said.as_deref(), Some("on the CPU"));
        assert_eq!(status.log.back().unwrap().sentence, "on the CPU");
        status.on_event(Event::Report(Report::Advise { sentence: "Train again".into(), how: "--fresh".into() }));
        assert_eq!(status.message.as_deref(), Some("Train again"));
    }

    #[test]
    fn work_that_waits_for_a_person_is_paused_and_says_why() {
        let mut status = Status::new(ready());
        status.on_event(Event::Started { what: "training" });
        status.on_event(Event::Report(Report::Blocked("no space left".into())));
        let job = status.job.as_mut().unwrap();
        assert!(job.is_paused());
        assert_eq!(job.held.as_deref(), Some("no space left"));
        job.pause(false, Instant::now());
        assert_eq!(job.held, None);
        assert_eq!(status.log.back().unwrap().severity, Severity::Error);
    }

    #[test]
    fn a_late_report_does_not_bring_a_job_back() {
        let mut status = Status::new(ready());
        status.on_event(step("training", 1));
        assert_eq!((&status.phase, &status.job), (&ready(), &None));
    }

    #[test]
    fn time_left_counts_neither_pauses_nor_what_was_finished_before() {
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        let mut job = RunningJob::new("training");
        job.step("epochs", 0.5, String::new(), start);
        assert_eq!(job.left(at(10)), None, "too early for an estimate");
        job.pause(true, at(10));
        assert_eq!(job.left(at(500)), None);
        job.pause(false, at(1010));
        job.step("epochs", 0.75, String::new(), at(1030));
        assert_eq!(job.left(at(1030)), Some(Duration::from_secs(30)));
    }
}
