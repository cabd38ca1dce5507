//! Pass `light_wrap`: light from behind reaches around the subject's rim. Where the
//! blurred background is brighter than the rim, the rim is drawn towards it.

use super::background_blur::defocused;
use super::descriptor::{Descriptor, decide, key_in, needs_background};
use super::facts::key;
use super::passes::{GpuPicture, Recording, Shader};
use super::pyramid::{Rgba, rgba};
use base::error::Result;
use imaging::{Image, Mask, color::luminance};
use rayon::prelude::*;
use scene::Pass;

const SHADER: Shader = Shader::new("light_wrap", include_str!("../../../shaders/light_wrap.wgsl"));

pub(crate) const LIGHT_WRAP: Descriptor = Descriptor {
    fixed: needs_background,
    settings: |context| key(context.effects.light_wrap.to_bits()),
    reads: |_, planned| key([Pass::Despill, Pass::BackgroundBlur].map(|pass| key_in(planned, pass))),
    shader: Some(&SHADER),
    ..Descriptor::new(Pass::LightWrap, |context| {
        context.asked(Pass::LightWrap)?;
        context.behind()?;
        let added = context.effects.light_wrap * context.facts.wrap_need;
        decide(
            added > LEAST_WRAP,
            || format!("it adds {:.1} % to the rim", 100.0 * added),
            "the background is no brighter than the rim",
        )
    })
};

/// Wrapped light below this share of the rim's light is skipped.
const LEAST_WRAP: f32 = 0.002;

/// Reach of the light around a rim, as a share of the picture's height.
const REACH: f32 = 1.0 / 48.0;

/// Longer side in pixels of the pictures on which the need for wrapping is measured.
const MEASURED: usize = 64;

/// Radius in pixels of the blur by which the light behind reaches around a rim.
fn reach(height: usize) -> f32 {
    (REACH * height as f32).max(1.0)
}

/// Adds `amount` (`[0, 1]`) of the wrapped light to a premultiplied subject: with `W` the blurred light
/// that comes past the matte and `b` the blurred opening, max(0, α·W − b·subject), which is 0 wherever
/// the light behind, `W / b`, is no brighter than the subject. All pictures have the same size.
pub fn light_wrap(subject: &mut Image, mask: &Mask, behind: &Image, amount: f32) {
    if subject.pixels.is_empty() || amount.is_nan() || amount <= 0.0 {
        return;
    }
    let past = light_past(mask, behind);
    let pixels = subject.pixels.par_iter_mut().enumerate();
    pixels.with_min_len(4096).for_each(|(i, pixel)| {
        let more = wrapped(*pixel, mask.pixels[i], past.pixels[i]);
        (0..3).for_each(|c| pixel[c] += amount * more[c]);
    });
}

/// Size at which the need for wrapping is measured: at most 64 pixels along each side.
pub(super) fn measured_size((width, height): (usize, usize)) -> (usize, usize) {
    let scale = (MEASURED as f32 / width.max(height).max(1) as f32).min(1.0);
    let small = |n: usize| ((n as f32 * scale).round() as usize).max(1);
    (small(width), small(height))
}

/// Light that full wrapping would add to the rim, as a share of the rim's light: the need for the pass, for
/// pictures of [`measured_size`]. 0 without a rim.
pub(super) fn need(subject: &Image, mask: &Mask, behind: &Image) -> f32 {
    let past = light_past(mask, behind);
    let (mut added, mut there) = (0f64, 0f64);
    for (i, &pixel) in subject.pixels.iter().enumerate() {
        let (alpha, past) = (mask.pixels[i], past.pixels[i]);
        added += f64::from(luminance(wrapped(pixel, alpha, past)));
        there += f64::from(past[3] * luminance(pixel));
    }
    if added > 0.0 { (added / there.max(f64::MIN_POSITIVE)).min(1e6) as f32 } else { 0.0 }
}

fn wrapped(subject: [f32; 3], alpha: f32, past: [f32; 4]) -> [f32; 3] {
    std::array::from_fn(|c| (alpha * past[c] - past[3] * subject[c]).max(0.0))
}

/// The light that passes the matte, blurred, and in the fourth value the matte's opening.
fn light_past(mask: &Mask, behind: &Image) -> Rgba {
    let open = rgba(behind, |i, light| {
        let open = 1.0 - mask.pixels[i];
        let [r, g, b] = light.map(|v| open * v);
        [r, g, b, open]
    });
    defocused(open, reach(mask.height))
}

impl Recording<'_> {
    /// [`light_wrap`] on the GPU: the fourth value of `subject` is its matte; `behind` is not yet laid under it.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn light_wrap(&mut self, subject: &GpuPicture, behind: &GpuPicture, amount: f32) -> Result<GpuPicture> {
        let open = self.plain((&SHADER, "open"), [0; 2], subject, Some(behind))?;
        let past = self.background_blur(&open, reach(subject.height))?;
        let values = [amount.to_bits(), 0];
        self.plain((&SHADER, "wrap"), values, subject, Some(&past))
    }

    /// A premultiplied subject over its background. The fourth value becomes 1.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn over(&mut self, subject: &GpuPicture, behind: &GpuPicture) -> Result<GpuPicture> {
        self.plain((&SHADER, "over"), [0; 2], subject, Some(behind))
    }

    /// Light that wrapping would add to the rim, measured like [`light_wrap`]: on two pictures of at most 64 pixels
    /// along each side, 128 KiB.
    ///
    /// # Errors
    /// When the GPU fails.
    pub fn wrap_need(&mut self, subject: &GpuPicture, behind: &GpuPicture) -> Result<f32> {
        let size = measured_size(subject.size());
        let subject = self.shrink(subject, size)?;
        let behind = self.shrink(behind, size)?;
        let [subject, behind] = self.read([&subject, &behind])?;
        let light = |picture: &Rgba| -> Image { picture.map(|[r, g, b, _]| [r, g, b]) };
        let mask = subject.map(|[_, _, _, alpha]| alpha);
        Ok(need(&light(&subject), &mask, &light(&behind)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compose::tests::disc;

    fn scene(size: usize, subject: f32, behind: f32) -> (Image, Mask, Image) {
        let mask = disc(size);
        let picture = mask.map(|a| [a * subject; 3]);
        (picture, mask, Image::filled(size, size, [behind; 3]))
    }

    #[test]
    fn light_behind_brightens_the_rim_and_not_the_middle() {
        let (before, mask, behind) = scene(96, 0.1, 4.0);
        let mut after = before.clone();
        light_wrap(&mut after, &mask, &behind, 1.0);
        assert_eq!(after.at(48, 48), before.at(48, 48));
        let rim = (0..96).map(|x| after.at(x, 48)[0] - before.at(x, 48)[0]);
        let most = rim.fold(0.0, f32::max);
        assert!((0.5..4.0).contains(&most), "{most}");
        assert!((0..96).all(|x| mask.at(x, 48) > 0.0 || after.at(x, 48) == [0.0; 3]));
        assert!(need(&before, &mask, &behind) > 1.0);
    }

    #[test]
    fn a_background_that_is_no_brighter_changes_nothing() {
        let (before, mask, behind) = scene(64, 0.5, 0.5);
        let mut after = before.clone();
        light_wrap(&mut after, &mask, &behind, 1.0);
        for (a, b) in after.pixels.iter().zip(&before.pixels) {
            // α·W and b·subject are equal up to rounding.
            assert!((a[0] - b[0]).abs() < 1e-6);
        }
        assert!(need(&before, &mask, &behind) < 1e-5);
        let (before, mask, behind) = scene(64, 0.5, 0.0);
        assert_eq!(need(&before, &mask, &behind), 0.0);
    }

    #[test]
    fn hard_inputs_stay_finite() {
        for size in [1, 16] {
            for alpha in [0.0, 0.5, 1.0] {
                for value in [f32::NAN, f32::INFINITY, 0.0, 1e6] {
                    let mask = Mask::filled(size, size, alpha);
                    let mut subject = Image::filled(size, size, [0.2 * alpha; 3]);
                    let behind = Image::filled(size, size, [value; 3]);
                    assert!(need(&subject, &mask, &behind).is_finite());
                    light_wrap(&mut subject, &mask, &behind, 1.0);
                    assert!(subject.pixels.iter().flatten().all(|v| v.is_finite()));
                    if alpha == 0.0 {
                        assert!(subject.pixels.iter().all(|&p| p == [0.0; 3]));
                    }
                }
            }
        }
    }
}
