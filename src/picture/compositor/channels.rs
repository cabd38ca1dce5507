//! Pass `channels`: one channel of the display codes in grey, or the coverage.

use super::curve::Curve;
use super::descriptor::{CodesStep, Descriptor, NOT_ASKED, Run, inspected};
use super::passes::{GpuPicture, Recording, Shader};
use base::error::Result;
use imaging::color::{linear_from_srgb, luminance, srgb_from_linear};
use imaging::{Encoded, Mask};
use rayon::prelude::*;
use scene::{Channel, Inspection, Pass};
use std::sync::LazyLock;

const SHADER: Shader = Shader::new("channels", include_str!("../../../shaders/channels.wgsl"));

pub(crate) const CHANNELS: Descriptor = Descriptor {
    fixed: |_| Some("it is chosen above the picture"),
    settings: inspected,
    shader: Some(&SHADER),
    run: Run::Codes(CodesStep {
        in_memory: |context, input, codes| {
            if let Inspection::Channel(channel) = context.effects.inspection {
                channels(codes, input.alpha, channel);
            }
            Ok(())
        },
        on_gpu: |context, _, recording, codes, _| match context.effects.inspection {
            Inspection::Channel(channel) => recording.channels(codes, channel),
            _ => Ok(codes.clone()),
        },
    }),
    ..Descriptor::new(Pass::Channels, |context| {
        context.displayed()?;
        match context.effects.inspection {
            Inspection::Channel(channel) => {
                let channel = format!("{channel:?}").to_lowercase();
                Ok(format!("the {channel} channel is shown"))
            }
            _ => Err(NOT_ASKED.to_owned()),
        }
    })
};

static LIGHT: LazyLock<Curve> = LazyLock::new(|| Curve::new(linear_from_srgb));
static CODE: LazyLock<Curve> = LazyLock::new(|| Curve::new(srgb_from_linear));

/// Replaces codes by the grey of one channel. Luminance is computed in linear light. `alpha` has the
/// picture's size.
pub fn channels(codes: &mut Encoded, alpha: &Mask, channel: Channel) {
    let pixels = codes.0.pixels.par_iter_mut().zip(&alpha.pixels);
    pixels.with_min_len(4096).for_each(|(pixel, &alpha)| {
        let grey = match channel {
            Channel::Red => pixel[0],
            Channel::Green => pixel[1],
            Channel::Blue => pixel[2],
            Channel::Luminance => CODE.at(luminance(pixel.map(|v| LIGHT.at(v)))),
            Channel::Alpha => alpha,
        };
        *pixel = [grey; 3];
    });
}

impl Recording<'_> {
    /// [`channels`] on the GPU: the fourth value of `codes` is the picture's coverage.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn channels(&mut self, codes: &GpuPicture, channel: Channel) -> Result<GpuPicture> {
        let channel = match channel {
            Channel::Red => 0,
            Channel::Green => 1,
            Channel::Blue => 2,
            Channel::Luminance => 3,
            Channel::Alpha => 4,
        };
        self.plain((&SHADER, "channels"), [channel, 0], codes, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Image;

    #[test]
    fn a_channel_is_shown_in_grey() {
        let alpha = Mask::filled(2, 1, 0.25);
        let shown = |channel| {
            let mut codes = Encoded(Image::filled(2, 1, [0.9, 0.5, 0.1]));
            channels(&mut codes, &alpha, channel);
            codes.0.pixels[1]
        };
        assert_eq!(shown(Channel::Red), [0.9; 3]);
        assert_eq!(shown(Channel::Green), [0.5; 3]);
        assert_eq!(shown(Channel::Blue), [0.1; 3]);
        assert_eq!(shown(Channel::Alpha), [0.25; 3]);
        let grey = shown(Channel::Luminance);
        let light = luminance([0.9, 0.5, 0.1].map(linear_from_srgb));
        assert!((linear_from_srgb(grey[0]) - light).abs() < 1e-5);
    }

    #[test]
    fn a_grey_has_its_own_luminance() {
        for code in [0.0, 0.02, 0.5, 1.0] {
            let mut codes = Encoded(Image::filled(1, 1, [code; 3]));
            channels(&mut codes, &Mask::filled(1, 1, 1.0), Channel::Luminance);
            assert!((codes.0.pixels[0][0] - code).abs() < 1e-5);
        }
    }
}
