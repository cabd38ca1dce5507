//! `afterlight matte`.

use super::OutputArgs;
use clap::Args;
use std::path::PathBuf;
use worker::Job;

/// Make the mattes that a shoot does not bring, from its green or blue screen.
///
/// Poses without a screen are cut out by brightness. The mattes are kept in PROJECT/mattes as grey PNGs; the shoot's own are
/// never touched.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight matte interview")]
pub struct MatteArgs {
    /// The project's folder.
    project: PathBuf,
    /// Make all mattes in PROJECT/mattes again.
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl MatteArgs {
    /// The job that was asked for.
    pub fn job(self) -> Job {
        Job::Matte {
            project: self.project,
            replace: self.replace,
        }
    }
}
