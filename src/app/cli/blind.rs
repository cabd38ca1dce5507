//! `afterlight blind`.

use super::OutputArgs;
use clap::Args;
use evaluation::blind::BlindSettings;
use std::path::PathBuf;
use worker::Job;

/// Compare methods blindly, as the paper's user study: write a page that shows two clips side by side, relit by one lamp,
/// beside a photograph of the subject under that lamp, and asks two questions. People answer in a browser, by keys, without
/// knowing whose clip is whose, and send a file back; --answers counts those files.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight blind interview --with network,ratio,texler,sun --page compare.html\n         afterlight blind interview --answers answers-*.csv"
)]
pub struct BlindArgs {
    /// The project's folder.
    project: PathBuf,
    /// Write no page: collect these files of answers, and count all that were collected. Without a file, only count.
    #[arg(
        long,
        value_name = "FILE",
        num_args = 0..,
        conflicts_with_all = ["page", "methods", "lamps", "conditions", "frames", "minutes", "at", "device"]
    )]
    answers: Option<Vec<PathBuf>>,
    #[command(flatten)]
    settings: BlindSettings,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl BlindArgs {
    /// The job that was asked for.
    pub fn job(self) -> Job {
        match self.answers {
            Some(files) => Job::Answers { project: self.project, files },
            None => Job::Blind { project: self.project, settings: self.settings },
        }
    }
}
