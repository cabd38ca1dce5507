//! Colour of a green or blue screen, measured at the picture's border.

use super::{linear, quantile, spread};
use base::error::{Error, Result};
use imaging::Encoded;
use imaging::color::srgb_from_linear;

/// Primary colour of a screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hue {
    Green,
    Blue,
}

/// A screen's colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// Primary colour.
    pub hue: Hue,
    /// Median colour, encoded as in the picture, in `[0, 1]`.
    pub color: [f32; 3],
    /// Share of the upper border that shows the screen, in `[0, 1]`.
    pub border: f32,
    /// Median light.
    pub(super) light: [f32; 3],
    /// Robust standard deviation of its pixels' chroma.
    pub(super) spread: f32,
}

/// Smallest share of the upper border that shows a screen.
const LEAST_BORDER: f32 = 0.25;
/// Smallest excess of a screen's primary over the other channels, relative to its light.
const LEAST_DIFFERENCE: f32 = 0.15;
/// Bins of each axis of the chroma histogram.
const BINS: usize = 48;

impl Hue {
    /// Excess of the primary over the other channels.
    pub(super) fn difference(self, [r, g, b]: [f32; 3]) -> f32 {
        match self {
            Self::Green => g - r.max(b),
            Self::Blue => b - r.max(g),
        }
    }

    /// Name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Green => "green",
            Self::Blue => "blue",
        }
    }
}

/// Shares of red and blue in a light, each in `[0, 1]`; black has none.
pub(super) fn chroma([r, g, b]: [f32; 3]) -> Option<[f32; 2]> {
    let sum = r + g + b;
    (sum > 1e-4).then(|| [r / sum, b / sum])
}

/// Distance of two chromas.
pub(super) fn apart(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Finds the colour of the screen behind the subject: the most frequent chroma at the upper and side borders, if it
/// is green or blue.
///
/// # Errors
/// When there is no such screen.
pub fn key(picture: &Encoded) -> Result<Key> {
    let light = linear(picture);
    let border = upper_border(picture.0.size());
    let colors: Vec<[f32; 3]> = border.iter().map(|&i| light[i]).collect();
    let chromas: Vec<[f32; 2]> = colors.iter().filter_map(|&c| chroma(c)).collect();
    let mode = mode(&chromas).ok_or_else(|| none("the picture's border is black"))?;
    // Pixels of the screen scatter around its colour by their noise, measured among those near the mode.
    let near = |limit: f32| {
        let close = move |c: &&[f32; 3]| chroma(**c).is_some_and(|c| apart(c, mode) < limit);
        colors.iter().filter(close).copied().collect::<Vec<_>>()
    };
    let screen = near(3.0 / BINS as f32);
    let median = |c: usize| quantile(screen.iter().map(|p| p[c]).collect(), 0.5).unwrap_or(0.0);
    let median = [median(0), median(1), median(2)];
    let share = screen.len() as f32 / colors.len() as f32;
    let hue = if median[1] >= median[2] { Hue::Green } else { Hue::Blue };
    let sum: f32 = median.iter().sum();
    if hue.difference(median) < LEAST_DIFFERENCE * sum {
        let [r, g, b] = median.map(|v| (255.0 * srgb_from_linear(v)).round());
        return Err(none(&format!(
            "the most frequent colour at its border, {r} {g} {b} of 255, is neither green nor blue"
        )));
    }
    if share < LEAST_BORDER {
        return Err(none(&format!("only {:.0} % of its upper border is {}", 100.0 * share, hue.name())));
    }
    let center = chroma(median).unwrap_or(mode);
    let distances = screen.iter().filter_map(|&c| chroma(c));
    Ok(Key {
        hue,
        color: median.map(srgb_from_linear),
        border: share,
        light: median,
        spread: spread(distances.map(|c| apart(c, center)), 0.0),
    })
}

fn none(why: &str) -> Error {
    Error::missing(
        format!("the picture shows no green or blue screen: {why}"),
        (
            "Give a box around the person or a clean plate, paint what to keep and to remove (Footage, Paint matte), add \
             your own mattes beside the pictures, as grey PNGs of their size, or film before a green or blue screen \
             that reaches the upper corners",
            "afterlight matte PROJECT --box or --clean-plate",
        ),
    )
}

/// Pixels along the top and the upper two thirds of both sides, a fiftieth of the picture deep.
pub fn upper_border((width, height): (usize, usize)) -> Vec<usize> {
    let deep = (width.min(height) / 50).max(1);
    let places = (0..height * 2 / 3 + 1).flat_map(|y| (0..width).map(move |x| (x, y)));
    places
        .filter(|&(x, y)| y < height && (y < deep || x < deep || x + deep >= width))
        .map(|(x, y)| y * width + x)
        .collect()
}

/// Centre of the histogram's maximum, smoothed over 3 × 3 bins.
fn mode(chromas: &[[f32; 2]]) -> Option<[f32; 2]> {
    let bin = |v: f32| ((v * BINS as f32) as usize).min(BINS - 1);
    let mut counts = vec![0_usize; BINS * BINS];
    for &[r, b] in chromas {
        counts[bin(b) * BINS + bin(r)] += 1;
    }
    let smooth = |x: usize, y: usize| -> usize {
        let rows = y.saturating_sub(1)..(y + 2).min(BINS);
        rows.map(|y| counts[y * BINS..][x.saturating_sub(1)..(x + 2).min(BINS)].iter().sum::<usize>()).sum()
    };
    let places = (0..BINS * BINS).map(|i| (i % BINS, i / BINS));
    let (x, y) = places.max_by_key(|&(x, y)| (smooth(x, y), counts[y * BINS + x]))?;
    let inside = |v: f32, at: usize| bin(v).abs_diff(at) <= 1;
    let near: Vec<_> = (chromas.iter()).filter(|c| inside(c[0], x) && inside(c[1], y)).collect();
    let mean = |c: usize| near.iter().map(|v| v[c]).sum::<f32>() / near.len() as f32;
    (!near.is_empty()).then(|| [mean(0), mean(1)])
}
