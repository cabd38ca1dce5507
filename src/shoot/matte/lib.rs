//! Mattes: coverage of each pixel by the subject, from a picture before a green or blue screen or a dark
//! background. [`grab_cut`] separates a subject from its background by colours and edges, starting from marks.

mod boxed;
mod brushed;
mod clean_plate;
mod cut;
mod flow;
mod flow_network;
mod grab_cut;
mod guessed;
mod key;
mod lit;
mod mixture;
mod parts;
mod refine;
mod screen;
mod seeds;
mod steady;
#[cfg(test)]
mod tests;
mod window;

pub use boxed::boxed;
pub use brushed::{Correction, corrected, followed, painted};
pub use clean_plate::by_clean_plate;
pub use flow::{Flow, flow_picture};
pub use grab_cut::{GrabCut, Mark, grab_cut, rectangle};
pub use guessed::guessed;
pub use lit::lit;
pub use parts::{around, parts};
pub use screen::{Hue, Key, key};
pub use seeds::{Seeds, Side};
pub use steady::{Neighbour, flicker, steadied};

use imaging::color::linear_from_srgb;
use imaging::{Encoded, Mask};
use rayon::prelude::*;

/// A matte with its uncertain share.
#[derive(Clone, Debug, PartialEq)]
pub struct Matte {
    /// Coverage of the subject in `[0, 1]`, at the picture's size.
    pub mask: Mask,
    /// Share of all pixels, in `[0, 1]`, with coverage inferred from their surroundings: edges and hair.
    pub uncertain: f32,
}

/// Light of encoded values. The camera's own curve is unknown when mattes are made, so sRGB is used. A half-covered
/// pixel is off by the difference of the two curves.
fn linear(picture: &Encoded) -> Vec<[f32; 3]> {
    let pixels = picture.0.pixels.par_iter();
    pixels.map(|p| p.map(linear_from_srgb)).collect()
}

/// The `share` quantile of some values, 0 to 1; None without values.
pub fn quantile(mut values: Vec<f32>, share: f32) -> Option<f32> {
    let last = values.len().checked_sub(1)?;
    let at = (share * last as f32).round() as usize;
    Some(*values.select_nth_unstable_by(at.min(last), f32::total_cmp).1)
}

/// Robust standard deviation: 1.4826 times the median distance to `center` (Rousseeuw and Croux 1993); 0 without
/// values.
fn spread(values: impl Iterator<Item = f32>, center: f32) -> f32 {
    let distances = values.map(|v| (v - center).abs()).collect();
    1.4826 * quantile(distances, 0.5).unwrap_or(0.0)
}

/// Threshold between two classes of values with the largest separation of their means (Otsu 1979), and the
/// explained share of the variance, in `[0, 1]`. None if all values are equal.
fn otsu(values: &[f32], (low, high): (f32, f32)) -> Option<(f32, f32)> {
    const BINS: usize = 256;
    let width = (high - low) / BINS as f32;
    let mut counts = [0.0_f64; BINS];
    for v in values {
        counts[(((v - low) / width) as usize).min(BINS - 1)] += 1.0;
    }
    let sum = |value: &dyn Fn(usize) -> f64| (0..BINS).map(|i| counts[i] * value(i)).sum::<f64>();
    let (all, mean) = (sum(&|_| 1.0), sum(&|i| i as f64));
    let mean = mean / all;
    let variance = sum(&|i| (i as f64 - mean).powi(2));
    let (mut below, mut moment, mut best) = (0.0, 0.0, (0.0, 0.0, 0.0));
    for (i, count) in counts.iter().enumerate().take(BINS - 1) {
        below += count;
        moment += count * i as f64;
        let between = (mean * below - moment).powi(2) / (below * (all - below) / all);
        // Over an empty valley all thresholds are equally good; the middle one is used.
        if between > best.0 * (1.0 + 1e-9) {
            best = (between, i as f64, i as f64);
        } else if between >= best.0 * (1.0 - 1e-9) {
            best.2 = i as f64;
        }
    }
    let middle = (best.1 + best.2) / 2.0 + 1.0;
    (variance > 0.0 && best.0 > 0.0).then(|| (low + middle as f32 * width, (best.0 / variance) as f32))
}
