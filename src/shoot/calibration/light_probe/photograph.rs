//! A photograph as linear light, with the uncertainty of each pixel.

use super::super::code_values::{CLIPPED, STEPS};
use imaging::{Encoded, Image, Raster, Response};
use light::Environment;

/// Full-well capacity of a small sensor's pixel in electrons. It scales the photon noise and only affects the
/// relative weights of a bracket's photographs.
const FULL_WELL: f32 = 20_000.0;

/// Linear light of a photograph.
#[derive(Clone, Debug)]
pub struct Photograph {
    /// Linear light; finite and not negative.
    pub light: Image,
    /// True for clipped channels: their light is at least the value in `light`.
    pub clipped: Raster<[bool; 3]>,
    /// Standard deviation of `light`, from quantisation and photon noise.
    pub(super) deviation: Image,
    /// Clipping level of the light; infinite without clipping.
    pub(super) white: f32,
    /// Number of repaired pixels: NaN, infinite or negative.
    pub repaired_pixels: usize,
}

impl Photograph {
    /// A photograph in the camera's encoding. The highest 8-bit code value counts as clipped, and light is
    /// uncertain by one code value.
    pub fn from_encoded(picture: &Encoded, response: &Response) -> Self {
        let white = f32::from(CLIPPED) / f32::from(STEPS);
        let step = |code: f32| {
            let (low, high) = ((code - 1.0 / 255.0).max(0.0), (code + 1.0 / 255.0).min(1.0));
            let rise = response.decode_value(high) - response.decode_value(low);
            rise / (255.0 * (high - low))
        };
        // Eight bits give 256 steps; finer pictures use the nearest step.
        let steps: Vec<f32> = (0..=255).map(|code| step(code as f32 / 255.0)).collect();
        let light = response.decode(picture);
        let deviation = Image {
            width: light.width,
            height: light.height,
            pixels: (light.pixels.iter().zip(&picture.0.pixels))
                .map(|(light, code)| {
                    std::array::from_fn(|c| {
                        let step = steps[(code[c] * 255.0 + 0.5) as usize & 255];
                        step.hypot((light[c] / FULL_WELL).sqrt())
                    })
                })
                .collect(),
        };
        Self {
            clipped: picture.0.map(|pixel| pixel.map(|v| v >= white)),
            light,
            deviation,
            white: 1.0,
            repaired_pixels: 0,
        }
    }

    /// Linear light from a raw converter or a renderer. `white` is the clipping level, if any; infinite values
    /// always count as clipped. NaN, infinite and negative values are repaired as in
    /// [`Environment::from_radiance`]. Light is uncertain by a step of twelve bits below `white`; without `white`,
    /// by the precision of half floats.
    pub fn from_linear(picture: Image, white: Option<f32>) -> Self {
        let white = white.filter(|w| *w > 0.0).unwrap_or(f32::INFINITY);
        let clipped = picture.map(|pixel| pixel.map(|v| v >= white || v == f32::INFINITY));
        let Environment { radiance: light, repaired_texels, .. } = Environment::from_radiance("", picture);
        let noise = |v: f32| {
            if white.is_finite() { (white / 4096.0).hypot((v * white / FULL_WELL).sqrt()) } else { v / 2048.0 }
        };
        Self { deviation: light.map(|pixel| pixel.map(noise)), light, clipped, white, repaired_pixels: repaired_texels }
    }

    /// Width and height.
    pub fn size(&self) -> (usize, usize) {
        self.light.size()
    }

    /// Number of pixels with a clipped channel, over the full photograph.
    pub fn clipped_pixels(&self) -> usize {
        self.clipped.pixels.iter().filter(|p| p.contains(&true)).count()
    }
}
