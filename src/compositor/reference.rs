//! The passes on the CPU, and what the shaders are tested against.

pub use super::edges::{SOLID, extend_edges};
pub use super::relight::{lit_lamps, relight, relight_compressed, relight_half};

use imaging::{Encoded, Image, Mask, Raster, color::srgb_from_linear};
use rayon::prelude::*;

/// Scales every value.
pub fn scale(picture: &mut Image, factor: f32) {
    picture
        .pixels
        .iter_mut()
        .flatten()
        .for_each(|v| *v *= factor);
}

/// Pass `view`: sRGB codes of linear light, clipped to `[0, 1]`.
pub fn view(linear: &Image) -> Encoded {
    let pixels = linear
        .pixels
        .par_iter()
        .with_min_len(4096)
        .map(|p| p.map(srgb_from_linear))
        .collect();
    Encoded(Raster {
        width: linear.width,
        height: linear.height,
        pixels,
    })
}

/// Pass `dither`: moves each code by less than half a step of 8 bits, by a fixed pattern (interleaved
/// gradient noise, Jimenez, SIGGRAPH 2014) that is the same in every frame, so that a film does not
/// boil. Only what shows through the matte is moved: the subject has grain enough of its own.
pub fn dither(picture: &mut Encoded, mask: &Mask) {
    let width = picture.0.width;
    for (i, (pixel, &alpha)) in picture.0.pixels.iter_mut().zip(&mask.pixels).enumerate() {
        let (x, y) = ((i % width) as f32, (i / width) as f32);
        let noise = (52.982_918 * (0.067_110_56 * x + 0.005_837_15 * y).fract()).fract() - 0.5;
        let step = noise * (1.0 - alpha) / 255.0;
        *pixel = pixel.map(|v| (v + step).clamp(0.0, 1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dither_moves_no_code_by_half_a_step_and_keeps_the_mean() {
        let flat = Encoded(Image::filled(64, 64, [0.4; 3]));
        let mut moved = flat.clone();
        dither(&mut moved, &Mask::filled(64, 64, 0.0));
        let steps: Vec<f32> = moved
            .0
            .pixels
            .iter()
            .map(|p| (p[0] - 0.4) * 255.0)
            .collect();
        assert!(steps.iter().all(|s| s.abs() < 0.501));
        assert!((steps.iter().sum::<f32>() / 4096.0).abs() < 0.01);
        let mut kept = flat.clone();
        dither(&mut kept, &Mask::filled(64, 64, 1.0));
        assert_eq!(kept, flat);
    }
}
