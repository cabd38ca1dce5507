//! What the worker's events add up to: what the window can do now, which job runs, and what went wrong.

use base::progress::Report;
use std::collections::VecDeque;
use std::time::{Duration, Instant};
use worker::{Blocked, Event, Standing};

/// What the window can do now.
#[derive(Clone, Debug, PartialEq)]
pub enum Phase {
    /// No project is open.
    NoProject,
    /// The calibration and the network are being read.
    Opening,
    /// Nothing can be predicted, and why.
    Blocked(Blocked),
    /// Pictures can be made; where the network runs.
    Ready { device: String },
}

/// A running job.
#[derive(Clone, Debug, PartialEq)]
pub struct Work {
    pub what: &'static str,
    pub stage: &'static str,
    /// Finished share of the stage, from 0 to 1.
    pub share: f32,
    pub note: String,
    /// What has to be put right before it can go on.
    pub held: Option<String>,
    /// Whether it was asked to stop.
    pub stopping: bool,
    /// When the stage began, pauses since then left out, and the share that was finished then.
    since: Instant,
    first_share: f32,
    /// When it was asked to pause.
    paused: Option<Instant>,
}

/// Whether a sentence is good news.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Said,
    Failed,
}

/// A sentence that was said, and when.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// Minutes and seconds since the window was opened.
    pub time: String,
    pub kind: Kind,
    pub sentence: String,
}

impl std::fmt::Display for LogLine {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} {}", self.time, self.sentence)
    }
}

/// Sentences that the log keeps.
const LOG_LINES: usize = 1000;

/// The state of affairs.
#[derive(Clone, Debug, PartialEq)]
pub struct News {
    pub phase: Phase,
    /// The job that runs beside whatever can be done.
    pub work: Option<Work>,
    /// Why the picture that was asked for last could not be made.
    pub failure: Option<String>,
    /// Why something that a person did could not be done. It stays until it is put away, or until something
    /// that is done later answers it.
    pub refusal: Option<String>,
    /// The last sentence of a job.
    pub said: Option<String>,
    /// All sentences, the newest last.
    pub log: VecDeque<LogLine>,
    /// When the window was opened.
    opened: Instant,
}

impl News {
    /// Before anything happened.
    pub fn new(phase: Phase) -> Self {
        Self {
            phase,
            work: None,
            failure: None,
            refusal: None,
            said: None,
            log: VecDeque::new(),
            opened: Instant::now(),
        }
    }

    /// Another project was opened: what was said before stays in the log.
    pub fn begin(&mut self, phase: Phase) {
        *self = Self {
            log: std::mem::take(&mut self.log),
            opened: self.opened,
            ..Self::new(phase)
        };
    }

    /// Something that a person did, or that was to be written, could not be done.
    pub fn refuse(&mut self, sentence: String) {
        self.note(Kind::Failed, &sentence);
        self.refusal = Some(sentence);
    }

    /// Something is to be known.
    pub fn say(&mut self, sentence: String) {
        self.note(Kind::Said, &sentence);
        self.said = Some(sentence);
    }

    fn note(&mut self, kind: Kind, sentence: &str) {
        let seconds = self.opened.elapsed().as_secs();
        let line = LogLine {
            time: format!("{}:{:02}", seconds / 60, seconds % 60),
            kind,
            sentence: sentence.to_owned(),
        };
        // The same again and again says nothing new: a failing picture is asked for at every turn.
        let last = self.log.back();
        if last.is_none_or(|last| (last.kind, &last.sentence) != (kind, &line.sentence)) {
            self.log.push_back(line);
            if self.log.len() > LOG_LINES {
                self.log.pop_front();
            }
        }
    }

    /// Takes an event in.
    pub fn hear(&mut self, event: Event) {
        match event {
            Event::Opening => self.phase = Phase::Opening,
            Event::Ready { device } => self.phase = Phase::Ready { device },
            Event::Blocked(why) => {
                self.note(Kind::Failed, &why.sentence);
                self.phase = Phase::Blocked(why);
            }
            Event::Failed { sentence } => {
                self.note(Kind::Failed, &sentence);
                self.failure = Some(sentence);
            }
            Event::Started { what } => {
                (self.failure, self.refusal, self.said) = (None, None, None);
                self.work = Some(Work::new(what));
            }
            Event::Report(Report::Say(sentence)) => self.say(sentence),
            Event::Finished { sentence } => {
                self.say(sentence);
                self.work = None;
                if matches!(self.phase, Phase::Blocked(_)) {
                    // The job may have brought what was missing: the worker looks now.
                    self.phase = Phase::Opening;
                }
            }
            Event::Exported(standing) => {
                let kind = match standing {
                    Standing::Failed(_) => Kind::Failed,
                    _ => Kind::Said,
                };
                self.work = None;
                if let Some(sentence) = standing.sentence() {
                    self.note(kind, sentence);
                    self.said = Some(sentence.to_owned());
                }
            }
            Event::Report(Report::Blocked(sentence)) => {
                if let Some(work) = &mut self.work {
                    work.pause(true, Instant::now());
                    work.held = Some(sentence.clone());
                }
                self.note(Kind::Failed, &sentence);
            }
            Event::Report(Report::Saved | Report::Training(_)) => {}
            Event::Report(Report::Step {
                stage,
                done,
                total,
                note,
            }) => {
                if let Some(work) = &mut self.work {
                    let share = (done as f32 / total.max(1) as f32).clamp(0.0, 1.0);
                    work.step(stage, share, note, Instant::now());
                }
            }
        }
    }
}

impl Work {
    fn new(what: &'static str) -> Self {
        Self {
            what,
            stage: what,
            share: 0.0,
            note: String::new(),
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

    /// Whether it was asked to pause.
    pub fn is_paused(&self) -> bool {
        self.paused.is_some()
    }

    /// Notes at `now` that it was asked to pause, or to go on.
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

    /// Time left of the stage at `now`; none in a pause, nor before there is anything to go by.
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
        Event::Report(Report::Step {
            stage,
            done,
            total: 4,
            note: String::new(),
        })
    }

    fn ready() -> Phase {
        Phase::Ready {
            device: "CPU".into(),
        }
    }

    #[test]
    fn a_job_shows_its_share_and_its_end() {
        let mut news = News::new(Phase::Opening);
        let blocked = Blocked {
            sentence: "no network".into(),
            need: Some(Need::Network),
        };
        news.hear(Event::Blocked(blocked.clone()));
        news.hear(Event::Started {
            what: "training the network",
        });
        news.hear(step("reading", 4));
        news.hear(step("training", 0));
        news.hear(step("training", 1));
        let work = news.work.as_ref().unwrap();
        assert_eq!((work.stage, work.share), ("training", 0.25));
        assert_eq!(news.phase, Phase::Blocked(blocked));
        news.hear(Event::Finished {
            sentence: "trained".into(),
        });
        assert_eq!(
            news.phase,
            Phase::Opening,
            "what it brought is not asked for again"
        );
        news.hear(Event::Opening);
        news.hear(Event::Ready {
            device: "CPU".into(),
        });
        assert_eq!((&news.phase, &news.work), (&ready(), &None));
        assert_eq!(news.said.as_deref(), Some("trained"));
    }

    #[test]
    fn a_job_leaves_the_window_as_ready_as_it_was() {
        let mut news = News::new(ready());
        news.hear(Event::Started { what: "measuring" });
        news.hear(step("measuring", 1));
        news.hear(Event::Report(Report::Saved));
        assert_eq!(news.phase, ready());
        news.hear(Event::Finished {
            sentence: "measured".into(),
        });
        assert_eq!(news.phase, ready());
    }

    #[test]
    fn what_was_said_stays_in_the_log_of_the_next_project_and_is_bounded() {
        let mut news = News::new(ready());
        news.hear(Event::Failed {
            sentence: "no such file".into(),
        });
        news.refuse("no such file".into());
        news.hear(Event::Finished {
            sentence: "trained".into(),
        });
        news.begin(Phase::Opening);
        let kinds: Vec<Kind> = news.log.iter().map(|line| line.kind).collect();
        assert_eq!(kinds, [Kind::Failed, Kind::Said]);
        assert_eq!(
            (&news.failure, &news.refusal, &news.said),
            (&None, &None, &None)
        );
        (0..2 * LOG_LINES).for_each(|i| news.refuse(i.to_string()));
        assert_eq!(news.log.len(), LOG_LINES);
        assert!(news.log[LOG_LINES - 1].to_string().ends_with("1999"));
    }

    #[test]
    fn an_export_leaves_a_sentence_and_the_window_as_it_was() {
        let blocked = Phase::Blocked(Blocked {
            sentence: "no network".into(),
            need: None,
        });
        let mut news = News::new(blocked.clone());
        for (standing, kind) in [
            (Standing::Failed("disk full".into()), Kind::Failed),
            (Standing::Cancelled("2 frames are kept".into()), Kind::Said),
        ] {
            news.hear(Event::Started { what: "exporting" });
            assert!(news.work.is_some());
            news.hear(Event::Exported(standing.clone()));
            assert_eq!((&news.work, &news.phase), (&None, &blocked));
            assert_eq!(news.said.as_deref(), standing.sentence());
            assert_eq!(news.log.back().unwrap().kind, kind);
        }
    }

    #[test]
    fn work_that_waits_for_a_person_is_paused_and_says_why() {
        let mut news = News::new(ready());
        news.hear(Event::Started { what: "training" });
        news.hear(Event::Report(Report::Blocked("no space left".into())));
        let work = news.work.as_mut().unwrap();
        assert!(work.is_paused());
        assert_eq!(work.held.as_deref(), Some("no space left"));
        work.pause(false, Instant::now());
        assert_eq!(work.held, None);
        assert_eq!(news.log.back().unwrap().kind, Kind::Failed);
    }

    #[test]
    fn a_late_report_does_not_bring_a_job_back() {
        let mut news = News::new(ready());
        news.hear(step("training", 1));
        assert_eq!((&news.phase, &news.work), (&ready(), &None));
    }

    #[test]
    fn time_left_counts_neither_pauses_nor_what_was_finished_before() {
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        let mut work = Work::new("training");
        work.step("epochs", 0.5, String::new(), start);
        assert_eq!(work.left(at(10)), None, "nothing to go by yet");
        work.pause(true, at(10));
        assert_eq!(work.left(at(500)), None);
        work.pause(false, at(1010));
        work.step("epochs", 0.75, String::new(), at(1030));
        assert_eq!(work.left(at(1030)), Some(Duration::from_secs(30)));
    }
}
