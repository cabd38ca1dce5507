//! Jobs that are begun from the window.

use super::StudioApp;
use calibration::CalibrateSettings;
use evaluation::review::ReviewSettings;
use std::path::PathBuf;
use worker::Job;

impl StudioApp {
    /// Calibrates with what was set by hand.
    pub(super) fn calibrate(&self) {
        let look = &self.state.look;
        let settings = CalibrateSettings {
            circle: look.circle,
            trial: look.trial,
            ..CalibrateSettings::default()
        };
        self.run(|project| Job::Calibrate { project, settings });
    }

    /// Trains as was chosen.
    pub(super) fn train(&self, fresh: bool) {
        if let Some(project) = &self.project {
            let choice = self.training.choice(&self.state, project);
            if fresh || self.training.refusal(&choice, project).is_none() {
                let settings = self.training.settings(&choice, fresh, self.device);
                self.run(|project| Job::Train { project, settings });
            }
        }
    }

    /// Compares the network with the truth, or writes what was found as a page.
    pub(super) fn review(&self, truth: Option<PathBuf>, fresh: bool, report: Option<PathBuf>) {
        let settings = ReviewSettings {
            truth: truth.or_else(|| self.review.truth()),
            fresh,
            report,
            device: self.device,
        };
        self.run(|project| Job::Review { project, settings });
    }

    /// Runs a job on the open project, unless one is in hand.
    pub(super) fn run(&self, job: impl FnOnce(PathBuf) -> Job) {
        if let (Some(worker), Some(project)) = (&self.worker, &self.project) {
            worker.run(job(project.root.clone()));
        }
    }
}
