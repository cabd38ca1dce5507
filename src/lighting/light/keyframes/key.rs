//! A key: a value at a frame, and how it goes on from there.

use serde::{Deserialize, Serialize};

/// Course of a value from a key to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// Evenly.
    Linear,
    /// With no corners and no overshoot: between two keys it never leaves their values. The monotone
    /// piecewise cubic of Fritsch and Carlson (SIAM J. Numer. Anal. 17, 1980), with the slopes of Fritsch and Butland
    /// (SIAM J. Sci. Stat. Comput. 5, 1984): the weighted harmonic mean of the neighbouring slopes, and 0 at
    /// peaks, valleys and ends.
    #[default]
    Smooth,
    /// It stays until the next key, and jumps there.
    Hold,
    /// By the tangents of both keys: Hermite's cubic, which is a Bézier curve with handles at a third of the way. Automatic
    /// tangents are those of [`Self::Smooth`]; tangents set by hand may lead beyond the keys' values.
    Bezier,
}

impl Interpolation {
    /// All of them, with what a menu calls them.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::Smooth, "Smooth"),
        (Self::Linear, "Linear"),
        (Self::Hold, "Hold"),
        (Self::Bezier, "Bézier"),
    ];

    /// True if tangents shape it.
    pub fn is_cubic(self) -> bool {
        matches!(self, Self::Smooth | Self::Bezier)
    }
}

/// A value at a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Key {
    /// The frame, which may lie between two.
    pub frame: f64,
    /// Values are interpolated as they are: a yaw from 0 to 720 turns twice.
    pub value: f64,
    /// Interpolation to the next key; None for that of [`super::Keyframes::interpolation`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interpolation: Option<Interpolation>,
    /// Slopes of the curve where it comes in and goes out, in values a frame; None for automatic ones. They count where
    /// the curve is [`Interpolation::Bezier`].
    #[serde(rename = "in", default, skip_serializing_if = "Option::is_none")]
    pub slope_in: Option<f64>,
    #[serde(rename = "out", default, skip_serializing_if = "Option::is_none")]
    pub slope_out: Option<f64>,
}

impl Key {
    /// True if every number in it is finite and at most `largest`.
    pub(super) fn is_within(&self, largest: f64) -> bool {
        let slopes = [self.slope_in, self.slope_out].into_iter().flatten();
        let mut numbers = [self.frame, self.value].into_iter().chain(slopes);
        // NaN is not.
        numbers.all(|number| number.abs() <= largest)
    }
}
