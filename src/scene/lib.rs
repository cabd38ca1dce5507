//! A scene: everything one picture asks for, as plain data.

mod forced;
mod pass;

pub use forced::Forced;
pub use pass::Pass;

use light::Lighting;
use serde::{Deserialize, Serialize};

/// What one relit picture asks for, apart from the pixels themselves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Interview frame, from 0.
    pub frame: usize,
    /// Yaw of the environment in degrees; positive moves its content to camera-right in front.
    pub yaw_deg: f32,
    /// What else is done to the environment's light.
    #[serde(default)]
    pub lighting: Lighting,
    /// Exposure of the picture in stops.
    pub exposure_stops: f32,
    /// What is behind the subject.
    pub background: Background,
    /// What becomes of the picture.
    pub output: Output,
    /// What else is done to it; nothing unless asked for.
    #[serde(default)]
    pub effects: Effects,
}

/// What is behind the subject.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Background {
    /// The environment, as the interview's camera would see it.
    #[default]
    Environment,
    /// Nothing: black, and zero alpha where the output has alpha.
    None,
}

/// What becomes of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Output {
    /// 8 bits, sRGB-encoded: a window, a PNG, a movie.
    #[default]
    Display,
    /// Scene-linear light: an EXR.
    Linear,
}

/// Effects and their strengths. The default leaves the picture as light and camera made it.
/// A strength that is negative or no number counts as 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Effects {
    /// Share in `[0, 1]` of a jump in brightness from one frame to the next that is held back.
    pub smoothing: f32,
    /// Share in `[0, 1]` of the coloured spill at the subject's rim that is taken out.
    pub despill: f32,
    /// Radius of the background's defocus as a share of the picture's height, up to 0.25.
    pub background_blur: f32,
    /// Share in `[0, 1]` of the background's light that wraps around the subject's rim.
    pub light_wrap: f32,
    /// Share in `[0, 1]` of the light above white that the lens scatters.
    pub glare: f32,
    /// How linear light becomes codes of a display.
    pub view: ViewTransform,
    /// Strength of the plate's grain, from 0 to 4: 1 matches the plate.
    pub grain: f32,
    /// What is looked at in place of the picture itself.
    pub inspection: Inspection,
    /// Passes that run, or are left out, whatever the picture calls for.
    pub forced: Forced,
}

/// How linear light becomes codes of a display.
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

/// What a display shows in place of the picture.
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

/// A channel that can be looked at alone.
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

impl Effects {
    /// The same with every strength within its range: 0 where it is negative or no number.
    pub fn bounded(self) -> Self {
        // `f32::max` takes the other side where one is no number.
        let bound = |strength: f32, most: f32| strength.max(0.0).min(most);
        Self {
            smoothing: bound(self.smoothing, 1.0),
            despill: bound(self.despill, 1.0),
            background_blur: bound(self.background_blur, 0.25),
            light_wrap: bound(self.light_wrap, 1.0),
            glare: bound(self.glare, 1.0),
            grain: bound(self.grain, 4.0),
            ..self
        }
    }

    /// Whether an effect that has a strength is asked for: by the strength, or because its pass is forced to
    /// run and not forced off.
    pub fn asks(&self, pass: Pass) -> bool {
        let strength = match pass {
            Pass::Smoothing => self.smoothing,
            Pass::Despill => self.despill,
            Pass::BackgroundBlur => self.background_blur,
            Pass::LightWrap => self.light_wrap,
            Pass::Glare => self.glare,
            Pass::Grain => self.grain,
            _ => 0.0,
        };
        self.forced.get(pass).unwrap_or(strength > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_without_effects_can_still_be_read() {
        let old = r#"{"frame":3,"yaw_deg":1.5,"exposure_stops":0.0,"background":"None","output":"Display"}"#;
        let scene: Scene = serde_json::from_str(old).unwrap();
        assert_eq!(scene.effects, Effects::default());
        let some = r#"{"glare":0.5,"inspection":{"channel":"alpha"}}"#;
        let effects: Effects = serde_json::from_str(some).unwrap();
        assert_eq!(effects.glare, 0.5);
        assert_eq!(effects.inspection, Inspection::Channel(Channel::Alpha));
    }

    #[test]
    fn a_strength_that_makes_no_sense_is_brought_into_its_range() {
        let wild = Effects {
            glare: f32::NAN,
            despill: -1.0,
            grain: f32::INFINITY,
            light_wrap: 7.0,
            ..Effects::default()
        };
        let bounded = wild.bounded();
        assert_eq!((bounded.glare, bounded.despill), (0.0, 0.0));
        assert_eq!((bounded.grain, bounded.light_wrap), (4.0, 1.0));
    }
}
