//! Pass `dither`: a pattern below one code prevents banding in smooth gradients.

use super::descriptor::{CodesStep, Descriptor, Run, needs_display};
use super::passes::{GpuPicture, Recording, Shader};
use base::error::Result;
use imaging::{Encoded, Mask};
use scene::Pass;

const SHADER: Shader = Shader::new("dither", include_str!("../../../shaders/dither.wgsl"));

pub(crate) const DITHER: Descriptor = Descriptor {
    fixed: needs_display,
    settings: |context| context.facts.inputs.frame,
    shader: Some(&SHADER),
    run: Run::Codes(CodesStep {
        in_memory: |_, input, codes| {
            dither(codes, input.mask);
            Ok(())
        },
        on_gpu: |_, _, recording, codes, matte| recording.dither(codes, matte),
    }),
    ..Descriptor::new(Pass::Dither, |context| {
        context.displayed()?;
        context.behind()?;
        Ok("8 bits would show banding in a smooth background".to_owned())
    })
};

/// Moves each code by less than half a step of 8 bits, by a fixed pattern (interleaved gradient noise, Jimenez,
/// SIGGRAPH 2014) that is the same in every frame, so that a film does not boil. Only the background
/// is dithered: the subject has enough grain of its own.
pub fn dither(picture: &mut Encoded, mask: &Mask) {
    let width = picture.0.width;
    for (i, (pixel, &alpha)) in picture.0.pixels.iter_mut().zip(&mask.pixels).enumerate() {
        let (x, y) = ((i % width) as f32, (i / width) as f32);
        let noise = (52.982_918 * (0.067_110_56 * x + 0.005_837_15 * y).fract()).fract() - 0.5;
        let step = noise * (1.0 - alpha) / 255.0;
        *pixel = pixel.map(|v| (v + step).clamp(0.0, 1.0));
    }
}

impl Recording<'_> {
    /// [`dither`] on the GPU: the fourth value of `matte` is the subject's matte.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn dither(&mut self, codes: &GpuPicture, matte: &GpuPicture) -> Result<GpuPicture> {
        self.plain((&SHADER, "dither"), [0; 2], codes, Some(matte))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Image;

    #[test]
    fn dither_moves_no_code_by_half_a_step_and_keeps_the_mean() {
        let flat = Encoded(Image::filled(64, 64, [0.4; 3]));
        let mut moved = flat.clone();
        dither(&mut moved, &Mask::filled(64, 64, 0.0));
        let steps: Vec<f32> = moved.0.pixels.iter().map(|p| (p[0] - 0.4) * 255.0).collect();
        assert!(steps.iter().all(|s| s.abs() < 0.501));
        assert!((steps.iter().sum::<f32>() / 4096.0).abs() < 0.01);
        let mut kept = flat.clone();
        dither(&mut kept, &Mask::filled(64, 64, 1.0));
        assert_eq!(kept, flat);
    }
}
