//! `afterlight train`.

use super::parse::{parse_count, parse_minutes};
use super::{DeviceArgs, OutputArgs};
use base::error::Result;
use clap::Args;
use evaluation::Truth;
use project::Project;
use reflectance::Precision;
use std::path::PathBuf;
use training::{Preset, TrainSettings};
use worker::Job;

/// Train the project's network, or go on training it. Ctrl-C stops it and keeps the checkpoint.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight train interview --preset quick --exclude-frames 5,14,25,36"
)]
pub struct TrainArgs {
    /// The project's folder.
    project: PathBuf,
    /// Where the settings start from.
    #[arg(long, value_enum, default_value = "quick")]
    preset: Preset,
    /// How exactly convolutions multiply on a CPU.
    #[arg(long, value_enum)]
    precision: Option<Precision>,
    /// End after this many minutes of training, earlier runs counted in.
    #[arg(long, conflicts_with = "epochs", value_parser = parse_minutes)]
    minutes: Option<f64>,
    /// End after this many epochs, earlier runs counted in.
    #[arg(long)]
    epochs: Option<u32>,
    /// Compare pictures by the features of the network in this file, in place of the built-in ones:
    /// torchvision's VGG-16, VGG-19 or SqueezeNet 1.1 as .safetensors or .pth.
    #[arg(long, value_name = "FILE")]
    features: Option<PathBuf>,
    /// Compare the OLATs of this many lamps a step, drawn anew each time; all where this is left out.
    #[arg(long, value_name = "K", value_parser = parse_count)]
    lamps_per_step: Option<usize>,
    /// Exemplar steps from one with the rendering loss to the next; those between compute only the lamps
    /// that they compare.
    #[arg(long, value_name = "STEPS", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    rendering_every: u64,
    /// Change any other setting of the preset, such as width=32; can be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Interview frames that training must not see, such as 5,14,25,36.
    #[arg(long, value_delimiter = ',')]
    exclude_frames: Vec<usize>,
    /// Keep the frames of this truth out of training, so that they can judge it.
    #[arg(long, value_name = "DIR")]
    exclude_truth: Option<PathBuf>,
    /// A pose, from 0, that training must not see and that judges it: the best network there predicts.
    #[arg(long, value_name = "POSE")]
    hold_out: Option<usize>,
    /// Start over instead of going on from the checkpoint.
    #[arg(long)]
    fresh: bool,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl TrainArgs {
    /// The job that was asked for.
    pub fn job(&self) -> Result<Job> {
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
        config.features.clone_from(&self.features);
        config.lamps_per_step = self.lamps_per_step;
        config.rendering_every = self.rendering_every;
        self.set
            .iter()
            .try_for_each(|setting| config.set(setting))?;
        let mut exclude_frames = self.exclude_frames.clone();
        if let Some(truth) = &self.exclude_truth {
            exclude_frames.extend(Truth::open(&Project::open(&self.project)?, truth)?.frames);
        }
        let settings = TrainSettings {
            config,
            exclude_frames,
            hold_out: self.hold_out,
            fresh: self.fresh,
            device: self.device.device,
        };
        Ok(Job::Train {
            project: self.project.clone(),
            settings,
        })
    }
}
