//! Channels of an EXR and their data window.

use super::exr_settings::Samples;
use exr::prelude::{AnyChannel, FlatSamples, f16};
use half::slice::HalfFloatSliceExt;
use imaging::{Image, Mask, Raster};

/// A value within the range of half floats.
fn clipped(value: f32) -> f32 {
    value.clamp(-65504.0, 65504.0)
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
}

impl Window {
    /// All of a picture.
    pub fn whole((width, height): (usize, usize)) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Smallest rectangle with all non-zero pixels; one pixel if all are 0.
    pub fn around(light: &Image, alpha: &Mask) -> Self {
        let is_full = |i: usize| alpha.pixels[i] != 0.0 || light.pixels[i] != [0.0; 3];
        let (mut left, mut top) = alpha.size();
        let (mut right, mut bottom) = (0, 0);
        for i in (0..alpha.pixels.len()).filter(|&i| is_full(i)) {
            let (x, y) = (i % alpha.width, i / alpha.width);
            (left, right) = (left.min(x), right.max(x + 1));
            (top, bottom) = (top.min(y), bottom.max(y + 1));
        }
        if right == 0 {
            return Self::whole((1, 1));
        }
        Self { x: left, y: top, width: right - left, height: bottom - top }
    }

    /// A raster's values within it, row by row.
    pub fn values<T: Copy, V>(self, raster: &Raster<T>, value: impl Fn(T) -> V) -> Vec<V> {
        let mut values = Vec::with_capacity(self.width * self.height);
        for y in self.y..self.y + self.height {
            let row = &raster.pixels[y * raster.width + self.x..][..self.width];
            values.extend(row.iter().map(|&pixel| value(pixel)));
        }
        values
    }
}

/// Channel of a raster's values within a window. Half floats are clipped to ±65504.
pub fn channel<T: Copy>(
    name: &str,
    raster: &Raster<T>,
    window: Window,
    samples: Samples,
    value: impl Fn(T) -> f32,
) -> AnyChannel<FlatSamples> {
    let samples = match samples {
        Samples::Half => {
            let values = window.values(raster, |pixel| clipped(value(pixel)));
            let mut halves = vec![f16::ZERO; values.len()];
            halves.convert_from_f32_slice(&values);
            FlatSamples::F16(halves)
        }
        Samples::Float => FlatSamples::F32(window.values(raster, value)),
    };
    AnyChannel::new(name, samples)
}

/// Channels R, G and B whose names begin with `prefix`.
pub fn color_channels(prefix: &str, picture: &Image, window: Window, samples: Samples) -> [AnyChannel<FlatSamples>; 3] {
    [0, 1, 2].map(|c| {
        let name = format!("{prefix}{}", ["R", "G", "B"][c]);
        channel(&name, picture, window, samples, |pixel| pixel[c])
    })
}
