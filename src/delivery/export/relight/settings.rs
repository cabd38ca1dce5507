//! Settings for relighting an interview.

use crate::{Files, HandOver};
use base::error::{Error, Result};
use base::numbers::{ANGLES, within};
use compositor::Storage;
use gpu::DeviceChoice;
use light::conventions::Front;
use light::{Environment, Lighting, Mapping};
use project::Project;
use scene::{
    Animated, Animation, Background, EXPOSURE_STOPS, Effects, Output, Pass, STRENGTHS, Scene,
    Setting, Viewing,
};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;

/// Light, look and destination of a relit interview.
#[derive(Clone, Debug, Serialize, Deserialize, clap::Args)]
pub struct RelightSettings {
    /// A panorama's file, the name of one of the project's environments, or a built-in one: three-point, clamshell,
    /// side-light, clear-sky, low-sun, overcast, courtyard, nave.
    #[arg(long)]
    pub environment: PathBuf,
    /// Front of the panorama's file, instead of the one that the project remembers: the convention of a tool
    /// (afterlight, openexr, usd, nuke, mitsuba, threejs, blender), or the yaw that brings it to the middle.
    #[arg(long, value_name = "TOOL|DEG", allow_hyphen_values = true)]
    pub front: Option<Front>,
    /// The environment itself, if it has been read already.
    #[arg(skip)]
    #[serde(skip)]
    pub read: Option<Arc<Environment>>,
    /// Layout of the sphere in the panorama's file, if it is not a lat-long.
    #[arg(long, value_enum)]
    pub mapping: Option<Mapping>,
    /// Turn the environment: positive moves it to camera-right in front.
    #[arg(
        long = "yaw",
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(ANGLES)
    )]
    pub yaw_deg: f32,
    /// Turn the environment once around over the frames, starting at --yaw.
    #[arg(long)]
    pub turntable: bool,
    /// Light the subject by these lamps alone, without background: each with half of the energy of an even light.
    #[arg(long, value_name = "LAMP,…", value_delimiter = ',')]
    pub solo: Vec<String>,
    #[command(flatten)]
    pub lighting: Lighting,
    /// Keys of any settings over the interview's frames, which take the place of their values.
    #[arg(skip)]
    pub animation: Animation,
    #[command(flatten)]
    pub effects: Effects,
    /// Frames A to B, both included [default: all].
    #[arg(long, value_name = "A-B", value_parser = range)]
    pub frames: Option<(usize, usize)>,
    /// Exposure in stops, −10 to 10.
    #[arg(
        long = "exposure",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(EXPOSURE_STOPS)
    )]
    pub exposure_stops: f32,
    #[arg(skip)]
    pub background: Background,
    #[command(flatten)]
    pub files: Files,
    /// Write beside the export what other programs need to open it (docs/handover.md).
    #[arg(long, value_enum, value_name = "PROGRAM,…", value_delimiter = ',')]
    pub hand_over: Vec<HandOver>,
    /// Print which passes ran, which did not and why, and how long each took.
    #[arg(long)]
    pub profile: bool,
    /// Device that runs the network.
    #[arg(long, value_enum, default_value_t)]
    pub device: DeviceChoice,
    /// Storage format of predicted OLATs.
    #[arg(long = "field", value_enum, default_value_t)]
    pub storage: Storage,
}

impl RelightSettings {
    /// Scene of frame `index`, `share` of the way through the clip.
    pub fn scene(&self, index: usize, share: f32, front: Front, output: Output) -> Scene {
        let (mut yaw_deg, mut exposure_stops) = (self.yaw_deg, self.exposure_stops);
        let (mut lighting, mut effects) = (self.lighting.clone(), self.effects);
        let settings = Animated {
            yaw_deg: &mut yaw_deg,
            exposure_stops: &mut exposure_stops,
            lighting: &mut lighting,
            effects: &mut effects,
        };
        self.animation.apply(index as f64, settings);
        if self.turntable {
            yaw_deg += 360.0 * share;
        }
        Scene {
            frame: index,
            yaw_deg: front.turned(yaw_deg),
            lighting,
            effects,
            exposure_stops,
            background: match &self.solo[..] {
                [] => self.background,
                _ => Background::None,
            },
            output,
            // A person's way of looking at the picture is not the picture's.
            viewing: Viewing::default(),
        }
    }

    /// The effects, with each that has keys at its largest: what any frame of the clip may ask for.
    pub fn largest_effects(&self) -> Effects {
        let mut effects = self.effects;
        for strength in STRENGTHS {
            if self.animation.of(Setting::Effect(strength.pass)).is_some() {
                *(strength.of)(&mut effects) = strength.most;
            }
        }
        effects
    }

    /// True if a frame depends on the one before it: brightness that is smoothed does, and so do OLATs in components, which are
    /// those of the frames before as long as they fit. Parts of such an export are not those of the whole.
    pub fn goes_from_frame_to_frame(&self) -> bool {
        self.largest_effects().asks(Pass::Smoothing) || self.storage == Storage::Compressed
    }

    /// The same with the project's OpenColorIO configuration, if colours of one are asked for and no other is chosen.
    #[must_use]
    pub fn of_project(&self, project: &Project) -> Self {
        let mut settings = self.clone();
        let ocio = &mut settings.files.ocio;
        if ocio.is_asked() {
            ocio.config = ocio.config.take().or_else(|| project.color_config());
        }
        settings
    }

    /// Refuses what cannot be together.
    ///
    /// # Errors
    /// When a light or a group that is not there has keys, or grain is asked for where a configuration makes the codes.
    pub fn check(&self) -> Result<()> {
        if self.files.ocio.is_asked() && self.largest_effects().asks(Pass::Grain) {
            return Err(Error::invalid(
                "grain is measured in the codes of our own view, and an OpenColorIO configuration makes others",
                (
                    "Leave the grain out, or the configuration",
                    "--ocio-display, --ocio-view, --ocio-look and --ocio-space",
                ),
            ));
        }
        self.check_keys()
    }

    /// Refuses keys of a light or a group that is not there.
    fn check_keys(&self) -> Result<()> {
        let mut lanes = self.animation.lanes();
        let lost = lanes.find(|(setting, _)| !setting.exists(&self.lighting));
        let Some((lost, _)) = lost else {
            return Ok(());
        };
        if let Setting::Group(_) = lost {
            return Err(Error::missing(
                format!("there are keys of {lost}, and no such group of lights"),
                "Take its keys out",
            ));
        }
        let numbers = self.lighting.placed.iter().map(|light| light.id.to_string());
        let numbers: Vec<String> = numbers.collect();
        Err(Error::missing(
            match &numbers[..] {
                [] => format!("there are keys of {lost}, and no light"),
                _ => format!(
                    "there are keys of {lost}, and the lights have the numbers {}",
                    numbers.join(", ")
                ),
            },
            "Add the light, or take its keys out",
        ))
    }
}

/// The first and last frame, such as `5-12`, or one frame.
fn range(text: &str) -> std::result::Result<(usize, usize), String> {
    let (from, to) = text.split_once('-').unwrap_or((text, text));
    let number = |s: &str| {
        s.trim().parse::<usize>().map_err(|e| format!("{s:?} is not a frame number: {e}"))
    };
    let (from, to) = (number(from)?, number(to)?);
    if from <= to { Ok((from, to)) } else { Err(format!("{from} comes after {to}")) }
}

/// The first and last frame that are relit: those that are asked for, or all.
///
/// # Errors
/// When the interview has not all of them.
pub fn frame_range(project: &Project, asked: Option<(usize, usize)>) -> Result<(usize, usize)> {
    let last = project.settings.shoot.frames.len().saturating_sub(1);
    match asked {
        None => Ok((0, last)),
        Some((from, to)) if from <= to && to <= last => Ok((from, to)),
        Some((from, to)) => Err(Error::missing(
            format!("there are no frames {from}-{to}: the interview has frames 0 to {last}"),
            "Ask for frames that the interview has",
        )),
    }
}

#[cfg(test)]
#[path = "settings_tests.rs"]
mod tests;
