//! `afterlight environments`.

use super::OutputArgs;
use clap::Args;
use project::EnvironmentChange;
use std::path::PathBuf;
use worker::Job;

/// List, add and remove a project's environments, and set their front directions.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight environments interview --add courtyard.hdr --front blender")]
pub struct EnvironmentsArgs {
    /// The project's folder.
    project: PathBuf,
    #[command(flatten)]
    change: EnvironmentChange,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl EnvironmentsArgs {
    /// The requested job.
    pub fn job(self) -> Job {
        Job::Environments { project: self.project, change: self.change }
    }
}
