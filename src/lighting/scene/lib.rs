//! A scene: everything one picture asks for, as plain data.

mod animation;
mod forced;
mod pass;
mod setting;
mod viewing;

pub use animation::Animation;
pub use forced::Forced;
pub use pass::{Effects, Pass, STRENGTHS, Strength};
pub use setting::{Animated, LightSetting, Setting, Unit};
pub use viewing::{GAMMA, Viewing};

use light::Lighting;
use serde::{Deserialize, Serialize};

/// Range of the exposure in stops: beyond it a display shows nothing but black or white.
pub const EXPOSURE_STOPS: std::ops::RangeInclusive<f32> = -10.0..=10.0;

/// Settings of one relit picture, apart from the pixels themselves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Interview frame, from 0.
    pub frame: usize,
    /// Yaw of the environment in degrees; positive moves its content to camera-right in front.
    pub yaw_deg: f32,
    /// Further changes to the environment's light.
    #[serde(default)]
    pub lighting: Lighting,
    /// Exposure of the picture in stops.
    pub exposure_stops: f32,
    /// Background behind the subject.
    pub background: Background,
    /// Output form of the picture.
    pub output: Output,
    /// Further changes to it; nothing unless asked for.
    #[serde(default)]
    pub effects: Effects,
    /// Settings for looking at it; exports have none of them.
    #[serde(default, skip_serializing_if = "Viewing::is_neutral")]
    pub viewing: Viewing,
}

impl Scene {
    /// The tone curve that the picture is shown through.
    pub fn view(&self) -> ViewTransform {
        self.viewing.view.unwrap_or(self.effects.view)
    }
}

/// Background behind the subject.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Background {
    /// The environment, as the interview's camera would see it.
    #[default]
    Environment,
    /// Nothing: black, and zero alpha if the output has alpha.
    None,
}

/// Output form of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Output {
    /// 8 bits, sRGB-encoded: a window, a PNG, a movie.
    #[default]
    Display,
    /// Scene-linear light: an EXR.
    Linear,
}

/// Conversion of linear light to codes of a display.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "snake_case")]
pub enum ViewTransform {
    /// The sRGB curve; what is brighter than white clips.
    #[default]
    Srgb,
    /// A film-like curve after AgX: 16.5 stops, and bright colours fade to white.
    Filmic,
    /// The Academy's reference rendering for a display, in Hill's fit: more contrast.
    Aces,
}

/// View that a display shows in place of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Inspection {
    /// The picture itself.
    #[default]
    Picture,
    /// One channel in grey.
    Channel(Channel),
    /// The difference of codes to a second picture, times `gain`.
    Difference { gain: f32 },
    /// Zones of exposure in flat colours.
    FalseColor,
}

/// A channel that can be shown alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    Red,
    Green,
    Blue,
    /// Relative luminance of the codes' light, as a grey of that light.
    Luminance,
    /// Coverage; its codes are linear.
    Alpha,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_without_effects_can_still_be_read() {
        let old = r#"{"frame":3,"yaw_deg":1.5,"exposure_stops":0.0,"background":"None","output":"Display"}"#;
        let scene: Scene = serde_json::from_str(old).unwrap();
        assert_eq!(scene.effects, Effects::default());
        assert!(scene.viewing.is_neutral());
        let text = serde_json::to_string(&scene).unwrap();
        assert!(!text.contains("viewing"), "{text}");
        let some = r#"{"glare":0.5,"inspection":{"channel":"alpha"}}"#;
        let effects: Effects = serde_json::from_str(some).unwrap();
        assert_eq!(effects.glare, 0.5);
        assert_eq!(effects.inspection, Inspection::Channel(Channel::Alpha));
    }
}
