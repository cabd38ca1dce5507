//! What each command does to the window, beyond what it does to the state.

use super::StudioApp;
use crate::command::Command;
use crate::comparison::{CompareSettings, Reference};
use calibration::{CalibrateSettings, Circle};
use egui::ViewportCommand;
use std::time::Instant;
use worker::{Job, Need};

impl StudioApp {
    pub(super) fn apply(&mut self, command: Command) {
        let state = &self.state;
        let covered = state.palette || state.keys || state.full_screen;
        self.state.apply(&command);
        match command {
            Command::DismissRefusal => self.status.refusal = None,
            Command::Dismiss if !covered => self.status.refusal = None,
            Command::AddEnvironments(_) => self.status.refusal = None,
            Command::ListCheckpoints => self.training.list(),
            Command::ToggleFullScreen | Command::Dismiss => {
                self.ctx
                    .send_viewport_cmd(ViewportCommand::Fullscreen(self.state.full_screen));
            }
            Command::ChooseEnvironments => self.dialog(|| {
                let dialog = rfd::FileDialog::new().set_title("Add environments");
                dialog
                    .add_filter("Panoramas", &super::drops::PANORAMAS)
                    .pick_files()
                    .map(Command::AddEnvironments)
            }),
            Command::CompareTruth => {
                let compare = self.state.compare.clone();
                self.dialog(move || {
                    let dialog = rfd::FileDialog::new().set_title("Open a truth's folder");
                    let folder = dialog.pick_folder()?;
                    Some(Command::Compare(CompareSettings {
                        on: true,
                        reference: Reference::Truth(folder),
                        ..compare
                    }))
                });
            }
            Command::ActualSize if self.panels.fit() > 0.0 => {
                let factor = 1.0 / (self.panels.fit() * self.ctx.pixels_per_point());
                let about = [0.0; 2];
                self.state.apply(&Command::Fit);
                self.state.apply(&Command::Zoom { factor, about });
            }
            Command::Mark(marked) => match &self.read_only {
                Some(why) => self.status.refuse(why.clone()),
                None => self.review.mark(*marked),
            },
            Command::NudgeCircle { by, radius } => {
                if let Some(Circle {
                    center_px: [x, y],
                    radius_px,
                }) = self.analysis.circle(&self.state)
                {
                    let moved = Circle::new([x + by[0], y + by[1]], radius_px + radius).ok();
                    self.state.nudge(&command, |look| {
                        look.circle = moved.or(look.circle);
                    });
                }
            }
            Command::NudgeTrial(by) => {
                if let Some(trial) = self.analysis.trial(&self.state) {
                    self.state
                        .nudge(&command, |look| look.trial = Some(trial.nudged(by)));
                }
            }
            Command::StepPhotograph(step) => {
                let lamps = self
                    .project
                    .as_ref()
                    .map_or(0, |p| p.settings.shoot.all_lamps().len());
                let shown = self.state.photograph.map_or(0, |lamp| lamp + 1) as isize + step;
                self.state.photograph =
                    (shown.rem_euclid(lamps as isize + 1) as usize).checked_sub(1);
            }
            Command::FindCircle => {
                if let Some(found) = self.analysis.found() {
                    self.apply(Command::Circle(Some(found)));
                }
            }
            Command::ChooseDestination
            | Command::Destination(_)
            | Command::Export
            | Command::Withdraw(_)
            | Command::OpenFolder(_) => self.apply_to_exports(command),
            Command::FocusPane => self.panels.focus(self.state.active),
            Command::Calibrate => self.calibrate(),
            Command::Measure(truth) => self.review(truth, true, None),
            Command::Report(to) => self.review(None, false, Some(to)),
            Command::ChooseTruth => self.dialog(|| {
                let dialog = rfd::FileDialog::new().set_title("Choose a folder with truth");
                dialog
                    .pick_folder()
                    .map(|truth| Command::Measure(Some(truth)))
            }),
            Command::ChooseReport => self.dialog(|| {
                let dialog = rfd::FileDialog::new().set_title("Write the review's page");
                let dialog = dialog
                    .add_filter("Page", &["html"])
                    .set_file_name("review.html");
                dialog.save_file().map(Command::Report)
            }),
            Command::Provide(Need::Shoot) => self.apply(Command::ChooseLocation),
            Command::Provide(Need::Network) => self.train(false),
            Command::Provide(Need::Calibration) => self.run(|project| Job::Calibrate {
                project,
                settings: CalibrateSettings::default(),
            }),
            // Before it is known what is there, nothing can be gone on from.
            Command::StartTraining { fresh } if self.training.records.is_some() => {
                self.train(fresh);
            }
            Command::GoBack(to) => {
                self.training.pictures = None;
                self.run(|project| Job::GoBack { project, to });
            }
            Command::StepTrainedLamp(step) => {
                if let Some(project) = &self.project {
                    let lamps = project.settings.shoot.lamps.len().max(1) as isize;
                    let lamp = self.state.trained_lamp as isize + step;
                    self.state.trained_lamp = lamp.rem_euclid(lamps) as usize;
                }
            }
            Command::PauseJob => {
                if let (Some(worker), Some(job)) = (&self.worker, &mut self.status.job) {
                    let pause = !job.is_paused();
                    job.pause(pause, Instant::now());
                    worker.pause(pause);
                }
            }
            Command::StopJob => {
                if let (Some(worker), Some(job)) = (&self.worker, &mut self.status.job) {
                    job.stopping = true;
                    worker.cancel();
                }
            }
            Command::DismissReport => self.status.message = None,
            Command::ClearLog => self.status.log.clear(),
            Command::Pane(pane) => {
                let workspace = self.state.workspace;
                self.preferences.layout().open(workspace, pane);
                self.edited = true;
            }
            Command::ClosePane(pane) => {
                let workspace = self.state.workspace;
                self.preferences.layout().close(workspace, pane);
                self.edited = true;
            }
            Command::ResetLayout => {
                self.preferences.layout().reset(self.state.workspace);
                self.edited = true;
            }
            Command::Reopen => {
                if let Some(project) = &self.project {
                    self.apply(Command::OpenProject(project.root.clone()));
                }
            }
            command => self.apply_to_project(command),
        }
    }

    /// Shows a dialog beside the window's thread; what it brings is applied when it closes.
    pub(super) fn dialog(&self, ask: impl FnOnce() -> Option<Command> + Send + 'static) {
        let chosen = self.chosen.clone();
        std::thread::spawn(move || {
            if let Some(command) = ask() {
                chosen.put(command);
            }
        });
    }
}
