//! Facts that decide about passes: existing results, and measurements of the picture so far.

use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};

/// Facts that the plan needs besides the scene. The need for an effect is measured only if the scene requests the
/// effect; otherwise it stays at its default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Facts {
    /// True if the reflectance field of the scene's frame was cached.
    pub field_cached: bool,
    /// True if the weights of the scene's environment and yaw were cached.
    pub weights_cached: bool,
    /// Number of lamps of the rig.
    pub lamps: usize,
    /// Number of lamps with a non-zero weight.
    pub lit_lamps: usize,
    /// Columns and rows of the plate that the light is brought to; None if the picture has the working size.
    pub plate: Option<(usize, usize)>,
    /// True if the plate has light finer than the working size.
    pub fine_light: bool,
    /// Share in `[0, 1]` of pixels that the subject does not cover fully.
    pub open_share: f32,
    /// Keys of the picture's ingredients.
    pub inputs: Inputs,
    /// Gain that would hold this frame's brightness steady; None if not measured.
    pub steady_gain: Option<[f32; 3]>,
    /// Spill in the relit subject's rim; None if not measured.
    pub spill: Option<Spill>,
    /// Light that full wrapping would add to the rim, as a share of the rim's light.
    pub wrap_need: f32,
    /// Largest linear value before exposure.
    pub brightest: f32,
    /// The picture's own grain.
    pub own_grain: Grain,
    /// Largest deviation of the plate's grain beyond the picture's own, in codes.
    pub missing_grain: f32,
    /// True if there is a second picture for a comparison.
    pub second_picture: bool,
}

/// Keys of the passes' inputs: equal numbers mean equal inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Inputs {
    /// Frame: its field, its matte and its plate.
    pub frame: u64,
    /// The lamps' weights and the subject's level.
    pub light: u64,
    /// Panorama, its level and its camera.
    pub backdrop: u64,
    /// Picture that a background's file shows.
    pub behind: u64,
    /// Grain of the plate.
    pub grain: u64,
    /// Second picture.
    pub second: u64,
}

/// Colour of a screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Screen {
    Green,
    Blue,
}

/// Spill measured in a subject's rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spill {
    /// Dominant colour of the spill.
    pub screen: Screen,
    /// Luminance that the rim loses if all spill is removed, as a share of the rim's luminance.
    pub excess: f32,
}

impl Spill {
    /// Spill of a rim with this `light` and this excess of green and blue.
    pub(crate) fn new([green, blue]: [f64; 2], light: f64) -> Self {
        let (screen, excess) = if blue > green { (Screen::Blue, blue) } else { (Screen::Green, green) };
        let excess = if light > 0.0 { excess / light } else { 0.0 };
        Self { screen, excess: excess as f32 }
    }
}

impl Screen {
    /// Channel of this colour.
    pub fn channel(self) -> usize {
        match self {
            Self::Green => 1,
            Self::Blue => 2,
        }
    }
}

/// Brightness classes of grain, evenly spaced over the codes.
pub const BINS: usize = 8;

/// Deviation of the grain in codes, for each class of brightness and channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grain {
    pub deviation: [[f32; 3]; BINS],
}

impl Grain {
    /// The excess of this grain, times `amount`, over `own`: variances subtract.
    pub fn beyond(&self, own: &Self, amount: f32) -> Self {
        Self {
            deviation: std::array::from_fn(|bin| {
                std::array::from_fn(|c| {
                    let wanted = amount * self.deviation[bin][c];
                    let own = own.deviation[bin][c];
                    (wanted * wanted - own * own).max(0.0).sqrt()
                })
            }),
        }
    }

    /// The largest deviation.
    pub fn most(&self) -> f32 {
        self.deviation.iter().flatten().fold(0.0, |m, &d| m.max(d))
    }

    /// The deviation at a code, interpolated between the centres of the classes.
    pub(crate) fn at(&self, code: f32, channel: usize) -> f32 {
        let place = (code * BINS as f32 - 0.5).clamp(0.0, (BINS - 1) as f32);
        let low = (place as usize).min(BINS - 2);
        let [a, b] = [low, low + 1].map(|bin| self.deviation[bin][channel]);
        a + (place - low as f32) * (b - a)
    }
}

/// Hash of `parts`.
pub(crate) fn key(parts: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    parts.hash(&mut hasher);
    hasher.finish()
}
