//! `afterlight train`.

use super::OutputArgs;
use super::parse::{parse_count, parse_minutes};
use base::error::Result;
use clap::Args;
use evaluation::Truth;
use project::Project;
use reflectance::Precision;
use std::path::PathBuf;
use training::{Preset, TrainSettings, TrainingConfig};
use worker::Job;

/// Train the project's network, or continue training it. Ctrl-C stops training and keeps the checkpoint.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight train interview --preset quick --exclude-frames 5,14,25,36")]
pub struct TrainArgs {
    /// The project's folder.
    project: PathBuf,
    /// Keep the frames of this truth out of training, for validation.
    #[arg(long, value_name = "DIR")]
    exclude_truth: Option<PathBuf>,
    #[command(flatten)]
    training: TrainingArgs,
    #[command(flatten)]
    pub output: OutputArgs,
}

/// Settings of a training.
#[derive(Debug, Args)]
pub struct TrainingArgs {
    /// Preset for the settings.
    #[arg(long, value_enum, default_value = "quick")]
    preset: Preset,
    /// Precision of convolutions on a CPU.
    #[arg(long, value_enum)]
    precision: Option<Precision>,
    /// End after this many minutes of training, including earlier runs.
    #[arg(long, conflicts_with = "epochs", value_parser = parse_minutes)]
    minutes: Option<f64>,
    /// End after this many epochs, including earlier runs.
    #[arg(long)]
    epochs: Option<u32>,
    /// Compare pictures by the features of the network in this file instead of the built-in ones: torchvision's
    /// VGG-16, VGG-19 or SqueezeNet 1.1 as .safetensors or .pth.
    #[arg(long, value_name = "FILE")]
    features: Option<PathBuf>,
    /// Compare the OLATs of this many lamps per step, drawn at random each time [default: all].
    #[arg(long, value_name = "K", value_parser = parse_count)]
    lamps_per_step: Option<usize>,
    /// Compute the rendering loss only in every n-th exemplar step; the other steps compute only the lamps that
    /// they compare.
    #[arg(long, value_name = "STEPS", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    rendering_every: u64,
    /// Change any other setting of the preset, such as width=32. Can be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    settings: TrainSettings,
}

impl TrainingArgs {
    /// The requested configuration.
    ///
    /// # Errors
    /// When a setting is invalid.
    fn config(&self) -> Result<TrainingConfig> {
        let mut config = self.preset.config();
        if let Some(precision) = self.precision {
            config.precision = precision;
        }
        if self.minutes.is_some() {
            config.minutes = self.minutes;
        }
        if let Some(epochs) = self.epochs {
            config.epochs = epochs;
            config.minutes = None;
        }
        config.features = self.features.clone();
        config.lamps_per_step = self.lamps_per_step;
        config.rendering_every = self.rendering_every;
        self.set.iter().try_for_each(|setting| config.set(setting))?;
        Ok(config)
    }

    /// The requested settings.
    ///
    /// # Errors
    /// When a setting is invalid.
    pub fn settings(self) -> Result<TrainSettings> {
        Ok(TrainSettings { config: self.config()?, ..self.settings })
    }
}

impl TrainArgs {
    /// Rejects invalid settings.
    ///
    /// # Errors
    /// When a setting is invalid.
    pub fn check(&self) -> Result<()> {
        self.training.config().map(drop)
    }

    /// The requested job.
    ///
    /// # Errors
    /// When a setting is invalid, or the truth cannot be read.
    pub fn job(self) -> Result<Job> {
        let mut settings = self.training.settings()?;
        if let Some(truth) = &self.exclude_truth {
            let truth = Truth::open(&Project::open(&self.project)?, truth)?;
            settings.exclude_frames.extend(truth.frames);
        }
        Ok(Job::Train { project: self.project, settings })
    }
}
