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
