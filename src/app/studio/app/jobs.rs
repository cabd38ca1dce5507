//! Calibration and training jobs, and their manual settings.

use super::StudioApp;
use crate::command::{CalibrationCommand, Dialog, JobCommand, LookCommand, TrainingCommand};
use crate::panels::training_time as duration;
use calibration::{CalibrateSettings, Circle};
use footage::MatteSettings;
use std::time::Instant;
use worker::{Job, Need};

impl StudioApp {
    pub(super) fn apply_to_calibration(&mut self, command: CalibrationCommand) {
        let done = match command {
            CalibrationCommand::FindCircle => self.find_circle(),
            CalibrationCommand::NudgeCircle { by, radius } => self.nudge_circle(by, radius),
            CalibrationCommand::NudgeTrial(by) => self.nudge_trial(by),
            CalibrationCommand::Start => self.calibrate(CalibrateSettings {
                circle: self.state.look.circle,
                trial: self.state.look.trial,
                ..CalibrateSettings::default()
            }),
        };
        self.refuse_unless(done);
    }

    fn find_circle(&mut self) -> Result<(), String> {
        let circle = self.readers.analysis.found()?;
        self.state.change(LookCommand::Circle(Some(circle)));
        Ok(())
    }

    fn nudge_circle(&mut self, by: [f64; 2], radius: f64) -> Result<(), String> {
        let Circle { center_px: [x, y], radius_px } = self.readers.analysis.circle(&self.state)?;
        let moved = Circle::new([x + by[0], y + by[1]], radius_px + radius);
        let moved = moved.map_err(|e| e.to_string())?;
        self.state.change(LookCommand::Circle(Some(moved)));
        Ok(())
    }

    fn nudge_trial(&mut self, by: [f32; 3]) -> Result<(), String> {
        let trial = self.readers.analysis.trial(&self.state)?.nudged(by);
        self.state.change(LookCommand::Trial(Some(trial)));
        Ok(())
    }

    fn calibrate(&self, settings: CalibrateSettings) -> Result<(), String> {
        self.session.run(|project| Job::Calibrate { project: project.root.clone(), settings })
    }

    pub(super) fn apply_to_training(&mut self, command: TrainingCommand) {
        let done = match command {
            // Training can only be resumed once the checkpoints are known.
            TrainingCommand::Start { .. } if self.readers.training.records.is_none() => {
                Err("The checkpoints are still being read".to_owned())
            }
            TrainingCommand::Start { fresh } => self.train(fresh),
            TrainingCommand::GoBack(to) => self.go_back(to),
            TrainingCommand::ListCheckpoints => {
                self.readers.training.list();
                Ok(())
            }
        };
        self.refuse_unless(done);
    }

    /// Trains with the current settings.
    fn train(&self, fresh: bool) -> Result<(), String> {
        let project = self.session.project.as_ref().ok_or("Open a project first")?;
        let training = &self.readers.training;
        let choice = training.choice(self.state.look.training, project);
        if let (Some(refusal), false) = (training.refusal(&choice, project), fresh) {
            return Err(refusal);
        }
        if let (Some(spent), false) = (training.spent(&choice), fresh) {
            let spent = duration(60.0 * spent);
            return Err(format!("Trained for {spent}: time is up. Raise Minutes, or start over"));
        }
        let settings = training.settings(&choice, fresh, self.device);
        self.session.run(|project| Job::Train { project: project.root.clone(), settings })
    }

    fn go_back(&mut self, to: String) -> Result<(), String> {
        self.session.run(|project| Job::GoBack { project: project.root.clone(), to })?;
        self.readers.training.pictures = None;
        Ok(())
    }

    pub(super) fn apply_to_job(&mut self, command: JobCommand) {
        let done = match command {
            JobCommand::Provide(Need::Shoot) => {
                self.open_dialog(Dialog::ShootLocation);
                Ok(())
            }
            JobCommand::Provide(Need::Mattes) => self.session.run(|project| Job::Matte {
                project: project.root.clone(),
                settings: MatteSettings::default(),
            }),
            JobCommand::Provide(Need::Calibration) => self.calibrate(CalibrateSettings::default()),
            JobCommand::Pause => {
                self.pause_job();
                Ok(())
            }
            JobCommand::Stop => {
                self.stop_job();
                Ok(())
            }
        };
        self.refuse_unless(done);
    }

    /// Pauses or resumes the running job, if there is one.
    fn pause_job(&mut self) {
        if let (Some(worker), Some(job)) = (&self.session.worker, &mut self.status.job) {
            let pause = !job.is_paused();
            job.pause(pause, Instant::now());
            worker.pause(pause);
        }
    }

    fn stop_job(&mut self) {
        if let (Some(worker), Some(job)) = (&self.session.worker, &mut self.status.job) {
            job.stopping = true;
            worker.cancel();
        }
    }
}
