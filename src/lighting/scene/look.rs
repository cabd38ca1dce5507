//! The look of a clip: its settings and their keys.

use super::{Animation, Background, EXPOSURE_STOPS, Effects, Scene, Setting};
use base::numbers::{ANGLES, within};
use light::Lighting;
use light::keyframes::Keyframes;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Look of a clip, as shown, saved and exported. Files without some fields have the neutral values.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default)]
pub struct Look {
    /// Yaw of the environment: positive moves it to camera-right in front.
    #[arg(
        long = "yaw",
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(ANGLES)
    )]
    pub yaw_deg: f32,
    #[command(flatten)]
    pub lighting: Lighting,
    #[command(flatten)]
    pub effects: Effects,
    /// Exposure in stops, −10 to 10.
    #[arg(
        long = "exposure",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(EXPOSURE_STOPS)
    )]
    pub exposure_stops: f32,
    /// Background: environment, plate (as filmed), checker, none, a colour #RRGGBB, or a still, movie or pattern of stills
    /// (sky.%04d.exr), X and Y as shares of the picture's width and height.
    #[arg(long, value_name = "KIND|FILE[,X,Y[,SCALE[,STOPS]]]", allow_hyphen_values = true, default_value = "environment", value_parser = Background::from_str)]
    pub background: Background,
    /// Keyframes of settings over the interview's frames; they override the fixed values.
    #[arg(skip)]
    #[serde(rename = "keys", alias = "animation")]
    pub animation: Animation,
}

impl Look {
    /// Keys of a setting; empty without keys.
    pub fn keys(&self, setting: Setting) -> &Keyframes {
        static NONE: Keyframes = Keyframes::NONE;
        self.animation.keys(setting).unwrap_or(&NONE)
    }

    /// True if a setting has keys.
    pub fn is_keyed(&self, setting: Setting) -> bool {
        self.animation.keys(setting).is_some()
    }

    /// Value of a setting, without its keys; None if its light or group does not exist.
    pub fn value(&self, setting: Setting) -> Option<f32> {
        let (lighting, effects) = (self.lighting.clone(), self.effects);
        let (yaw_deg, exposure_stops) = (self.yaw_deg, self.exposure_stops);
        let mut look = Self { yaw_deg, lighting, effects, exposure_stops, ..Self::default() };
        setting.field(&mut look).copied()
    }

    /// Sets each setting with keys to its value at a frame.
    pub fn follow(&mut self, frame: usize) {
        let values: Vec<_> = (self.animation.lanes())
            .map(|(setting, _)| (setting, self.animation.value(setting, frame as f64)))
            .collect();
        for (setting, value) in values {
            if let Some((field, value)) = setting.field(self).zip(value) {
                *field = value;
            }
        }
    }

    /// The look with the values of its keys at a frame.
    #[must_use]
    pub fn at(&self, frame: usize) -> Self {
        let mut look = self.clone();
        look.follow(frame);
        look
    }

    /// Scene of a frame with the present values, without their keys, for a display.
    pub fn scene(&self, frame: usize) -> Scene {
        Scene {
            frame,
            yaw_deg: self.yaw_deg,
            lighting: self.lighting.clone(),
            exposure_stops: self.exposure_stops,
            background: self.background.clone(),
            effects: self.effects,
            ..Scene::default()
        }
    }
}
