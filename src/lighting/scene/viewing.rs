//! Viewing changes on the display: brighter, lifted, or through another tone curve. Never exported.

use super::ViewTransform;
use imaging::DisplayTable;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Range of the viewing gamma.
pub const GAMMA: RangeInclusive<f32> = 0.2..=5.0;

/// Viewing changes, applied right before the tone curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Viewing {
    /// Exposure in stops.
    pub exposure_stops: f32,
    /// Exponent 1 / gamma on linear light: above 1 lifts shadows and midtones; black and 1 stay.
    pub gamma: f32,
    /// Tone curve in place of the picture's own; None for the picture's own.
    pub view: Option<ViewTransform>,
    /// View of the user's colour configuration, in place of any tone curve.
    #[serde(skip)]
    pub through: Option<Arc<DisplayTable>>,
}

impl Default for Viewing {
    fn default() -> Self {
        Self { exposure_stops: 0.0, gamma: 1.0, view: None, through: None }
    }
}

impl Viewing {
    /// True if the view equals the export.
    pub fn is_neutral(&self) -> bool {
        *self == Self::default()
    }

    /// Copy with numbers clamped to their ranges; NaN becomes neutral.
    #[must_use]
    pub fn bounded(self) -> Self {
        let within = |value: f32, range: RangeInclusive<f32>, neutral: f32| {
            if value.is_nan() { neutral } else { value.clamp(*range.start(), *range.end()) }
        };
        Self {
            exposure_stops: within(self.exposure_stops, super::EXPOSURE_STOPS, 0.0),
            gamma: within(self.gamma, GAMMA, 1.0),
            ..self
        }
    }

    /// Factor on linear light, and the exponent applied after it; both 1 if neutral.
    pub fn factor_and_power(&self) -> [f32; 2] {
        let Self { exposure_stops, gamma, .. } =
            Self { exposure_stops: self.exposure_stops, gamma: self.gamma, ..Self::default() }.bounded();
        [exposure_stops.exp2(), gamma.recip()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_neutral_one_changes_nothing_and_wild_numbers_come_into_range() {
        assert!(Viewing::default().is_neutral());
        assert_eq!(Viewing::default().factor_and_power(), [1.0, 1.0]);
        let wild = Viewing { exposure_stops: f32::NAN, gamma: f32::NAN, ..Viewing::default() };
        assert!(wild.bounded().is_neutral());
        let wild = Viewing { exposure_stops: f32::INFINITY, gamma: 0.0, ..Viewing::default() };
        assert_eq!(wild.factor_and_power(), [1024.0, 5.0]);
    }
}
