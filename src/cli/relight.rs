//! `afterlight relight`.

use super::OutputArgs;
use clap::Args;
use export::Existing;
use export::relight::RelightSettings;
use light::keyframes::{Interpolation, Keyframes};
use scene::Background;
use std::path::PathBuf;
use worker::Job;

/// Relight the interview under an environment and write pictures or a clip.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight relight interview --environment courtyard.hdr --turntable --to clip.mp4"
)]
pub struct RelightArgs {
    /// The project's folder.
    project: PathBuf,
    #[command(flatten)]
    settings: RelightSettings,
    #[command(flatten)]
    keys: Keys,
    #[command(flatten)]
    pub output: OutputArgs,
}

/// What a command line says in another way than the window: keyframes, the background, existing files.
#[derive(Debug, Args)]
pub struct Keys {
    /// Keyframes of the yaw, added to --yaw.
    #[arg(long, value_name = "FRAME:DEG,…", allow_hyphen_values = true)]
    yaw_keys: Option<Keyframes>,
    /// Keyframes of the environment's brightness in stops, added to --intensity.
    #[arg(long, value_name = "FRAME:STOPS,…", allow_hyphen_values = true)]
    intensity_keys: Option<Keyframes>,
    /// Interpolate keyframes linearly instead of smoothly.
    #[arg(long)]
    linear_keys: bool,
    /// Leave out the environment behind the subject.
    #[arg(long)]
    no_background: bool,
    /// Keep existing files and append a number to the name, instead of replacing them.
    #[arg(long)]
    keep: bool,
}

impl RelightArgs {
    /// The job that was asked for.
    pub fn job(self) -> Job {
        Job::Relight {
            project: self.project,
            settings: Box::new(self.keys.apply(self.settings)),
        }
    }
}

impl Keys {
    /// The settings with these.
    pub fn apply(self, mut settings: RelightSettings) -> RelightSettings {
        let interpolation = if self.linear_keys {
            Interpolation::Linear
        } else {
            Interpolation::Smooth
        };
        let keys = |keys: Option<Keyframes>| {
            let mut keys = keys.unwrap_or_default();
            keys.interpolation = interpolation;
            keys
        };
        settings.yaw_keys = keys(self.yaw_keys);
        settings.intensity_keys = keys(self.intensity_keys);
        if self.no_background {
            settings.background = Background::None;
        }
        if self.keep {
            settings.files.existing = Existing::Keep;
        }
        settings
    }
}
