//! `afterlight review`.

use super::OutputArgs;
use clap::Args;
use evaluation::review::ReviewSettings;
use std::path::PathBuf;
use worker::Job;

/// Compare every predicted OLAT with the true one, lamp by lamp, on the poses and on frames with truth.
/// The scores are saved with the project, and the studio's review shows them.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight review interview --truth shoot --report review.html")]
pub struct ReviewArgs {
    /// The project's folder.
    project: PathBuf,
    #[command(flatten)]
    settings: ReviewSettings,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl ReviewArgs {
    /// The requested job.
    pub fn job(self) -> Job {
        Job::Review { project: self.project, settings: self.settings }
    }
}
