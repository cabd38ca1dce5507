//! `afterlight frame`.

use super::OutputArgs;
use clap::Args;
use footage::FrameSettings;
use std::path::PathBuf;
use worker::Job;

/// Choose which square of the pictures is used and what stands in for damaged frames, or print the current choice.
///
/// A calibration and a network made under another framing are set aside in the project's folder.
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
    /// The job that was asked for.
    pub fn job(self) -> Job {
        Job::Frame { project: self.project, settings: self.settings }
    }
}
