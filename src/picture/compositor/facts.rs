//! Facts that passes are decided by: what was made before, and what was measured of the picture so far.

use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};

/// Facts that the plan needs besides the scene. What decides about an effect is measured only if the scene asks for the
/// effect; else it stays at its default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Facts {
    /// The reflectance field of the scene's frame was cached.
    pub field_cached: bool,
    /// The weights of the scene's environment and yaw were cached.
    pub weights_cached: bool,
    /// Lamps of the rig.
    pub lamps: usize,
    /// Lamps whose weight is not zero.
    pub lit_lamps: usize,
    /// Columns and rows of the plate that the light is brought to; None if the picture has the working size.
    pub plate: Option<(usize, usize)>,
    /// The plate has light finer than the working size.
    pub fine_light: bool,
    /// Share in `[0, 1]` of pixels that the subject does not cover wholly.
    pub open_share: f32,
    /// Ingredients of the picture, as numbers.
    pub inputs: Inputs,
    /// The gain that would hold this frame's brightness steady; None if it was not measured.
    pub steady_gain: Option<[f32; 3]>,
    /// The spill in the relit subject's rim; None if it was not measured.
    pub spill: Option<Spill>,
    /// Light that wrapping wholly would add to the rim, as a share of the rim's light.
    pub wrap_need: f32,
    /// The largest linear value before exposure.
    pub brightest: f32,
    /// The picture's own grain.
    pub own_grain: Grain,
    /// The largest deviation of the plate's grain beyond the picture's own, in codes.
    pub missing_grain: f32,
    /// There is a second picture to compare with.
    pub second_picture: bool,
}

/// Numbers that stand for what the passes read: equal numbers stand for equal things.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Inputs {
    /// The frame: its field, its matte and its plate.
    pub frame: u64,
    /// The lamps' weights and the subject's level.
    pub light: u64,
    /// The panorama, its level and the camera that sees it.
    pub backdrop: u64,
    /// The plate's grain.
    pub grain: u64,
    /// The second picture.
    pub second: u64,
}

/// A screen's colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Screen {
    Green,
    Blue,
}

/// Spill as it was measured in a subject's rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spill {
    /// The colour of which there is more.
    pub screen: Screen,
    /// Luminance that the rim loses if all spill is taken out, as a share of the rim's luminance.
    pub excess: f32,
}

impl Spill {
    /// The spill of a rim that has this `light` and this much of it, green and blue, in excess.
    pub(crate) fn of([green, blue]: [f64; 2], light: f64) -> Self {
        let (screen, excess) =
            if blue > green { (Screen::Blue, blue) } else { (Screen::Green, green) };
        let excess = if light > 0.0 { excess / light } else { 0.0 };
        Self { screen, excess: excess as f32 }
    }
}

impl Screen {
    /// The channel of this colour.
    pub fn channel(self) -> usize {
        match self {
            Self::Green => 1,
            Self::Blue => 2,
        }
    }
}

/// Classes of brightness that grain is measured in, evenly over the codes.
pub const BINS: usize = 8;

/// Deviation of the grain in codes, for each class of brightness and channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grain {
    pub deviation: [[f32; 3]; BINS],
}

impl Grain {
    /// The grain that `self`, times `amount`, has more than `own`: variances subtract.
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

    /// The deviation at a code, interpolated between the middles of the classes.
    pub(crate) fn at(&self, code: f32, channel: usize) -> f32 {
        let place = (code * BINS as f32 - 0.5).clamp(0.0, (BINS - 1) as f32);
        let low = (place as usize).min(BINS - 2);
        let [a, b] = [low, low + 1].map(|bin| self.deviation[bin][channel]);
        a + (place - low as f32) * (b - a)
    }
}

/// A number that stands for `parts`.
pub(crate) fn key(parts: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    parts.hash(&mut hasher);
    hasher.finish()
}
