//! Folders of a rung's training and weights, and the project for its training.

use super::ladder::Network;
use super::ledger::folder;
use base::error::Result;
use base::progress::Progress;
use calibration::{CalibrateSettings, Calibration, calibrate, keep_lamps};
use project::Project;
use std::path::PathBuf;

/// Folder of a network's training.
pub fn run_folder(project: &Project, network: &Network, seed: u64) -> PathBuf {
    let name = format!("{}-{seed}", file_name(&network.name));
    folder(project).join("runs").join(name)
}

/// Folder of a network's weights after `minutes` of training.
pub fn mark(project: &Project, network: &Network, minutes: f64, seed: u64) -> PathBuf {
    run_folder(project, network, seed).join(format!("at-{minutes:.4}-minutes"))
}

/// The project at the network's size and with its lamps, and its calibration. `base` is the project at the first
/// measurement.
///
/// # Errors
/// When the balls cannot be read, or files cannot be written.
pub fn variant(
    base: &Project,
    project: &Project,
    network: &Network,
    seed: u64,
    progress: &Progress,
) -> Result<(Project, Calibration)> {
    let mut variant = base.variant(run_folder(project, network, seed));
    variant.settings.size = network.size;
    variant.settings.seed = seed;
    let has_fewer = network.lamps < base.settings.shoot.lamps.len();
    if has_fewer {
        keep_lamps(&mut variant, network.lamps, progress)?;
    }
    if !variant.calibration_path().exists() {
        let found = if has_fewer {
            calibrate(&mut variant, &CalibrateSettings::default(), progress)?
        } else {
            Calibration::load(base)?
        };
        found.save(&variant)?;
    }
    let calibration = Calibration::load(&variant)?;
    Ok((variant, calibration))
}

/// A rung's name as a file name.
pub(super) fn file_name(name: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '.';
    name.chars().map(|c| if is_plain(c) { c } else { '-' }).collect()
}
