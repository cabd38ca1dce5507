//! `afterlight matte`.

use super::OutputArgs;
use clap::Args;
use std::path::PathBuf;
use worker::Job;

/// Make the mattes that a shoot does not bring, from its green or blue screen.
///
/// Without a screen a small network finds the person in each frame. Poses without a screen are cut out by brightness. The mattes are kept in PROJECT/mattes as grey PNGs; the shoot's own are
/// never touched.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight matte interview")]
pub struct MatteArgs {
    /// The project's folder.
    project: PathBuf,
    /// Make all mattes in PROJECT/mattes again.
    #[arg(long)]
    replace: bool,
    /// For an interview without a screen: a box that holds the person in every frame, with some background outside of it,
    /// in pixels of the pictures.
    #[arg(long = "box", value_name = "LEFT,TOP,WIDTH,HEIGHT", value_parser = parse_box)]
    within: Option<[usize; 4]>,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl MatteArgs {
    /// The job that was asked for.
    pub fn job(self) -> Job {
        Job::Matte {
            project: self.project,
            replace: self.replace,
            within: self.within,
        }
    }
}

fn parse_box(text: &str) -> Result<[usize; 4], String> {
    let numbers: Result<Vec<usize>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    let four = numbers.ok().and_then(|numbers| numbers.try_into().ok());
    four.ok_or_else(|| format!("expected LEFT,TOP,WIDTH,HEIGHT in whole pixels, found {text:?}"))
}
