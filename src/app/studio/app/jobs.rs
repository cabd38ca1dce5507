//! The running job, and jobs for what is missing.

use super::StudioApp;
use crate::command::{Dialog, JobCommand};
use calibration::CalibrateSettings;
use footage::MatteSettings;
use std::time::Instant;
use worker::{Job, Need};

impl StudioApp {
    pub(crate) fn apply_to_job(&mut self, command: JobCommand) {
        let done = match command {
            JobCommand::Provide(Need::Shoot) => {
                self.open_dialog(Dialog::ShootLocation);
                Ok(())
            }
            JobCommand::Provide(Need::Mattes) => self
                .session
                .run(|project| Job::Matte { project: project.root.clone(), settings: MatteSettings::default() }),
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
