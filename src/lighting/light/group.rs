//! Groups of placed lights that share gain, mute and solo.

use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Range of an intensity or a gain in stops.
pub(super) const STOPS: RangeInclusive<f32> = -10.0..=10.0;

/// A group of placed lights: all whose [`super::PlacedLight::group`] equals its name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LightGroup {
    pub name: String,
    /// Stable identity, independent of the name; 0 until [`super::Lighting::number_lights`].
    #[serde(skip_serializing_if = "is_unknown")]
    pub id: u32,
    /// Gain of all its lights in stops, within [`super::Lighting::STOPS`].
    #[serde(skip_serializing_if = "is_zero")]
    pub gain_stops: f32,
    /// Turns its lights off.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub muted: bool,
    /// Makes its lights the only lights on the subject; see [`super::Lighting::shines`].
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub solo: bool,
}

/// Signature required by serde.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_zero(value: &f32) -> bool {
    *value == 0.0
}

/// Signature required by serde.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_unknown(id: &u32) -> bool {
    *id == 0
}

impl LightGroup {
    /// Factor on the intensity of the group's lights; NaN counts as 0 stops.
    pub fn gain(&self) -> f32 {
        if self.gain_stops.is_nan() { 1.0 } else { (self.gain_stops).clamp(*STOPS.start(), *STOPS.end()).exp2() }
    }
}
