//! Pass `smoothing`: the network sees each frame alone, so the subject's brightness may flicker. One gain
//! for each channel of a frame holds it steady.
//!
//! The flicker is measured independently of the light: both frames under all lamps alike, by the
//! median of the ratios of pixels that the subject covers in both, which a moving hand does not change.
//! With x the logarithm of that level, the shown one is y = (1 − s)·x + s·(y before), an exponential
//! mean. The gain multiplies the lamps' weights: the pass costs no picture, and has no shader.

use super::descriptor::{Descriptor, decide};
use super::edges::SOLID;
use super::facts::key;
use base::error::Result;
use imaging::Mask;
use scene::Pass;

pub(crate) const SMOOTHING: Descriptor = Descriptor {
    settings: |context| key(context.facts.steady_gain.map(|gain| gain.map(f32::to_bits))),
    ..Descriptor::new(Pass::Smoothing, |context| {
        context.asked(Pass::Smoothing)?;
        let change = change(context.facts.steady_gain.unwrap_or([1.0; 3]));
        decide(
            change > UNSEEN,
            || {
                let percent = 100.0 * change;
                format!("the brightness jumped; the light is corrected by {percent:.1} %")
            },
            "the brightness flickers by less than 0.1 %",
        )
    })
};

/// Pixels that are compared, at most.
const SAMPLES: usize = 16_384;

/// A change of level beyond this factor, either way, is a cut or a new pose and is not held back; nor is more than this of
/// changes that add up.
const CUT: f32 = 1.25;

/// Gains nearer to 1 than this change no value by a third of a step of 8 bits.
pub const UNSEEN: f32 = 0.001;

/// Data that one frame hands on to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Steady {
    /// The frame that this was made from.
    pub frame: usize,
    /// Factors on its light, per channel.
    pub gain: [f32; 3],
    /// The subject under even light at the pixels that are compared; NaN if it does not cover them.
    samples: Vec<[f32; 3]>,
}

impl Steady {
    /// Compares a frame with `before`, and holds back `share` (`[0, 1]`) of a jump. `before` counts if it
    /// is the frame before this one and of its size; the same frame again keeps its gain. `even` gives
    /// the samples of the frame under even light.
    ///
    /// # Errors
    /// When `even` does.
    pub fn after(
        before: Option<&Self>,
        frame: usize,
        share: f32,
        even: impl FnOnce() -> Result<Vec<[f32; 3]>>,
    ) -> Result<Self> {
        if let Some(same) = before.filter(|before| before.frame == frame) {
            return Ok(same.clone());
        }
        let samples = even()?;
        let before = before.filter(|b| b.frame + 1 == frame && b.samples.len() == samples.len());
        let gain = before.map_or([1.0; 3], |before| {
            std::array::from_fn(|c| {
                let ratio = median_ratio(&before.samples, &samples, c);
                if ratio.max(1.0 / ratio) <= CUT {
                    (before.gain[c] / ratio).powf(share).clamp(1.0 / CUT, CUT)
                } else {
                    1.0
                }
            })
        });
        Ok(Self { frame, gain, samples })
    }

    /// The largest change that the gain makes, as a share of the light.
    pub fn change(&self) -> f32 {
        change(self.gain)
    }
}

fn change(gain: [f32; 3]) -> f32 {
    let changes = gain.map(|gain| (gain - 1.0).abs());
    changes.into_iter().fold(0.0, f32::max)
}

/// Weights of all lamps alike.
pub fn even_light(lamps: usize) -> Vec<[f32; 3]> {
    vec![[1.0 / lamps.max(1) as f32; 3]; lamps]
}

/// The step between the pixels that are compared, among `pixels`.
pub(super) fn step(pixels: usize) -> usize {
    // An odd step is no divisor of a width that is a power of two: samples are not one column.
    pixels.div_ceil(SAMPLES).max(1) | 1
}

/// Pixels of a subject that are compared: every so many pixels one, NaN if it is not solid. `even` has every
/// [`step`]-th pixel, in order.
pub(super) fn samples(even: impl Iterator<Item = [f32; 3]>, mask: &Mask) -> Vec<[f32; 3]> {
    let alphas = mask.pixels.iter().step_by(step(mask.pixels.len()));
    let solid = |(pixel, &alpha)| if alpha >= SOLID { pixel } else { [f32::NAN; 3] };
    even.zip(alphas).map(solid).collect()
}

/// The median of now / before over pixels that are light in both; 1 if there are none.
fn median_ratio(before: &[[f32; 3]], now: &[[f32; 3]], channel: usize) -> f32 {
    let pairs = before.iter().zip(now);
    let mut ratios: Vec<f32> = pairs
        .map(|(before, now)| now[channel] / before[channel])
        .filter(|ratio| ratio.is_finite() && *ratio > 0.0)
        .collect();
    if ratios.is_empty() {
        return 1.0;
    }
    let middle = ratios.len() / 2;
    *ratios.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
#[path = "smoothing_tests.rs"]
pub(super) mod tests;
