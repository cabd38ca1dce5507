//! `afterlight matte`.

use super::OutputArgs;
use clap::Args;
use footage::MatteSettings;
use std::path::PathBuf;
use worker::Job;

/// Make the mattes that a shoot lacks: by a green or blue screen, a box, a clean plate, or strokes of a brush.
///
/// Without a screen a small network finds the person in each frame. Strokes that were painted in the studio
/// (PROJECT/mattes/strokes.toml) correct the frames' mattes. Poses without a screen are cut out by brightness. The mattes are
/// kept in PROJECT/mattes as grey PNGs; the shoot's own are never touched.
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
    /// The job that was asked for.
    pub fn job(self) -> Job {
        Job::Matte { project: self.project, settings: self.settings }
    }
}
