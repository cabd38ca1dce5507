//! `afterlight relight`.

use super::OutputArgs;
use base::error::{Error, Result};
use base::files;
use clap::Args;
use export::Existing;
use export::relight::RelightSettings;
use light::keyframes::{Interpolation, Keyframes};
use scene::{Animation, Background, Setting};
use std::path::{Path, PathBuf};
use worker::Job;

/// Relight the interview under an environment and write pictures or a clip.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight relight interview --environment courtyard.hdr --turntable --to clip.mp4")]
pub struct RelightArgs {
    /// The project's folder.
    project: PathBuf,
    #[command(flatten)]
    export: ExportArgs,
    #[command(flatten)]
    pub output: OutputArgs,
}

/// An export. Arguments whose form differs from the window's follow the settings: keyframes, the background,
/// existing files.
#[derive(Debug, Args)]
pub struct ExportArgs {
    #[command(flatten)]
    settings: RelightSettings,
    /// Keyframes for any setting: a JSON object of names and keys, like `keys` in a project's look.json. Lights
    /// are numbered 1, 2, … in the order of --light.
    #[arg(long, value_name = "FILE")]
    keys: Option<PathBuf>,
    /// Keyframes of the yaw, added to --yaw.
    #[arg(long, value_name = "FRAME:DEG,…", allow_hyphen_values = true)]
    yaw_keys: Option<Keyframes>,
    /// Keyframes of the environment's brightness in stops, added to --intensity.
    #[arg(long, value_name = "FRAME:STOPS,…", allow_hyphen_values = true)]
    intensity_keys: Option<Keyframes>,
    /// Interpolate keyframes linearly instead of smoothly.
    #[arg(long)]
    linear_keys: bool,
    /// Same as --background none.
    #[arg(long, conflicts_with = "background")]
    no_background: bool,
    /// Keep existing files and append a number to the name, instead of replacing them.
    #[arg(long)]
    keep: bool,
}

impl RelightArgs {
    /// The requested job.
    ///
    /// # Errors
    /// When the keys cannot be read or are too large.
    pub fn job(self) -> Result<Job> {
        Ok(Job::Relight { project: self.project, settings: Box::new(self.export.settings()?) })
    }
}

impl ExportArgs {
    /// The settings, complete with keyframes, background and file handling.
    ///
    /// # Errors
    /// When the keys cannot be read or are too large.
    pub fn settings(self) -> Result<RelightSettings> {
        let mut settings = self.settings;
        let interpolation = if self.linear_keys { Interpolation::Linear } else { Interpolation::Smooth };
        settings.look.lighting.number_lights();
        if let Some(file) = &self.keys {
            settings.look.animation = read_keys(file)?;
        }
        for (setting, keys, base) in [
            (Setting::Yaw, self.yaw_keys, settings.look.yaw_deg),
            (Setting::Intensity, self.intensity_keys, settings.look.lighting.intensity_stops),
        ] {
            if let Some(keys) = keys {
                let mut keys = keys.plus(f64::from(base))?;
                keys.interpolation = interpolation;
                settings.look.animation.set(setting, keys);
            }
        }
        if self.no_background {
            settings.look.background = Background::None;
        }
        if let Some(file) = settings.look.background.file() {
            let file = std::path::absolute(file)
                .map_err(|e| Error::io("open", file, e, "Check the path of the background"))?;
            settings.look.background = settings.look.background.with_file(file);
        }
        if self.keep {
            settings.files.existing = Existing::Keep;
        }
        Ok(settings)
    }
}

/// Reads the keyframes in a file.
///
/// # Errors
/// When the file cannot be read or parsed.
fn read_keys(file: &Path) -> Result<Animation> {
    let text = files::read_text(file, files::MOST_TEXT)
        .map_err(|e| Error::io("read the keys in", file, e, "Check the path"))?;
    serde_json::from_str(&text).map_err(|e| {
        let remedy = "See \"Animate\" in docs/guide.md for the format";
        Error::codec("understand the keys in", file, e, remedy)
    })
}
