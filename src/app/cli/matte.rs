//! `afterlight matte`.

use super::OutputArgs;
use clap::Args;
use footage::MatteSettings;
use std::path::PathBuf;
use worker::Job;

/// Make the mattes that a shoot lacks: by a green or blue screen, a box, a clean plate, or brush strokes.
///
/// Without a screen a small network finds the person in each frame. Strokes painted in the studio
/// (PROJECT/mattes/strokes.toml) correct the frames' mattes. Poses without a screen are cut out by brightness.
/// The mattes are saved in PROJECT/mattes as grey PNGs; the shoot's own never change.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight matte interview")]
pub struct MatteArgs {
    /// The project's folder.
    project: PathBuf,
    #[command(flatten)]
    settings: MatteSettings,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl MatteArgs {
    /// The requested job.
    pub fn job(self) -> Job {
        Job::Matte { project: self.project, settings: self.settings }
    }
}
