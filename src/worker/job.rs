//! Long actions. The command line and the studio send the same ones.

use crate::calibration::{self, Calibration};
use crate::error::Result;
use crate::footage::{self, ImportSettings};
use crate::progress::Progress;
use crate::project::Project;
use crate::training::{self, TrainReport, TrainSettings};
use crate::virtual_stage::{self, StageReport, StageSettings};
use std::path::PathBuf;

/// A long action and everything it needs to know.
#[derive(Clone, Debug)]
pub enum Job {
    /// Trace a shoot with the virtual stage into `folder`.
    Stage { folder: PathBuf, settings: StageSettings },
    /// Make a project in `project` that points at the shoot in `shoot`.
    Import { project: PathBuf, shoot: PathBuf, settings: ImportSettings },
    /// Find lamps, weights and camera response of the project in `project`.
    Calibrate { project: PathBuf },
    /// Train the network of the project in `project`.
    Train { project: PathBuf, settings: TrainSettings },
}

/// What a job made.
#[derive(Clone, Debug)]
pub enum Outcome {
    Staged(StageReport),
    Imported(Project),
    Calibrated(Calibration),
    Trained(TrainReport),
}

impl Job {
    /// What is being done, as the window and the progress bar say it.
    pub fn what(&self) -> &'static str {
        match self {
            Self::Stage { .. } => "tracing a shoot",
            Self::Import { .. } => "importing the shoot",
            Self::Calibrate { .. } => "calibrating",
            Self::Train { .. } => "training the network",
        }
    }

    /// Does it; files are written when it succeeds.
    ///
    /// # Errors
    /// When the action fails or was stopped; what was finished before is kept.
    pub fn run(self, progress: &Progress) -> Result<Outcome> {
        match self {
            Self::Stage { folder, settings } => {
                virtual_stage::write_shoot(&folder, &settings, progress).map(Outcome::Staged)
            }
            Self::Import { project, shoot, settings } => {
                footage::import(&project, &shoot, &settings, progress).map(Outcome::Imported)
            }
            Self::Calibrate { project } => {
                let project = Project::open(&project)?;
                let found = calibration::calibrate(&project, progress)?;
                found.save(&project)?;
                Ok(Outcome::Calibrated(found))
            }
            Self::Train { project, settings } => {
                let project = Project::open(&project)?;
                let calibration = Calibration::load(&project)?;
                training::train(&project, &calibration, &settings, progress).map(Outcome::Trained)
            }
        }
    }
}

impl Outcome {
    /// A sentence that says what came of the job.
    pub fn sentence(&self) -> String {
        match self {
            Self::Staged(_) => "The shoot is written".to_owned(),
            Self::Imported(project) => format!("{} is ready to be calibrated", project.settings.name),
            Self::Calibrated(found) => format!(
                "Calibrated {} lamps; γ1 = {:.2}, γ2 = {:.2}",
                found.rig.lamps.len(),
                found.response.gamma1,
                found.response.gamma2
            ),
            Self::Trained(report) => {
                format!("Trained for {} steps in {:.0} s", report.steps, report.seconds)
            }
        }
    }
}
