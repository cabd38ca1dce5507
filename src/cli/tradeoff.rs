//! `afterlight tradeoff`.

use super::OutputArgs;
use ::tradeoff::TradeoffSettings;
use base::error::Result;
use clap::Args;
use std::path::PathBuf;
use worker::Job;

/// Measure what accuracy costs in time, on your own footage and machine: networks of other sizes and lengths of training,
/// fewer lamps, other ways to keep and light predictions. Each rung gets its time for a frame, memory and disk beside how
/// near it comes to the truth, or to a pose that is held out.
///
/// What is measured is kept in the project's folder `tradeoff`: stop it with Ctrl-C and run it again, and it goes on.
/// `ladder.csv` there is the table for other programs. The window shows it in Accuracy.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight tradeoff interview --budget 30\n         afterlight tradeoff interview --truth shoot --knobs minutes,size,width\n         afterlight tradeoff interview --apply size=64"
)]
pub struct TradeoffArgs {
    /// The project's folder.
    project: PathBuf,
    /// Measure nothing, but use the network of this rung in the project. The network that is there is set aside.
    #[arg(long, value_name = "RUNG", conflicts_with_all = ["truth", "hold_out", "knobs", "features", "lpips", "fresh"])]
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
            Some(rung) => Job::Apply {
                project: self.project,
                rung,
            },
            None => Job::Tradeoff {
                project: self.project,
                settings: Box::new(self.settings),
            },
        }
    }
}
