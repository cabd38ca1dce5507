//! `afterlight confidence`.

use super::OutputArgs;
use ::confidence::ConfidenceSettings;
use clap::Args;
use std::path::PathBuf;
use worker::Job;

/// Estimate the accuracy of predictions without a ground truth: frames unlike every photographed pose, the best
/// frames to photograph as poses next, and the expected errors by frame, region and lamp. Predicts each pose from
/// the others and compares it with its photographs; needs no training.
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
    /// The requested job.
    pub fn job(self) -> Job {
        Job::Confidence { project: self.project, settings: self.settings }
    }
}
