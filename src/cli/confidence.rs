//! `afterlight confidence`.

use super::OutputArgs;
use ::confidence::ConfidenceSettings;
use clap::Args;
use std::path::PathBuf;
use worker::Job;

/// Find out how far predictions can be trusted where there is no truth: which frames are unlike every pose that was
/// photographed, which frames to photograph as poses next, and, with --errors, how large errors are. For these a network is
/// trained for each pose without it, and compared with its photographs.
///
/// What is found is kept in the project's folder `confidence`, and a run that was stopped goes on.
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
