//! `afterlight blind`.

use super::OutputArgs;
use clap::Args;
use evaluation::blind::BlindSettings;
use std::path::PathBuf;
use worker::Job;

/// Compare methods blindly, as in the paper's user study. Writes a page with two clips side by side, relit by one
/// lamp, beside a photograph of the subject under that lamp, and two questions. People answer in a browser by
/// keys, without knowing the methods, and send a file back; --answers counts these files.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight blind interview --with network,ratio,texler,sun --page compare.html\n         afterlight blind interview --answers answers-*.csv"
)]
pub struct BlindArgs {
    /// The project's folder.
    project: PathBuf,
    /// Collect these files of answers instead of writing a page, and count all collected answers. Without a file,
    /// only count.
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
    /// The requested job.
    pub fn job(self) -> Job {
        match self.answers {
            Some(files) => Job::Answers { project: self.project, files },
            None => Job::Blind { project: self.project, settings: self.settings },
        }
    }
}
