//! `afterlight tradeoff`.

use super::OutputArgs;
use ::tradeoff::TradeoffSettings;
use base::error::Result;
use clap::Args;
use std::path::PathBuf;
use worker::Job;

/// Measure speed against accuracy on your own footage and machine: networks of other sizes and lengths of training, fewer
/// lamps, other ways to store and light predictions. Each of these settings has its time for a frame, memory and disk, and its error
/// beside the truth or a held-out pose.
///
/// Results are kept in the project's folder `tradeoff`: stop with Ctrl-C, and run it again to resume. `ladder.csv` there
/// is the table for other programs. The studio shows it in Accuracy.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight tradeoff interview --budget 30\n         afterlight tradeoff interview --truth shoot --knobs minutes,size,width\n         afterlight tradeoff interview --apply size=64"
)]
pub struct TradeoffArgs {
    /// The project's folder.
    project: PathBuf,
    /// Measure nothing: use the network of this setting in the project. The present network is set aside.
    #[arg(long, value_name = "SETTING", conflicts_with_all = ["truth", "hold_out", "knobs", "features", "lpips", "fresh"])]
    apply: Option<String>,
    #[command(flatten)]
    settings: TradeoffSettings,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl TradeoffArgs {
    /// Refuses what cannot be measured.
    ///
    /// # Errors
    /// Then.
    pub fn check(&self) -> Result<()> {
        self.settings.check()
    }

    /// The job that was asked for.
    pub fn job(self) -> Job {
        match self.apply {
            Some(rung) => Job::Apply { project: self.project, rung },
            None => Job::Tradeoff { project: self.project, settings: Box::new(self.settings) },
        }
    }
}
