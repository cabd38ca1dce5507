//! `afterlight confidence`.

use super::OutputArgs;
use ::confidence::ConfidenceSettings;
use clap::Args;
use std::path::PathBuf;
use worker::Job;

/// Estimate how far predictions can be trusted without a ground truth: frames that are unlike every photographed pose, frames
/// to photograph as poses next, and the errors to expect, by frame, place and lamp. Each pose is predicted from the others and
/// compared with its photographs: no training is needed.
///
/// Results are kept in the project's folder `confidence`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight confidence interview\n         afterlight confidence interview --poses 5 --truth shoot"
)]
pub struct ConfidenceArgs {
    /// The project's folder.
    project: PathBuf,
    #[command(flatten)]
    settings: ConfidenceSettings,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl ConfidenceArgs {
    /// The job that was asked for.
    pub fn job(self) -> Job {
        Job::Confidence { project: self.project, settings: self.settings }
    }
}
