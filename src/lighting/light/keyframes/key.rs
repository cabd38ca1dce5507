//! A key: a value at a frame, and the interpolation that follows.

use serde::{Deserialize, Serialize};

/// Interpolation of a value from a key to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// Constant speed.
    Linear,
    /// No corners and no overshoot: the curve between two keys never leaves their values. The monotone piecewise
    /// cubic of Fritsch and Carlson (SIAM J. Numer. Anal. 17, 1980), with the slopes of Fritsch and Butland (SIAM
    /// J. Sci. Stat. Comput. 5, 1984): the weighted harmonic mean of the neighbouring slopes, and 0 at peaks,
    /// valleys and ends.
    #[default]
    Smooth,
    /// The value holds until the next key and jumps there.
    Hold,
    /// Tangents of both keys: Hermite's cubic, a Bézier curve with handles at a third of the way. Automatic
    /// tangents are those of [`Self::Smooth`]; tangents set by hand may overshoot the keys' values.
    Bezier,
}

impl Interpolation {
    /// All interpolations with their menu titles.
    pub const ALL: [(Self, &'static str); 4] =
        [(Self::Smooth, "Smooth"), (Self::Linear, "Linear"), (Self::Hold, "Hold"), (Self::Bezier, "Bézier")];

    /// True if tangents shape the curve.
    pub fn is_cubic(self) -> bool {
        matches!(self, Self::Smooth | Self::Bezier)
    }
}

/// A value at a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Key {
    /// The frame; may be fractional.
    pub frame: f64,
    /// The value, without wrapping: a yaw from 0 to 720 turns twice.
    pub value: f64,
    /// Interpolation to the next key; None for [`super::Keyframes::interpolation`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interpolation: Option<Interpolation>,
    /// Incoming and outgoing slopes of the curve in values per frame; None for automatic. Used with
    /// [`Interpolation::Bezier`].
    #[serde(rename = "in", default, skip_serializing_if = "Option::is_none")]
    pub slope_in: Option<f64>,
    #[serde(rename = "out", default, skip_serializing_if = "Option::is_none")]
    pub slope_out: Option<f64>,
}

impl Key {
    /// True if every number is finite and at most `largest`.
    pub(super) fn is_within(&self, largest: f64) -> bool {
        let slopes = [self.slope_in, self.slope_out].into_iter().flatten();
        let mut numbers = [self.frame, self.value].into_iter().chain(slopes);
        // NaN fails.
        numbers.all(|number| number.abs() <= largest)
    }
}
