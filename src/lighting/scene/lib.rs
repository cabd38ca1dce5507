//! A scene: the settings of one picture as plain data.

mod animation;
mod background;
mod look;
mod pass;
mod setting;
mod value;
mod viewing;

pub use animation::Animation;
pub use background::{Background, BackgroundFile};
pub use look::Look;
pub use pass::{Effects, Forced, Pass, STRENGTHS, Strength};
pub use setting::{LightSetting, Setting, Unit};
pub use viewing::{GAMMA, Viewing};

use light::Lighting;
use serde::{Deserialize, Serialize};

/// Range of the exposure in stops. Beyond it a display shows only black or white.
pub const EXPOSURE_STOPS: std::ops::RangeInclusive<f32> = -10.0..=10.0;

/// Settings of one relit picture, without its pixels.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Interview frame, from 0.
    pub frame: usize,
    /// Yaw of the environment in degrees; positive moves its content to camera-right in front.
    pub yaw_deg: f32,
    /// Other changes to the environment's light.
    #[serde(default)]
    pub lighting: Lighting,
    /// Exposure of the picture in stops.
    pub exposure_stops: f32,
    /// Background behind the subject.
    pub background: Background,
    /// Output form of the picture.
    pub output: Output,
    /// Picture effects; none by default.
    #[serde(default)]
    pub effects: Effects,
    /// Viewing settings; never exported.
    #[serde(default, skip_serializing_if = "Viewing::is_neutral")]
    pub viewing: Viewing,
}

impl Scene {
    /// Tone curve of the displayed picture.
    pub fn view(&self) -> ViewTransform {
        self.viewing.view.unwrap_or(self.effects.view)
    }
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

/// Tone curve from linear light to display codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum ViewTransform {
    /// The sRGB curve; values above white clip.
    #[default]
    Srgb,
    /// A film-like curve after AgX: 16.5 stops, and bright colours fade to white.
    Filmic,
    /// The Academy's reference rendering for displays, in Hill's fit: more contrast.
    Aces,
}

/// Picture or diagnostic view on the display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Inspection {
    /// The picture itself.
    #[default]
    Picture,
    /// One channel in grey.
    Channel(Channel),
    /// Difference of codes to a second picture, times `gain`.
    Difference { gain: f32 },
    /// Exposure zones in flat colours.
    FalseColor,
}

/// A channel that can be viewed alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    Red,
    Green,
    Blue,
    /// Relative luminance of the codes' light, shown as grey.
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
