//! `afterlight environments`.

use super::OutputArgs;
use super::parse::parse_front;
use clap::Args;
use light::conventions::Front;
use project::EnvironmentChange;
use std::path::PathBuf;
use worker::Job;

/// List, add and remove a project's environments, and set which way is front in them.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight environments interview --add courtyard.hdr --front blender"
)]
pub struct EnvironmentsArgs {
    /// The project's folder.
    project: PathBuf,
    /// Add a panorama file. Can be given several times.
    #[arg(long, value_name = "FILE")]
    add: Vec<PathBuf>,
    /// Set --front for this environment, a name or a file. Can be given several times.
    #[arg(long, value_name = "NAME", requires = "front")]
    of: Vec<PathBuf>,
    /// Which way is front in --add and --of: the convention of a tool (afterlight, openexr, usd, nuke, mitsuba, threejs,
    /// blender), or the yaw in degrees that brings it to the middle.
    #[arg(long, value_name = "TOOL|DEG", value_parser = parse_front, allow_hyphen_values = true)]
    front: Option<Front>,
    /// Remove an added environment from the list, by its name or file; the file stays. Can be given several
    /// times.
    #[arg(long, value_name = "NAME")]
    remove: Vec<PathBuf>,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl EnvironmentsArgs {
    /// The job that was asked for.
    pub fn job(self) -> Job {
        Job::Environments {
            project: self.project,
            change: EnvironmentChange {
                add: self.add,
                front: self.front,
                of: self.of,
                remove: self.remove,
            },
        }
    }
}
