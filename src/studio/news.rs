//! What the worker's events add up to: what the window can do now, and what went wrong.

use crate::progress::Report;
use crate::worker::{Blocked, Event};
use std::time::{Duration, Instant};

/// What the window can do now.
#[derive(Clone, Debug, PartialEq)]
pub enum Phase {
    /// No project is open.
    NoProject,
    /// The calibration and the network are being read.
    Opening,
    /// Nothing can be predicted, and why.
    Blocked(Blocked),
    /// A job runs.
    Working(Work),
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
    /// When the stage began.
    pub since: Instant,
}

/// The state of affairs.
#[derive(Clone, Debug, PartialEq)]
pub struct News {
    pub phase: Phase,
    /// Why what was asked for last could not be made.
    pub failure: Option<String>,
    /// The last sentence of a job.
    pub said: Option<String>,
}

impl News {
    /// Before anything happened.
    pub fn new(phase: Phase) -> Self {
        Self {
            phase,
            failure: None,
            said: None,
        }
    }

    /// Takes an event in.
    pub fn hear(&mut self, event: Event) {
        match event {
            Event::Opening => self.phase = Phase::Opening,
            Event::Ready { device } => self.phase = Phase::Ready { device },
            Event::Blocked(why) => self.phase = Phase::Blocked(why),
            Event::Failed { sentence } => self.failure = Some(sentence),
            Event::Started { what } => {
                self.failure = None;
                self.phase = Phase::Working(Work::new(what, what));
            }
            Event::Report(Report::Say(sentence)) | Event::Finished { sentence } => {
                self.said = Some(sentence);
            }
            Event::Report(Report::Saved) => {}
            Event::Report(Report::Step {
                stage,
                done,
                total,
                note,
            }) => {
                if let Phase::Working(work) = &mut self.phase {
                    if work.stage != stage {
                        *work = Work::new(work.what, stage);
                    }
                    work.share = (done as f32 / total.max(1) as f32).clamp(0.0, 1.0);
                    work.note = note;
                }
            }
        }
    }
}

impl Work {
    fn new(what: &'static str, stage: &'static str) -> Self {
        Self {
            what,
            stage,
            share: 0.0,
            note: String::new(),
            since: Instant::now(),
        }
    }

    /// Time left of the stage, after `elapsed` of it; none before there is anything to go by.
    pub fn left(&self, elapsed: Duration) -> Option<Duration> {
        (self.share >= 0.01).then(|| elapsed.mul_f32((1.0 - self.share) / self.share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::worker::Need;

    fn step(stage: &'static str, done: u64) -> Event {
        Event::Report(Report::Step {
            stage,
            done,
            total: 4,
            note: String::new(),
        })
    }

    #[test]
    fn a_job_shows_its_share_and_its_end() {
        let mut news = News::new(Phase::Opening);
        news.hear(Event::Blocked(Blocked {
            sentence: "no network".into(),
            need: Some(Need::Network),
        }));
        news.hear(Event::Started {
            what: "training the network",
        });
        news.hear(step("reading", 4));
        news.hear(step("training", 1));
        let Phase::Working(work) = &news.phase else {
            panic!("{:?}", news.phase)
        };
        assert_eq!((work.stage, work.share), ("training", 0.25));
        assert_eq!(
            work.left(Duration::from_secs(10)),
            Some(Duration::from_secs(30))
        );
        news.hear(Event::Finished {
            sentence: "trained".into(),
        });
        news.hear(Event::Opening);
        news.hear(Event::Ready {
            device: "CPU".into(),
        });
        assert_eq!(
            news.phase,
            Phase::Ready {
                device: "CPU".into()
            }
        );
        assert_eq!(news.said.as_deref(), Some("trained"));
    }

    #[test]
    fn a_late_report_does_not_bring_a_job_back() {
        let mut news = News::new(Phase::Ready {
            device: "CPU".into(),
        });
        news.hear(step("training", 1));
        assert_eq!(
            news.phase,
            Phase::Ready {
                device: "CPU".into()
            }
        );
    }
}
