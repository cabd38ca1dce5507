//! `afterlight relight`.

use super::parse::parse_range;
use super::{DeviceArgs, OutputArgs};
use clap::Args;
use compositor::Storage;
use export::relight::RelightSettings;
use export::{Bits, Existing, Files};
use light::conventions::Front;
use light::keyframes::{Interpolation, Keyframes};
use light::weights::Weighting;
use light::{Lighting, Mapping, PlacedLight, white};
use scene::{Background, Effects};
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
    /// A panorama's file, the name of one of the project's environments, or one that is built in:
    /// three-point, clamshell, side-light, clear-sky, low-sun, overcast, courtyard, nave.
    #[arg(long)]
    environment: PathBuf,
    /// Which way is front in the panorama's file, instead of what the project remembers: the convention of a tool
    /// (afterlight, openexr, usd, nuke, mitsuba, threejs, blender), or the yaw that brings it to the middle.
    #[arg(long, value_name = "TOOL|DEG", allow_hyphen_values = true)]
    front: Option<Front>,
    /// How the panorama's file lays out the sphere, if it is not a lat-long.
    #[arg(long, value_enum)]
    mapping: Option<Mapping>,
    /// Turn the environment: positive moves it to camera-right in front.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    yaw: f32,
    /// Turn the environment once around over the frames, starting at --yaw.
    #[arg(long)]
    turntable: bool,
    /// Keyframes of the yaw, added to --yaw.
    #[arg(long, value_name = "FRAME:DEG,…", allow_hyphen_values = true)]
    yaw_keys: Option<Keyframes>,
    /// Keyframes of the environment's brightness in stops, added to --intensity.
    #[arg(long, value_name = "FRAME:STOPS,…", allow_hyphen_values = true)]
    intensity_keys: Option<Keyframes>,
    /// Interpolate keyframes linearly instead of smoothly.
    #[arg(long)]
    linear_keys: bool,
    #[command(flatten)]
    lighting: LightingArgs,
    #[command(flatten)]
    effects: Effects,
    /// Frames A to B, both included [default: all].
    #[arg(long, value_name = "A-B", value_parser = parse_range)]
    frames: Option<(usize, usize)>,
    /// Exposure in stops.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Leave out the environment behind the subject.
    #[arg(long)]
    no_background: bool,
    #[command(flatten)]
    files: FilesArgs,
    /// Print which passes ran, which did not and why, and how long each took.
    #[arg(long)]
    profile: bool,
    /// Storage format of predicted OLATs.
    #[arg(long, value_enum, default_value_t)]
    field: Storage,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    pub output: OutputArgs,
}

/// What is written.
#[derive(Debug, Args)]
struct FilesArgs {
    /// What to write: out.%04d.png, out.%04d.exr, clip.mp4, or clip.mov with alpha.
    #[arg(long)]
    to: String,
    /// Keep existing files and append a number to the name, instead of replacing them.
    #[arg(long)]
    keep: bool,
    /// Width and height in pixels [default: the working size].
    #[arg(long, value_name = "PIXELS")]
    size: Option<usize>,
    /// Bits of a PNG's channels.
    #[arg(long, value_enum, default_value_t)]
    bits: Bits,
    /// Add the subject under each lamp to an EXR, as light_00.R …, with the lamps' weights in the header.
    #[arg(long)]
    layers: bool,
}

/// What is done to the environment's light.
#[derive(Debug, Args)]
struct LightingArgs {
    /// How the environment is given to the lamps.
    #[arg(long, value_enum, default_value_t)]
    weights: Weighting,
    /// Turn the environment up, after its yaw.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pitch: f32,
    /// Turn the environment counter-clockwise, after its yaw and pitch.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    roll: f32,
    /// Brightness of the environment in stops.
    #[arg(
        long,
        value_name = "STOPS",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    intensity: f32,
    /// Colour temperature that makes the environment's white warmer or cooler.
    #[arg(long, value_name = "KELVIN", default_value_t = white::NEUTRAL_K)]
    temperature: f32,
    /// Tint of the environment, −100 green to 100 magenta.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    tint: f32,
    /// Turn the environment further than its light where it shows behind the subject.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    background_yaw: f32,
    /// A soft light of SIZE degrees across, at an azimuth (−90 camera-left, 90 camera-right, 180 at the camera)
    /// and an elevation. An intensity of π lights white that faces it to 1. Can be given several times.
    #[arg(
        long,
        value_name = "AZIMUTH,ELEVATION,SIZE,INTENSITY[,R,G,B]",
        allow_hyphen_values = true
    )]
    light: Vec<PlacedLight>,
}

impl RelightArgs {
    /// The job that was asked for.
    pub fn job(&self) -> Job {
        let interpolation = if self.linear_keys {
            Interpolation::Linear
        } else {
            Interpolation::Smooth
        };
        let keys = |keys: &Option<Keyframes>| {
            let mut keys = keys.clone().unwrap_or_default();
            keys.interpolation = interpolation;
            keys
        };
        let settings = RelightSettings {
            environment: self.environment.clone(),
            front: self.front,
            read: None,
            mapping: self.mapping,
            yaw_deg: self.yaw,
            turntable: self.turntable,
            yaw_keys: keys(&self.yaw_keys),
            lighting: Lighting {
                weighting: self.lighting.weights,
                pitch_deg: self.lighting.pitch,
                roll_deg: self.lighting.roll,
                intensity_stops: self.lighting.intensity,
                temperature_k: self.lighting.temperature,
                tint: self.lighting.tint,
                background_yaw_deg: self.lighting.background_yaw,
                placed: self.lighting.light.clone(),
            },
            intensity_keys: keys(&self.intensity_keys),
            effects: self.effects,
            frames: self.frames,
            exposure_stops: self.exposure,
            background: if self.no_background {
                Background::None
            } else {
                Background::Environment
            },
            files: Files {
                to: self.files.to.clone(),
                existing: if self.files.keep {
                    Existing::Keep
                } else {
                    Existing::Replace
                },
                size: self.files.size,
                bits: self.files.bits,
                layers: self.files.layers,
            },
            profile: self.profile,
            device: self.device.device,
            storage: self.field,
        };
        Job::Relight {
            project: self.project.clone(),
            settings: Box::new(settings),
        }
    }
}
