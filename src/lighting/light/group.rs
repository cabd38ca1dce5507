//! Lights placed by hand that are turned up, muted and shown alone together.

use serde::{Deserialize, Serialize};

/// A group of placed lights: those whose [`super::PlacedLight::group`] is its name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LightGroup {
    pub name: String,
    /// Tells it from the other groups, whatever it is called; 0 until [`super::Lighting::number_lights`].
    #[serde(skip_serializing_if = "is_unknown")]
    pub id: u32,
    /// Brightness of all its lights in stops, within [`super::Lighting::STOPS`].
    #[serde(skip_serializing_if = "is_zero")]
    pub gain_stops: f32,
    /// Its lights are off.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub muted: bool,
    /// Its lights light the subject alone: see [`super::Lighting::shines`].
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub solo: bool,
}

/// The signature is serde's.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_zero(value: &f32) -> bool {
    *value == 0.0
}

/// The signature is serde's.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_unknown(id: &u32) -> bool {
    *id == 0
}

impl LightGroup {
    /// Factor on the intensity of its lights; NaN counts as 0 stops.
    pub fn gain(&self) -> f32 {
        let stops = super::Lighting::STOPS;
        match self.gain_stops.is_nan() {
            true => 1.0,
            false => (self.gain_stops).clamp(*stops.start(), *stops.end()).exp2(),
        }
    }
}
