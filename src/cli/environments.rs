//! `afterlight environments`.

use super::OutputArgs;
use super::parse::parse_front;
use clap::Args;
use light::conventions::Front;
use project::EnvironmentChange;
use std::path::PathBuf;
use worker::Job;

/// List a project's environments, add and remove some, and say which way is front in them.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight environments interview --add courtyard.hdr --front blender"
)]
pub struct EnvironmentsArgs {
    /// The project's folder.
    project: PathBuf,
    /// Add a panorama's file. Can be given several times.
    #[arg(long, value_name = "FILE")]
    add: Vec<PathBuf>,
    /// Say --front of this environment, a name or a file. Can be given several times.
    #[arg(long, value_name = "NAME", requires = "front")]
    of: Vec<PathBuf>,
    /// Which way is front in --add and --of: as in a tool (afterlight, openexr, usd, nuke, mitsuba, threejs,
    /// blender), or the yaw in degrees that brings it to the middle.
    #[arg(long, value_name = "TOOL|DEG", value_parser = parse_front, allow_hyphen_values = true)]
    front: Option<Front>,
    /// Take an added environment out of the list, by its name or file; the file stays. Can be given several
    /// times.
    #[arg(long, value_name = "NAME")]
    remove: Vec<PathBuf>,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl EnvironmentsArgs {
    /// The job that was asked for.
    pub fn job(&self) -> Job {
        Job::Environments {
            project: self.project.clone(),
            change: EnvironmentChange {
                add: self.add.clone(),
                front: self.front,
                of: self.of.clone(),
                remove: self.remove.clone(),
            },
        }
    }
}
