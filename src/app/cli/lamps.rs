//! `afterlight lamps`.

use super::OutputArgs;
use clap::Args;
use footage::LampSettings;
use std::path::PathBuf;
use worker::Job;

/// List a shoot's lamps, or correct faults of their pictures. The files stay as they are.
///
/// `afterlight check` names the faults and their corrections. A correction sets the calibration and the network aside in the
/// project's folder. Exchanging the same lamps again, or mirroring again, undoes it.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight lamps interview --exchange olat_07,olat_08 --pose pose02\n         afterlight lamps interview --leave-out olat_15"
)]
pub struct LampsArgs {
    /// The project's folder.
    project: PathBuf,
    #[command(flatten)]
    settings: LampSettings,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl LampsArgs {
    /// The requested job.
    pub fn job(self) -> Job {
        Job::Lamps { project: self.project, settings: self.settings }
    }
}
