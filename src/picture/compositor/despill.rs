//! Pass `despill`: removes the green or blue that a coloured screen casts onto the subject's rim.
//! A pixel's green is limited to a share of the mean of its red and blue (the "average" rule of keyers,
//! after Vlahos, US patent 4 100 569). That share is the natural ratio a little further inside the
//! subject: skin loses all of its spill, while green light and green clothes do not count as
//! spill.

use super::background_blur::defocused;
use super::descriptor::{Descriptor, key_in};
use super::facts::{Screen, Spill, key};
use super::passes::{GpuPicture, Recording, Shader};
use super::pyramid::{Rgba, rgba};
use base::error::Result;
use imaging::{Image, Mask, color::luminance};
use rayon::prelude::*;
use scene::Pass;

const SHADER: Shader = Shader::new("despill", include_str!("../../../shaders/despill.wgsl"));

pub(crate) const DESPILL: Descriptor = Descriptor {
    settings: |context| {
        let screen = context.facts.spill.map(|spill| spill.screen);
        key((context.effects.despill.to_bits(), screen))
    },
    reads: |_, planned| key_in(planned, Pass::Plate),
    shader: Some(&SHADER),
    ..Descriptor::new(Pass::Despill, |context| {
        context.asked(Pass::Despill)?;
        match context.facts.spill {
            Some(Spill { screen, excess }) if excess > LEAST_SPILL => Ok(format!(
                "{:.1} % of the rim's light is {} spill",
                100.0 * excess,
                ["green", "blue"][screen.channel() - 1]
            )),
            _ => Err("the rim is neither greener nor bluer than the inside".to_owned()),
        }
    })
};

/// Spill below this share of the rim's luminance is ignored.
const LEAST_SPILL: f32 = 0.005;

/// Reach of spill inwards from the matte's edge, as a share of the picture's height.
const REACH: f32 = 1.0 / 48.0;

/// Distance inside at which the natural colour is sampled, in units of that reach.
const INSIDE: f32 = 3.0;

/// Natural variation of colours.
const TOLERANCE: f32 = 1.05;

fn reach(height: usize) -> f32 {
    (REACH * height as f32).max(1.0)
}

/// Degree to which each pixel belongs to the matte's rim, `[0, 1]`: 1 along its edge, 0 far inside and outside.
pub fn rim(mask: &Mask) -> Mask {
    let (width, height) = mask.size();
    let open = mask.pixels.iter().map(|a| [1.0 - a, 0.0, 0.0, 0.0]);
    let open = Rgba { width, height, pixels: open.collect() };
    let open = defocused(open, reach(height)).pixels;
    let inside = open.iter().zip(&mask.pixels);
    // Along a straight edge half of the disc is open; nearly all of the reach counts fully.
    let weight = |(open, &alpha): (&[f32; 4], &f32)| {
        if alpha > 0.0 { (6.0 * open[0]).min(1.0) } else { 0.0 }
    };
    Mask { width, height, pixels: inside.map(weight).collect() }
}

/// Guide of the pass at every pixel of a premultiplied subject: degree of belonging to the rim, and the natural maxima of
/// green and blue over the mean of the other two. The maxima are 1 where no subject lies further inside.
pub fn guide(subject: &Image, mask: &Mask, rim: &Mask) -> Image {
    let inner = rgba(subject, |i, [r, g, b]| {
        // Without the rim: its colour is in doubt.
        let inside = if rim.pixels[i] > 0.0 { 0.0 } else { mask.pixels[i] };
        [inside * r, inside * g, inside * b, inside]
    });
    let inner = defocused(inner, INSIDE * reach(mask.height));
    let pixels = inner.pixels.iter().zip(&rim.pixels);
    let natural = |[r, g, b, inside]: [f32; 4], channel: usize| {
        let ratio = [r, g, b][channel] / mean_of_others([r, g, b], channel);
        // Too few samples: less than a hundredth of the disc.
        if inside > 0.01 && ratio.is_finite() { TOLERANCE * ratio } else { 1.0 }
    };
    Image {
        width: mask.width,
        height: mask.height,
        pixels: pixels.map(|(&inner, &rim)| [rim, natural(inner, 1), natural(inner, 2)]).collect(),
    }
}

/// Measures the spill of a subject under its [`guide`].
pub fn spill(subject: &Image, guide: &Image) -> Spill {
    let (mut excess, mut light) = ([0f64; 2], 0f64);
    for (pixel, guide) in subject.pixels.iter().zip(&guide.pixels) {
        if guide[0] > 0.0 && pixel.iter().all(|v| v.is_finite()) {
            for (excess, screen) in excess.iter_mut().zip([Screen::Green, Screen::Blue]) {
                let channel = screen.channel();
                let mut lost = [0.0; 3];
                lost[channel] = surplus(*pixel, *guide, channel);
                *excess += f64::from(luminance(lost));
            }
            light += f64::from(guide[0] * luminance(*pixel));
        }
    }
    Spill::new(excess, light)
}

/// Removes `amount` (`[0, 1]`) of a screen's spill from a subject, by its [`guide`].
pub fn despill(subject: &mut Image, guide: &Image, screen: Screen, amount: f32) {
    let channel = screen.channel();
    let pairs = subject.pixels.par_iter_mut().zip(&guide.pixels);
    pairs.with_min_len(4096).for_each(|(pixel, guide)| {
        if guide[0] > 0.0 {
            pixel[channel] -= amount * surplus(*pixel, *guide, channel);
        }
    });
}

impl Recording<'_> {
    /// [`rim`] on the GPU, in the red channel; the fourth value is that of `matte`.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn rim(&mut self, matte: &GpuPicture) -> Result<GpuPicture> {
        let open = self.plain((&SHADER, "openness"), [0; 2], matte, None)?;
        let open = self.background_blur(&open, reach(matte.height))?;
        self.plain((&SHADER, "rim"), [0; 2], matte, Some(&open))
    }

    /// [`guide`] and [`spill`] of a subject on the GPU: reads 1 KiB.
    ///
    /// # Errors
    /// When the GPU cannot hold the guide, or fails.
    pub fn guide(&mut self, subject: &GpuPicture, rim: &GpuPicture) -> Result<(GpuPicture, Spill)> {
        let inside = self.plain((&SHADER, "inside"), [0; 2], subject, Some(rim))?;
        let inside = self.background_blur(&inside, INSIDE * reach(subject.height))?;
        let guide = self.plain((&SHADER, "guide"), [0; 2], &inside, Some(rim))?;
        let spill = self.plain((&SHADER, "spill"), [0; 2], subject, Some(&guide))?;
        let parts = self.parts("total", &spill)?;
        let sum = |c: usize| parts.iter().map(|part| f64::from(part[c])).sum::<f64>();
        Ok((guide, Spill::new([sum(0), sum(1)], sum(2))))
    }

    /// [`despill`] on the GPU.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn despill(
        &mut self,
        subject: &GpuPicture,
        guide: &GpuPicture,
        screen: Screen,
        amount: f32,
    ) -> Result<GpuPicture> {
        let values = [screen.channel() as u32, amount.to_bits()];
        self.plain((&SHADER, "despill"), values, subject, Some(guide))
    }
}

fn mean_of_others(pixel: [f32; 3], channel: usize) -> f32 {
    let sum = if channel == 1 { pixel[0] + pixel[2] } else { pixel[0] + pixel[1] };
    0.5 * sum
}

/// Excess of the colour in a pixel of the rim over its natural maximum.
fn surplus(pixel: [f32; 3], guide: [f32; 3], channel: usize) -> f32 {
    guide[0] * (pixel[channel] - guide[channel] * mean_of_others(pixel, channel)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compose::tests::disc;

    /// Skin in front of a screen that lights its rim.
    fn spilt(size: usize, channel: usize, much: f32) -> (Image, Image) {
        let mask = disc(size);
        let rim = rim(&mask);
        let mut subject = mask.map(|a| [0.5 * a, 0.35 * a, 0.3 * a]);
        for (i, pixel) in subject.pixels.iter_mut().enumerate() {
            pixel[channel] += much * rim.pixels[i] * mask.pixels[i];
        }
        let guide = guide(&subject, &mask, &rim);
        (subject, guide)
    }

    #[test]
    fn spill_is_measured_named_and_taken_out() {
        for (channel, screen) in [(1, Screen::Green), (2, Screen::Blue)] {
            let (mut subject, guide) = spilt(96, channel, 0.3);
            let measured = spill(&subject, &guide);
            assert_eq!(measured.screen, screen);
            assert!(measured.excess > 0.01, "{measured:?}");
            let middle = subject.at(48, 48);
            despill(&mut subject, &guide, screen, 1.0);
            assert_eq!(subject.at(48, 48), middle);
            // The rest along the edge is the tolerance for natural variation.
            let clean = middle[channel] / mean_of_others(middle, channel);
            for (pixel, _) in subject.pixels.iter().zip(&guide.pixels).filter(|(_, g)| g[0] == 1.0) {
                let ratio = pixel[channel] / mean_of_others(*pixel, channel);
                assert!(ratio < 1.1 * clean, "{ratio} is not {clean}");
            }
        }
    }

    #[test]
    fn clean_skin_and_green_light_are_no_spill() {
        let (clean, guide) = spilt(96, 1, 0.0);
        assert_eq!(spill(&clean, &guide).excess, 0.0);
        let mask = disc(96);
        let green = clean.map(|[r, g, b]| [0.2 * r, g, 0.4 * b]);
        let guide = super::guide(&green, &mask, &rim(&mask));
        assert_eq!(spill(&green, &guide).excess, 0.0);
    }

    #[test]
    fn hard_mattes_and_values_are_no_spill() {
        for size in [1, 16] {
            for alpha in [0.0, 0.5, 1.0] {
                for value in [f32::NAN, f32::INFINITY, 0.0, 1e6] {
                    let mask = Mask::filled(size, size, alpha);
                    let mut subject = Image::filled(size, size, [value; 3]);
                    let guide = guide(&subject, &mask, &rim(&mask));
                    assert!(guide.pixels.iter().flatten().all(|v| v.is_finite()));
                    assert_eq!(spill(&subject, &guide).excess, 0.0);
                    despill(&mut subject, &guide, Screen::Blue, 1.0);
                }
            }
        }
        assert!(rim(&Mask::filled(0, 0, 1.0)).pixels.is_empty());
        // A matte without a rim: the subject fills the picture.
        assert!(rim(&Mask::filled(8, 8, 1.0)).pixels.iter().all(|&r| r == 0.0));
    }
}
