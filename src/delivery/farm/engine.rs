//! Engines that run a job on many machines.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Engine that runs the job.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Engine {
    /// Open Job Description: a template, for AWS Deadline Cloud, openjd-cli and others.
    #[default]
    #[value(name = "openjd")]
    #[serde(rename = "openjd")]
    OpenJobDescription,
    /// Slurm: an array script.
    Slurm,
}

impl Engine {
    /// All engines.
    pub const ALL: [Self; 2] = [Self::OpenJobDescription, Self::Slurm];

    /// Common name.
    pub fn name(self) -> &'static str {
        match self {
            Self::OpenJobDescription => "Open Job Description",
            Self::Slurm => "Slurm",
        }
    }
}
