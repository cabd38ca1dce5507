//! Training as the window knows it: records on disk, read in the background, and reports of a running job.

use crate::layout::Pane;
use base::progress::{Report, TrainingPictures, TrainingPoint};
use gpu::DeviceChoice;
use project::Project;
use std::sync::Arc;
use training::{History, Pace, Preset, Records, TrainSettings, TrainingConfig};
use worker::{Event, Query, TRAINING};

/// Training settings of a person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainChoice {
    pub preset: Preset,
    /// Index of the pose held out of training to measure it, from 0.
    pub hold_out: Option<usize>,
    /// Duration of a run in minutes, for a preset limited by time; None for the preset's own.
    pub minutes: Option<f64>,
}

impl Default for TrainChoice {
    fn default() -> Self {
        Self { preset: Preset::Quick, hold_out: None, minutes: None }
    }
}

impl TrainChoice {
    /// Configuration of a run from the start.
    pub fn config(&self) -> TrainingConfig {
        let config = self.preset.config();
        TrainingConfig { minutes: config.minutes.map(|minutes| self.minutes.unwrap_or(minutes)), ..config }
    }
}

/// Minutes added to a run whose time is up.
pub const MORE_MINUTES: f64 = 3.0;

/// Records on disk, and the running job.
#[derive(Default)]
pub struct Training {
    /// Records on disk, once read.
    pub records: Option<Arc<Records>>,
    /// Curves: from disk and from the running job.
    pub history: History,
    /// Current point of the running job.
    pub point: Option<TrainingPoint>,
    /// The newest pictures.
    pub pictures: Option<Arc<TrainingPictures>>,
    /// True while training runs.
    pub running: bool,
    /// Pace of a run in this window.
    timed: Option<Pace>,
    /// Curves reported by the running or last job.
    live: History,
    reader: Query<Project, Records>,
    /// True if the checkpoint list is requested while the pane is hidden.
    listed: bool,
}

impl Training {
    /// Takes in an event.
    pub fn on_event(&mut self, event: &Event) {
        match event {
            Event::Started { what } => {
                self.running = *what == TRAINING;
                if self.running {
                    self.pictures = None;
                }
                self.live = History::default();
                self.point = None;
            }
            Event::Report(Report::Training(point)) => {
                self.live.push(point.losses);
                self.history.push(point.losses);
                if point.steps_per_second > 0.0 {
                    self.timed = Some(Pace {
                        seconds_per_step: 1.0 / point.steps_per_second,
                        multiply_adds: point.multiply_adds,
                    });
                }
                self.point = Some(point.clone());
            }
            Event::Report(Report::Saved) => self.reader.forget(),
            Event::Finished { .. } => {
                self.running = false;
                self.point = None;
                self.reader.forget();
            }
            _ => {}
        }
    }

    /// True if the logs are read and nothing has been trained yet.
    pub fn is_empty(&self) -> bool {
        let untouched = |records: &Records| records.present.is_none() && records.failure.is_none();
        let untouched = self.records.as_deref().is_some_and(untouched);
        untouched && !self.running && self.history.points().is_empty()
    }

    /// Shows newer pictures, if there are any.
    pub fn show(&mut self, newer: Option<Arc<TrainingPictures>>) {
        self.pictures = newer.or(self.pictures.take());
    }

    /// True if everything on disk has been read.
    pub fn is_current(&self) -> bool {
        self.is_asked() && !self.reader.is_waiting()
    }

    /// Requests the records on disk, even while the panel is hidden.
    pub fn list(&mut self) {
        self.listed = true;
    }

    /// True if everything on disk has been read or is being read.
    pub fn is_asked(&self) -> bool {
        self.reader.asked().is_some()
    }

    /// Takes in the records.
    pub fn receive(&mut self) {
        let Some((_, read)) = self.reader.answers().last() else { return };
        // A failed read keeps the earlier records.
        let records = read.unwrap_or_else(|sentence| Records {
            failure: Some(sentence),
            ..self.records.as_deref().cloned().unwrap_or_default()
        });
        self.history = records.history.clone();
        if self.running {
            // Points that are not in the log yet.
            for &point in self.live.points() {
                self.history.push(point);
            }
        }
        self.records = Some(Arc::new(records));
    }

    /// Reads the records if they may have changed and one of the panes `shown` displays them.
    pub fn ask(&mut self, project: &Project, shown: &[Pane], wake: impl Fn() + Send + 'static) {
        let wanted = std::mem::take(&mut self.listed) || shown.contains(&Pane::Training);
        if wanted && !self.is_asked() && !self.reader.is_waiting() {
            let read = |project: &Project| Ok(Records::read(project));
            self.reader.ask(project.clone(), wake, |_| read);
        }
    }

    /// The settings in use: `chosen` by hand, or matching the checkpoint.
    pub fn choice(&self, chosen: Option<TrainChoice>, project: &Project) -> TrainChoice {
        let fitting = || {
            let present = self.records.as_ref()?.present.as_ref()?;
            let fits = |preset: &Preset| preset.config().network(project) == present.network;
            let judged = present.held_out.map(|judged| judged.pose);
            Some(TrainChoice {
                preset: Preset::ALL.into_iter().find(fits).unwrap_or(Preset::Quick),
                hold_out: judged,
                minutes: None,
            })
        };
        chosen.or_else(fitting).unwrap_or_default()
    }

    /// Reason that training cannot resume from the checkpoint with these settings; None if it can.
    pub fn refusal(&self, choice: &TrainChoice, project: &Project) -> Option<String> {
        let present = self.records.as_ref()?.present.as_ref()?;
        let network = |preset: Preset| preset.config().network(project);
        let mut presets = Preset::ALL.into_iter();
        let fitting = presets.find(|&preset| network(preset) == present.network)?;
        (network(choice.preset) != present.network)
            .then(|| format!("The checkpoint was trained with the preset {}. Choose it, or start over", fitting.name()))
    }

    /// Minutes trained so far if these settings allow no more; None if a resumed run has time left.
    pub fn spent(&self, choice: &TrainChoice) -> Option<f64> {
        let trained = self.records.as_ref()?.present.as_ref()?.seconds / 60.0;
        (choice.config().minutes? <= trained).then_some(trained)
    }

    /// Settings of the next run. A resumed run keeps its network.
    pub fn settings(&self, choice: &TrainChoice, fresh: bool, device: DeviceChoice) -> TrainSettings {
        let present = self.records.as_ref().and_then(|r| r.present.as_ref());
        let config = choice.config();
        TrainSettings {
            config: match present {
                Some(present) if !fresh => config.with_network(&present.network),
                _ => config,
            },
            exclude_frames: Vec::new(),
            hold_out: choice.hold_out,
            fresh,
            device,
        }
    }

    /// Training pace on this machine, if known.
    pub fn pace(&self) -> Option<Pace> {
        self.timed.or_else(|| self.records.as_ref()?.pace())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn a_panic_while_the_log_is_read_is_said_in_its_place_and_the_next_reading_works() {
        let (wake, woken) = channel();
        let mut readings = 0;
        let read = move |_: &Project| {
            readings += 1;
            assert_ne!(readings, 1, "on purpose");
            Ok(Records::default())
        };
        let reader = Query::start(move || wake.send(()).unwrap(), |_| read);
        let mut training = Training { reader, ..Training::default() };
        let project = Project::without_shoot("film".as_ref());
        let mut read = || {
            training.ask(&project, &[Pane::Training], || {});
            woken.recv().unwrap();
            training.receive();
            assert!(training.is_current());
            training.on_event(&Event::Report(Report::Saved));
            training.records.as_ref().unwrap().failure.clone()
        };
        let failure = read().unwrap();
        assert!(failure.contains("on purpose"), "{failure}");
        assert_eq!(read(), None);
    }
}
