//! News from the worker for the window: numbers and sentences. Heavy things go through [`super::Latest`].

use super::export_queue::ExportStatus;
use base::progress::{Report, TrainingPoint};
use parking_lot::Mutex;
use training::history::halved;

/// Something that happened behind the window.
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
    /// An export is over, and what came of it.
    Exported(ExportStatus),
}

/// Reason that a project cannot be relit.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocked {
    /// The reason, and the remedy.
    pub sentence: String,
    /// The lack that a job would fill.
    pub need: Option<Need>,
}

/// Lack of a project that keeps it from being relit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// The shoot, which is not where it was.
    Shoot,
    Calibration,
}

/// Events that the window has not read yet. A job's step replaces the step before it, and points of a training
/// become fewer when they are too many, so that a window that is not drawn for hours finds a handful, and
/// misses no end of a job.
#[derive(Default)]
pub(super) struct UnreadEvents(Mutex<Unread>);

#[derive(Default)]
struct Unread {
    events: Vec<Event>,
    points: Vec<TrainingPoint>,
}

/// Points of a training that wait at most: an hour's, twice thinned.
const MOST_POINTS: usize = 4096;

impl UnreadEvents {
    pub fn push(&self, event: Event) {
        let step = |event: &Event| matches!(event, Event::Report(Report::Step { .. }));
        let mut unread = self.0.lock();
        let Unread { events, points } = &mut *unread;
        if let Event::Report(Report::Training(point)) = event {
            points.push(point);
            if points.len() > MOST_POINTS {
                *points = halved(points, |a, b| TrainingPoint {
                    losses: a.losses.joined(b.losses, 1),
                    ..b.clone()
                });
            }
            return;
        }
        match events.last_mut() {
            Some(last) if step(last) && step(&event) => *last = event,
            _ => events.push(event),
        }
    }

    /// Everything, the points of a training last but for what came after it.
    pub fn take(&self) -> Vec<Event> {
        let mut unread = self.0.lock();
        let Unread { mut events, points } = std::mem::take(&mut *unread);
        let over = |event: &Event| matches!(event, Event::Finished { .. });
        let at = events.iter().rposition(over).unwrap_or(events.len());
        let points = points.into_iter().map(Report::Training).map(Event::Report);
        events.splice(at..at, points);
        events
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base::progress::{LossPoint, TrainingPhase};

    #[test]
    fn points_of_a_training_are_bounded_and_stand_between_its_beginning_and_its_end() {
        let unread = UnreadEvents::default();
        let point = |step| TrainingPoint {
            losses: LossPoint {
                step,
                seconds: 0.0,
                reconstruction: Some(step as f32),
                rendering: None,
                held_out_db: None,
            },
            phase: TrainingPhase::Exemplars,
            learning_rate: 1e-3,
            gradient_norm: 1.0,
            steps_per_second: 10.0,
            multiply_adds: 1,
            memory_bytes: None,
            skipped_steps: 0,
            dead_lamps: Vec::new(),
        };
        unread.push(Event::Started { what: "training" });
        (1..=100_000).for_each(|step| unread.push(Event::Report(Report::Training(point(step)))));
        let finished = Event::Finished { sentence: "trained".to_owned() };
        unread.push(finished.clone());
        let events = unread.take();
        assert!(events.len() <= MOST_POINTS + 2);
        assert_eq!(events[0], Event::Started { what: "training" });
        assert_eq!(events[events.len() - 1], finished);
        let last = &events[events.len() - 2];
        assert!(matches!(last, Event::Report(Report::Training(p)) if p.losses.step == 100_000));
    }

    #[test]
    fn a_window_that_looks_away_finds_the_newest_step_and_every_end() {
        let unread = UnreadEvents::default();
        let step = |done| {
            Event::Report(Report::Step {
                stage: "training",
                done,
                total: 1000,
                note: String::new(),
            })
        };
        let finished = Event::Finished { sentence: "trained".to_owned() };
        unread.push(Event::Started { what: "training" });
        (0..1000).for_each(|done| unread.push(step(done)));
        unread.push(finished.clone());
        let started = Event::Started { what: "training" };
        assert_eq!(unread.take(), [started, step(999), finished]);
        assert_eq!(unread.take(), []);
    }
}
