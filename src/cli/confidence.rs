//! `afterlight confidence`.

use super::OutputArgs;
use ::confidence::ConfidenceSettings;
use clap::Args;
use std::path::PathBuf;
use worker::Job;

/// Estimate how far predictions can be trusted without a ground truth: which frames are unlike every photographed pose,
/// which to photograph as poses next and, with --errors, how large the errors are. For that it trains a network for each
/// pose without it, and compares it with the pose's photographs.
///
/// Results are kept in the project's folder `confidence`; a stopped run resumes.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight confidence interview\n         afterlight confidence interview --errors 20"
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
        Job::Confidence {
            project: self.project,
            settings: self.settings,
        }
    }
}
