//! `afterlight checkpoints`.

use super::console::Console;
use super::{OutputArgs, do_job};
use base::error::Result;
use clap::Args;
use project::Project;
use reflectance::checkpoint;
use std::path::PathBuf;
use training::checkpoints::{self, SavedCheckpoint};
use worker::Job;

/// List a project's saved checkpoints, the newest first, go back to one, or adopt one trained elsewhere.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight checkpoints interview --back-to 1200")]
pub struct CheckpointsArgs {
    /// The project's folder.
    project: PathBuf,
    /// Replace the current checkpoint by the newest one of this step, or by the one of this name. The current one
    /// stays in the list.
    #[arg(long, value_name = "STEP|NAME")]
    back_to: Option<String>,
    /// Replace the current checkpoint by one trained elsewhere, such as on a farm: that of this copy of the
    /// project. The current one stays in the list.
    #[arg(long, value_name = "DIR", conflicts_with = "back_to")]
    adopt: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArgs,
}

impl CheckpointsArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        if let Some(to) = self.back_to {
            let project = self.project;
            return do_job(self.output, Ok(Job::GoBack { project, to }));
        }
        if let Some(from) = self.adopt {
            let project = self.project;
            return do_job(self.output, Ok(Job::Adopt { project, from }));
        }
        let project = Project::open(&self.project)?;
        let kept = checkpoints::list(&project);
        let figures = serde_json::json!({
            "present": checkpoint::info(&project.checkpoint_path()).ok(),
            "kept": kept,
        });
        let sentences = || match kept.as_slice() {
            [] => "No checkpoint is saved yet: training saves some while it runs".to_owned(),
            kept => kept.iter().map(line).collect::<Vec<_>>().join("\n"),
        };
        Console::new(self.output.json).finish(&figures, sentences)
    }
}

fn line(kept: &SavedCheckpoint) -> String {
    let info = &kept.info;
    let judged =
        info.held_out.map_or(String::new(), |judged| format!(", {:.2} dB on pose {}", judged.decibels, judged.pose));
    format!(
        "{} step {:>7} after {:>7.0} s, {:.1} MB{judged}{}",
        kept.name,
        info.step,
        info.seconds,
        kept.bytes as f64 / 1e6,
        if kept.present { " (current)" } else { "" }
    )
}
