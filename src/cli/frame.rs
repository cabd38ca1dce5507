//! `afterlight frame`.

use super::OutputArgs;
use super::parse::parse_square;
use clap::Args;
use footage::{FrameSettings, Square};
use project::Padding;
use std::path::PathBuf;
use worker::Job;

/// Choose which square of the pictures is used, or print the current one.
///
/// A calibration and a network made under another framing are set aside in the project's folder.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight frame interview --interview 420,0,1080")]
pub struct FrameArgs {
    /// The project's folder.
    project: PathBuf,
    /// Left edge, upper edge and side of the square in pixels of the interview's frames; it may extend
    /// beyond their edges. Exemplars of the same size are framed alike.
    #[arg(long, value_name = "X,Y,SIDE", value_parser = parse_square, allow_hyphen_values = true)]
    interview: Option<Square>,
    /// The same for the exemplars, if they have another size.
    #[arg(long, value_name = "X,Y,SIDE", value_parser = parse_square, allow_hyphen_values = true)]
    exemplars: Option<Square>,
    /// What fills the square beyond the pictures' edges.
    #[arg(long, value_enum, default_value_t)]
    padding: Padding,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl FrameArgs {
    /// The job that was asked for.
    pub fn job(self) -> Job {
        Job::Frame {
            project: self.project,
            settings: FrameSettings {
                interview: self.interview,
                exemplars: self.exemplars,
                padding: self.padding,
            },
        }
    }
}
