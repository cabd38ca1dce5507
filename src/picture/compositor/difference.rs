//! Pass `difference`: distance of the codes from a second picture.

use super::descriptor::{CodesInput, CodesStep, Descriptor, NOT_ASKED, PassContext, Run};
use super::descriptor::{decide, inspected, key_in};
use super::facts::key;
use super::passes::{GpuPicture, Recording, Shader};
use base::error::{Error, Result};
use imaging::{Encoded, color::unit};
use rayon::prelude::*;
use scene::{Inspection, Pass};

const SHADER: Shader = Shader::new("difference", include_str!("../../../shaders/difference.wgsl"));

pub(crate) const DIFFERENCE: Descriptor = Descriptor {
    fixed: |_| Some("it needs a second picture: it is chosen under Compare"),
    settings: inspected,
    reads: |context, planned| key((key_in(planned, Pass::Channels), context.facts.inputs.second)),
    shader: Some(&SHADER),
    run: Run::Codes(CodesStep {
        in_memory: |context, input, codes| match compared(context, input) {
            Some((second, gain)) => difference(codes, second, gain),
            None => Ok(()),
        },
        on_gpu: |context, input, recording, codes, _| match compared(context, input) {
            Some((second, gain)) => recording.difference(codes, second, gain),
            None => Ok(codes.clone()),
        },
    }),
    ..Descriptor::new(Pass::Difference, |context| {
        context.displayed()?;
        let Inspection::Difference { gain } = context.effects.inspection else { return Err(NOT_ASKED.to_owned()) };
        decide(
            context.facts.second_picture,
            || format!("the difference of two pictures is shown, times {gain}"),
            "there is no second picture",
        )
    })
};

/// Second picture and gain; None if the scene shows no difference, or there is no second picture.
fn compared<'a>(context: &PassContext, input: &CodesInput<'a>) -> Option<(&'a Encoded, f32)> {
    match context.effects.inspection {
        Inspection::Difference { gain } => Some((input.second?, gain)),
        _ => None,
    }
}

/// Replaces codes by the magnitude of their difference to `second`, times `gain`, up to 1. A gain that
/// is NaN shows black.
///
/// # Errors
/// When the pictures differ in size.
pub fn difference(codes: &mut Encoded, second: &Encoded, gain: f32) -> Result<()> {
    check_size(codes.0.size(), second)?;
    let pairs = codes.0.pixels.par_iter_mut().zip(&second.0.pixels);
    pairs.with_min_len(4096).for_each(|(pixel, other)| {
        *pixel = std::array::from_fn(|c| unit(gain * (pixel[c] - other[c]).abs()));
    });
    Ok(())
}

impl Recording<'_> {
    /// [`difference`] on the GPU, to a picture in memory.
    ///
    /// # Errors
    /// As [`difference`], or when the GPU cannot hold its pictures.
    pub fn difference(&mut self, codes: &GpuPicture, second: &Encoded, gain: f32) -> Result<GpuPicture> {
        check_size(codes.size(), second)?;
        let second = self.passes().upload_opaque(&second.0)?;
        let values = [gain.to_bits(), 0];
        self.plain((&SHADER, "difference"), values, codes, Some(&second))
    }
}

/// Refuses a second picture of a different size.
fn check_size((width, height): (usize, usize), second: &Encoded) -> Result<()> {
    let found = second.0.size();
    if (width, height) == found {
        return Ok(());
    }
    Err(Error::invalid(
        format!("the second picture has {} × {} pixels, but the first has {width} × {height}", found.0, found.1),
        "Compare pictures of equal size",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Image;

    #[test]
    fn equal_pictures_are_black_and_either_sign_is_bright() {
        let shown = |a: f32, b: f32, gain: f32| {
            let mut codes = Encoded(Image::filled(3, 2, [a; 3]));
            let second = Encoded(Image::filled(3, 2, [b; 3]));
            difference(&mut codes, &second, gain).unwrap();
            codes.0.pixels[5][2]
        };
        assert_eq!(shown(0.3, 0.3, 100.0), 0.0);
        assert_eq!(shown(0.5, 0.25, 2.0), 0.5);
        assert_eq!(shown(0.25, 0.5, 2.0), 0.5);
        assert_eq!(shown(0.0, 1.0, 1e6), 1.0);
        assert_eq!(shown(0.0, 1.0, f32::NAN), 0.0);
        assert_eq!(shown(f32::NAN, 1.0, 1.0), 0.0);
    }

    #[test]
    fn pictures_of_two_sizes_are_refused() {
        let mut codes = Encoded(Image::filled(3, 2, [0.0; 3]));
        let second = Encoded(Image::filled(2, 3, [0.0; 3]));
        let error = difference(&mut codes, &second, 1.0).unwrap_err();
        assert!(error.to_string().contains("3 × 2"), "{error}");
    }
}
