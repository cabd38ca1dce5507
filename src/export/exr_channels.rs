//! Half-float channels of an EXR.

use exr::prelude::{AnyChannel, FlatSamples, f16};
use imaging::Image;

/// A half float, clipped to ±65504.
pub fn half(value: f32) -> f16 {
    f16::from_f32(value.clamp(-65504.0, 65504.0))
}

/// Channels R, G and B whose names begin with `prefix`. Values beyond half floats are clipped to ±65504.
pub fn color_channels(prefix: &str, picture: &Image) -> [AnyChannel<FlatSamples>; 3] {
    [0, 1, 2].map(|c| {
        let name = format!("{prefix}{}", ["R", "G", "B"][c]);
        let values = picture.pixels.iter().map(|pixel| half(pixel[c]));
        AnyChannel::new(name.as_str(), FlatSamples::F16(values.collect()))
    })
}
