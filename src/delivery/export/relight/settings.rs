//! Settings for relighting an interview.

use crate::{Files, HandOver};
use base::error::{Error, Result};
use compositor::Storage;
use gpu::DeviceChoice;
use light::conventions::Front;
use light::{Environment, Mapping};
use project::Project;
use scene::{Background, Effects, Look, Output, Pass, STRENGTHS, Scene, Setting};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;

/// Light, look and destination of a relit interview.
#[derive(Clone, Debug, Serialize, Deserialize, clap::Args)]
pub struct RelightSettings {
    /// Panorama file, name of one of the project's environments, or a built-in one: three-point, clamshell,
    /// side-light, clear-sky, low-sun, overcast, courtyard, nave.
    #[arg(long)]
    pub environment: PathBuf,
    /// Front of the panorama, instead of the remembered one: the convention of a tool (afterlight, openexr, usd, nuke,
    /// mitsuba, threejs, blender), or the yaw that brings it to the middle.
    #[arg(long, value_name = "TOOL|DEG", allow_hyphen_values = true)]
    pub front: Option<Front>,
    /// Environment in memory, if it was read already.
    #[arg(skip)]
    #[serde(skip)]
    pub read: Option<Arc<Environment>>,
    /// Sphere layout of the panorama file, if it is not lat-long.
    #[arg(long, value_enum)]
    pub mapping: Option<Mapping>,
    /// Layer of an EXR panorama that has several [default: the finished picture].
    #[arg(long, value_name = "NAME")]
    #[serde(default)]
    pub environment_layer: Option<String>,
    #[command(flatten)]
    #[serde(flatten)]
    pub look: Look,
    /// Turn the environment once around over the frames, starting at --yaw.
    #[arg(long)]
    pub turntable: bool,
    /// Light the subject only by these lamps, without background: each with half of the energy of an even light.
    #[arg(long, value_name = "LAMP,…", value_delimiter = ',')]
    pub solo: Vec<String>,
    /// Frames A to B, both included, counted from 0 whatever the plate's numbers [default: all].
    #[arg(long, value_name = "A-B", value_parser = range)]
    pub frames: Option<(usize, usize)>,
    #[command(flatten)]
    pub files: Files,
    /// Write the files that other programs need to open the export (docs/handover.md).
    #[arg(long, value_enum, value_name = "PROGRAM,…", value_delimiter = ',')]
    pub hand_over: Vec<HandOver>,
    /// Print the passes: result or reason for skipping, and time.
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
        let mut scene = self.look.at(index).scene(index);
        if self.turntable {
            scene.yaw_deg += 360.0 * share;
        }
        if !self.solo.is_empty() {
            scene.background = Background::None;
        }
        Scene { yaw_deg: front.turned(scene.yaw_deg), output, ..scene }
    }

    /// Effects of the clip, with each animated one at its maximum: the most that any frame needs.
    pub fn largest_effects(&self) -> Effects {
        let mut effects = self.look.effects;
        for strength in STRENGTHS {
            if self.look.is_keyed(Setting::Effect(strength.pass)) {
                *(strength.of)(&mut effects) = strength.most;
            }
        }
        effects
    }

    /// True if a frame depends on the one before it. Smoothed brightness does, and so do OLATs in components, which reuse
    /// the components of earlier frames as long as they fit. Parts of such an export differ from the whole.
    pub fn goes_from_frame_to_frame(&self) -> bool {
        self.largest_effects().asks(Pass::Smoothing) || self.storage == Storage::Compressed
    }

    /// These settings with the project's OpenColorIO configuration, if they name colours of one without naming a configuration.
    #[must_use]
    pub fn of_project(&self, project: &Project) -> Self {
        let mut settings = self.clone();
        let ocio = &mut settings.files.ocio;
        if ocio.is_asked() {
            ocio.config = ocio.config.take().or_else(|| project.color_config());
        }
        settings
    }

    /// Refuses conflicting settings.
    ///
    /// # Errors
    /// When a missing light or group has keys, or grain meets an OpenColorIO configuration, which makes the codes.
    pub fn check(&self) -> Result<()> {
        if self.files.ocio.is_asked() && self.largest_effects().asks(Pass::Grain) {
            return Err(Error::invalid(
                "grain needs the codes of Afterlight's own view, not those of an OpenColorIO configuration",
                (
                    "Leave the grain out, or the configuration",
                    "--ocio-display, --ocio-view, --ocio-look and --ocio-space",
                ),
            ));
        }
        self.check_keys()
    }

    /// Refuses keys of a missing light or group.
    fn check_keys(&self) -> Result<()> {
        let mut lanes = self.look.animation.lanes();
        let lost = lanes.find(|(setting, _)| !setting.exists(&self.look.lighting));
        let Some((lost, _)) = lost else { return Ok(()) };
        if let Setting::Group(_) = lost {
            return Err(Error::missing(
                format!("{lost} has keys, but there is no such group of lights"),
                "Remove its keys",
            ));
        }
        let numbers = self.look.lighting.placed.iter().map(|light| light.id.to_string());
        let numbers: Vec<String> = numbers.collect();
        Err(Error::missing(
            match &numbers[..] {
                [] => format!("{lost} has keys, but there is no light"),
                _ => format!("{lost} has keys, but the lights have the numbers {}", numbers.join(", ")),
            },
            "Add the light, or remove its keys",
        ))
    }
}

/// First and last frame, such as `5-12`, or one frame.
fn range(text: &str) -> std::result::Result<(usize, usize), String> {
    let (from, to) = text.split_once('-').unwrap_or((text, text));
    let number = |s: &str| s.trim().parse::<usize>().map_err(|e| format!("{s:?} is not a frame number: {e}"));
    let (from, to) = (number(from)?, number(to)?);
    if from <= to { Ok((from, to)) } else { Err(format!("{from} comes after {to}")) }
}

/// First and last frame to relight: the requested range, or all frames.
///
/// # Errors
/// When the interview lacks some of them.
pub fn frame_range(project: &Project, asked: Option<(usize, usize)>) -> Result<(usize, usize)> {
    let last = project.settings.shoot.frames.len().saturating_sub(1);
    match asked {
        None => Ok((0, last)),
        Some((from, to)) if from <= to && to <= last => Ok((from, to)),
        Some((from, to)) => Err(Error::missing(
            format!("there are no frames {from}-{to}: the interview has frames 0 to {last}"),
            "Choose frames within this range",
        )),
    }
}

#[cfg(test)]
#[path = "settings_tests.rs"]
mod tests;
