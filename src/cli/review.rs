//! `afterlight review`.

use super::{DeviceArgs, OutputArgs};
use clap::Args;
use evaluation::review::ReviewSettings;
use std::path::PathBuf;
use worker::Job;

/// Compare every predicted OLAT with the true one, lamp by lamp, on the poses and on frames with truth.
/// The figures are kept with the project; the studio's review shows them.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight review interview --truth shoot --report review.html")]
pub struct ReviewArgs {
    /// The project's folder.
    project: PathBuf,
    /// A folder with truth.json and truth/; without one, poses alone are compared.
    #[arg(long, value_name = "DIR")]
    truth: Option<PathBuf>,
    /// Write a page to hand on, with its pictures inside.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Measure again though nothing has changed since the last time.
    #[arg(long)]
    fresh: bool,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl ReviewArgs {
    /// The job that was asked for.
    pub fn job(&self) -> Job {
        Job::Review {
            project: self.project.clone(),
            settings: ReviewSettings {
                truth: self.truth.clone(),
                fresh: self.fresh,
                report: self.report.clone(),
                device: self.device.device,
            },
        }
    }
}
