//! `afterlight frame`.

use super::OutputArgs;
use clap::Args;
use footage::FrameSettings;
use std::path::PathBuf;
use worker::Job;

/// Choose the crop of the pictures and the replacement for damaged frames, or print the current choice.
///
/// Changing the crop sets the calibration and the network aside in the project's folder.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight frame interview --interview 420,0,1080")]
pub struct FrameArgs {
    /// The project's folder.
    project: PathBuf,
    #[command(flatten)]
    settings: FrameSettings,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl FrameArgs {
    /// The requested job.
    pub fn job(self) -> Job {
        Job::Frame { project: self.project, settings: self.settings }
    }
}
