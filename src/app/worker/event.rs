//! Events from the worker for the window: numbers and sentences. Heavy values go through [`super::Latest`].

use super::export_queue::ExportStatus;
use base::progress::{Report, TrainingPoint};
use parking_lot::Mutex;
use training::history::halved;

/// An event behind the window.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The calibration and the network are being read.
    Opening,
    /// Frames can be predicted; `device` names the device and the reason for it.
    Ready { device: String },
    /// Predictions are impossible.
    Blocked(Blocked),
    /// A frame or a picture could not be made.
    Failed { sentence: String },
    /// A job began.
    Started { what: &'static str },
    /// Progress report of the running job.
    Report(Report),
    /// A job is over; the sentence gives its result.
    Finished { sentence: String },
    /// An export is over, with its result.
    Exported(ExportStatus),
}

/// Reason that a project cannot be relit.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocked {
    /// The reason, and the remedy.
    pub sentence: String,
    /// The missing input that a job can supply.
    pub need: Option<Need>,
}

/// Missing input that keeps a project from being relit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// The shoot is not at its recorded place.
    Shoot,
    /// Mattes of the interview or of poses.
    Mattes,
    Calibration,
}

/// Events not yet read by the window. A job's step replaces the step before it, and training points are thinned
/// when they become too many. So a window that is not drawn for hours finds few events, and no end of a job is
/// lost.
#[derive(Default)]
pub(super) struct UnreadEvents(Mutex<Unread>);

#[derive(Default)]
struct Unread {
    events: Vec<Event>,
    points: Vec<TrainingPoint>,
}

/// Largest number of waiting training points: one hour, thinned twice.
const MOST_POINTS: usize = 4096;

impl UnreadEvents {
    pub fn push(&self, event: Event) {
        let step = |event: &Event| matches!(event, Event::Report(Report::Step { .. }));
        let mut unread = self.0.lock();
        let Unread { events, points } = &mut *unread;
        if let Event::Report(Report::Training(point)) = event {
            points.push(point);
            if points.len() > MOST_POINTS {
                *points = halved(points, |a, b| TrainingPoint { losses: a.losses.joined(b.losses, 1), ..b.clone() });
            }
            return;
        }
        match events.last_mut() {
            Some(last) if step(last) && step(&event) => *last = event,
            _ => events.push(event),
        }
    }

    /// Takes all events: training points come last, except for events after the training.
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
        let step = |done| Event::Report(Report::Step { stage: "training", done, total: 1000, note: String::new() });
        let finished = Event::Finished { sentence: "trained".to_owned() };
        unread.push(Event::Started { what: "training" });
        (0..1000).for_each(|done| unread.push(step(done)));
        unread.push(finished.clone());
        let started = Event::Started { what: "training" };
        assert_eq!(unread.take(), [started, step(999), finished]);
        assert_eq!(unread.take(), []);
    }
}
