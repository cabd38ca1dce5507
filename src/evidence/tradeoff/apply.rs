//! Applies a rung to the project: its network, and its changes to size and lamps.

use super::judge::Against;
use super::ladder::{Rung, Show};
use super::ledger::Ledger;
use super::network_folders::{mark, run_folder, variant};
use base::error::{Error, Result};
use base::files::{self, write_beside};
use base::progress::Progress;
use project::Project;
use reflectance::checkpoint;
use serde::Serialize;
use std::path::PathBuf;
use training::checkpoints;

/// Settings taken over by the project.
#[derive(Clone, Debug, Serialize)]
pub struct Applied {
    pub rung: String,
    /// Storage and lighting of its predictions.
    pub show: Show,
    /// New location of the project's calibration and network, if they were for another size or other lamps. A network
    /// of the same shape is kept among the saved checkpoints instead.
    pub aside: Option<PathBuf>,
}

impl Applied {
    /// Summary in one sentence.
    pub fn sentence(&self) -> String {
        let aside = match &self.aside {
            Some(aside) => {
                format!("; the previous calibration and network are in {}", aside.display())
            }
            None => "; the previous network is among the saved checkpoints".to_owned(),
        };
        format!("The project now uses the setting {}{aside}", self.rung)
    }
}

/// Gives the project the network of the rung `name`, trained with the lowest measured seed. The previous network is set
/// aside. If the process is killed meanwhile, one complete network remains in place.
///
/// # Errors
/// When no such rung was measured, the project has changed since, or files cannot be written.
pub fn apply(project: &Project, name: &str, progress: &Progress) -> Result<Applied> {
    let Some(mut ledger) = Ledger::load(project)? else {
        return Err(Error::missing(
            "nothing has been measured in this project yet",
            ("Measure first", "afterlight tradeoff PROJECT"),
        ));
    };
    ledger.check_basis(project)?;
    let named = ledger.rungs.iter().filter(|m| m.rung.name == name);
    let Some(found) = named.min_by_key(|m| m.seed).cloned() else {
        let names: Vec<&str> = ledger.rungs.iter().map(|m| m.rung.name.as_str()).collect();
        return Err(Error::missing(
            format!("there is no setting {name}; the settings are {}", names.join(", ")),
            "Give one of these names",
        ));
    };
    let Rung { network, show, minutes, .. } = &found.rung;
    let from = mark(project, network, *minutes, found.seed);
    let is_trained = *minutes > 0.0;
    if is_trained {
        // Refused before anything changes.
        checkpoint::info(&from)?;
    }
    let base = ledger.base.project(project);
    let (variant, calibration) = variant(&base, project, network, found.seed, progress)?;
    let aside = Project::change(&project.root, |kept| kept.reshape(&variant))?;
    let project = Project::open(&project.root)?;
    if !project.calibration_path().exists() {
        calibration.save(&project)?;
    }
    checkpoints::set_aside(&project)?;
    let present = project.checkpoint_path();
    if is_trained {
        checkpoint::link(&from, &present)?;
    } else if present.exists() {
        // The network is already among the saved ones.
        std::fs::remove_dir_all(&present)
            .map_err(|e| Error::io("remove", &present, e, "Check that the folder can be written"))?;
    }
    for log in ["training.csv", "held_out.csv"] {
        let from = run_folder(&project, network, found.seed).join(log);
        if from.exists() {
            write_beside(&project.result_path(log), |out| std::io::copy(&mut files::open(&from)?, out).map(drop))?;
        }
    }
    ledger.applied = Some(name.to_owned());
    ledger.save(&project)?;
    if let Against::Pose(pose) = ledger.against {
        progress.say(format!(
            "Its network has not learned pose {}. To use that too, train on",
            project.settings.shoot.poses[pose]
        ));
    }
    Ok(Applied { rung: name.to_owned(), show: show.clone(), aside })
}
