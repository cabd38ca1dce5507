//! Records of training in a project's folder.

use super::checkpoints::{self, SavedCheckpoint};
use super::cost::Pace;
use super::history::History;
use project::Project;
use reflectance::checkpoint::{self, CheckpointInfo};

/// Log, checkpoints and calibration of a project, as far as they exist.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Records {
    pub history: History,
    /// Current checkpoint of the project, if any.
    pub present: Option<CheckpointInfo>,
    /// Saved checkpoints, the newest first.
    pub kept: Vec<SavedCheckpoint>,
    /// True if the project is calibrated.
    pub calibrated: bool,
    /// Reason for a failed read of a file.
    pub failure: Option<String>,
}

impl Records {
    /// Reads the records; this takes seconds for a run of a million steps.
    pub fn read(project: &Project) -> Self {
        let mut failure = None;
        let mut sentence = |e: base::Error| failure = Some(e.to_string());
        let folder = project.checkpoint_path();
        let there = folder.join("checkpoint.toml").exists();
        let present = there.then(|| checkpoint::info(&folder).map_err(&mut sentence).ok());
        let history = History::read(&project.result_path("")).map_err(&mut sentence).ok();
        Self {
            history: history.unwrap_or_default(),
            present: present.flatten(),
            kept: checkpoints::list(project),
            calibrated: project.calibration_path().exists(),
            failure,
        }
    }

    /// Training speed of this machine for the network of the checkpoint, if the log holds it.
    pub fn pace(&self) -> Option<Pace> {
        Some(Pace {
            seconds_per_step: self.history.seconds_per_step()?,
            multiply_adds: self.present.as_ref()?.network.cost().multiply_adds,
        })
    }
}
