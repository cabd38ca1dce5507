//! `afterlight tradeoff`.

use super::OutputArgs;
use ::tradeoff::TradeoffSettings;
use base::error::Result;
use clap::Args;
use std::path::PathBuf;
use worker::Job;

/// Measure speed against accuracy on your own footage and machine: other network sizes and training times, fewer
/// lamps, other ways to store and light predictions. Reports time per frame, memory, disk space and error for
/// each setting, against the truth or a held-out pose.
///
/// Results are kept in the project's folder `tradeoff`: stop with Ctrl-C, and run the command again to resume.
/// `ladder.csv` there is the table for other programs. The studio shows it in Accuracy.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight tradeoff interview --budget 30\n         afterlight tradeoff interview --truth shoot --knobs minutes,size,width\n         afterlight tradeoff interview --apply size=64"
)]
pub struct TradeoffArgs {
    /// The project's folder.
    project: PathBuf,
    /// Use the network of this setting in the project, without measuring. The current network is set aside.
    #[arg(long, value_name = "SETTING", conflicts_with_all = ["truth", "hold_out", "knobs", "features", "lpips", "fresh"])]
    apply: Option<String>,
    #[command(flatten)]
    settings: TradeoffSettings,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl TradeoffArgs {
    /// Rejects impossible requests.
    ///
    /// # Errors
    /// When the request is impossible.
    pub fn check(&self) -> Result<()> {
        self.settings.check()
    }

    /// The requested job.
    pub fn job(self) -> Job {
        match self.apply {
            Some(rung) => Job::Apply { project: self.project, rung },
            None => Job::Tradeoff { project: self.project, settings: Box::new(self.settings) },
        }
    }
}
