//! Pass `grain`: gives the relit picture the plate's grain, if it has less.
//!
//! Grain is measured in display codes, as a deviation per channel and brightness. The picture
//! is high-passed by [1 −2 1] across and down, which removes slopes and planes (Immerkær, *Fast Noise
//! Variance Estimation*, 1996), at places of small Sobel gradient, which for white noise is independent of
//! the high-pass. The deviation is 1.4826 times the median of magnitudes. Variances subtract, so that the
//! picture's own grain is not added twice. The added grain is white: independent for each pixel.

use super::descriptor::{CodesInput, CodesStep, Descriptor, PassContext, Run, decide, key_in, needs_display};
use super::edges::SOLID;
use super::facts::{BINS, Grain, key};
use super::passes::{GpuPicture, Recording, Shader, extent};
use super::view::viewed;
use base::error::Result;
use bytemuck::{Pod, Zeroable, bytes_of};
use imaging::{Encoded, Image, Mask};
use rayon::prelude::*;
use scene::{Pass, Scene};

const SHADER: Shader = Shader::new("grain", include_str!("../../../shaders/grain.wgsl"));

pub(crate) const GRAIN: Descriptor = Descriptor {
    fixed: needs_display,
    settings: |context| key((context.effects.grain.to_bits(), context.scene.frame)),
    reads: |context, planned| key((key_in(planned, Pass::View), context.facts.inputs.grain)),
    shader: Some(&SHADER),
    run: Run::Codes(CodesStep {
        in_memory: |context, input, codes| {
            if let Some(grains) = grains(context, input) {
                let (amount, frame) = (context.effects.grain, context.scene.frame);
                grain(codes, [input.mask, input.alpha], grains, amount, frame);
            }
            Ok(())
        },
        on_gpu: |context, input, recording, codes, matte| match grains(context, input) {
            Some(grains) => {
                let (amount, frame) = (context.effects.grain, context.scene.frame);
                recording.grain(codes, matte, grains, amount, frame)
            }
            None => Ok(codes.clone()),
        },
    }),
    ..Descriptor::new(Pass::Grain, |context| {
        context.asked(Pass::Grain)?;
        context.displayed()?;
        let missing = context.facts.missing_grain;
        decide(
            missing > UNSEEN,
            || format!("the plate has {:.1} codes more grain", 255.0 * missing),
            "the plate has no more grain than the picture",
        )
    })
};

/// Grain of the plate and of the picture; None without a plate.
fn grains<'a>(context: &'a PassContext, input: &CodesInput<'a>) -> Option<[&'a Grain; 2]> {
    Some([input.plate?, &context.facts.own_grain])
}

/// Fewest samples of a measurement.
const FEWEST: usize = 64;

/// Most pixels that are sampled.
const SAMPLES: usize = 40_000;

/// Deviation in codes below which grain is invisible: a quarter of a step of 8 bits.
const UNSEEN: f32 = 0.25 / 255.0;

impl Grain {
    /// Grain of a plate under a scene's view transform, where the matte is solid. One frame represents a clip: grain belongs
    /// to the camera, not to the frame.
    pub fn from_plate(plate: &Image, mask: &Mask, scene: &Scene) -> Self {
        Self::new(&viewed(plate, scene), mask)
    }

    /// Grain of a picture where the matte is solid; 0 without enough flat places.
    pub fn new(codes: &Encoded, mask: &Mask) -> Self {
        if mask.size() != codes.0.size() {
            return Self::default();
        }
        let width = mask.width as isize;
        Self::measured(mask, |_, pixel, channel| {
            sample(|dx, dy| {
                let near = pixel as isize + dy * width + dx;
                codes.0.pixels[near as usize][channel]
            })
        })
    }

    /// Grain of a picture given by `sample` at a pixel and a channel.
    fn measured(mask: &Mask, sample: impl Fn(usize, usize, usize) -> Sample + Sync) -> Self {
        let Some((step, count)) = places(mask.size()) else { return Self::default() };
        let inner = mask.width - 2;
        let places: Vec<(usize, usize)> = (0..count)
            .map(|place| (place, place * step))
            .map(|(place, i)| (place, (i / inner + 1) * mask.width + i % inner + 1))
            .filter(|&(_, pixel)| mask.pixels[pixel] >= SOLID)
            .collect();
        let deviations: Vec<[f32; BINS]> = (0..3)
            .into_par_iter()
            .map(|channel| {
                let mut classes: [Vec<(f32, f32)>; BINS] = Default::default();
                for &(place, pixel) in &places {
                    let sample = sample(place, pixel, channel);
                    classes[class(sample.code)].push((sample.gradient, sample.high));
                }
                let known = classes.map(class_deviation);
                filled(known)
            })
            .collect();
        Self { deviation: std::array::from_fn(|bin| std::array::from_fn(|channel| deviations[channel][bin])) }
    }
}

/// Places at which a picture's grain is measured, in order, among the pixels with neighbours on all
/// sides: the step from one to the next, and their number. None without such pixels.
fn places((width, height): (usize, usize)) -> Option<(usize, usize)> {
    let inner = width.saturating_sub(2) * height.saturating_sub(2);
    let step = inner.div_ceil(SAMPLES) | 1;
    (inner > 0).then(|| (step, inner.div_ceil(step)))
}

/// Measurements at one place.
struct Sample {
    /// Smoothed code.
    code: f32,
    /// Square of the gradient.
    gradient: f32,
    /// High-pass; white noise of deviation 1 gives it a deviation of 1.
    high: f32,
}

fn sample(at: impl Fn(isize, isize) -> f32) -> Sample {
    let column = |dx| [at(dx, -1), at(dx, 0), at(dx, 1)];
    let [left, middle, right] = [column(-1), column(0), column(1)];
    let smooth = |v: [f32; 3]| v[0] + 2.0 * v[1] + v[2];
    let second = |v: [f32; 3]| v[0] - 2.0 * v[1] + v[2];
    let slope = |v: [f32; 3]| v[2] - v[0];
    let across = smooth(right) - smooth(left);
    let down = slope(left) + 2.0 * slope(middle) + slope(right);
    Sample {
        code: (smooth(left) + 2.0 * smooth(middle) + smooth(right)) / 16.0,
        gradient: across * across + down * down,
        // The squares of its nine weights add up to 36.
        high: (second(left) - 2.0 * second(middle) + second(right)) / 6.0,
    }
}

fn class(code: f32) -> usize {
    ((code * BINS as f32) as usize).min(BINS - 1)
}

/// Deviation of one class, from its flatter half.
fn class_deviation(mut samples: Vec<(f32, f32)>) -> Option<f32> {
    if samples.len() < FEWEST {
        return None;
    }
    let half = samples.len() / 2;
    samples.select_nth_unstable_by(half, |a, b| a.0.total_cmp(&b.0));
    let mut high: Vec<f32> = samples[..half].iter().map(|s| s.1.abs()).collect();
    let (_, median, _) = high.select_nth_unstable_by(half / 2, f32::total_cmp);
    Some(1.4826 * *median)
}

/// Unmeasured classes take the nearest measured one, the darker of two.
fn filled(known: [Option<f32>; BINS]) -> [f32; BINS] {
    std::array::from_fn(|bin| {
        let near = (0..BINS).filter(|&other| known[other].is_some());
        let near = near.min_by_key(|&other| other.abs_diff(bin));
        near.and_then(|other| known[other]).unwrap_or(0.0)
    })
}

/// Adds grain to codes: `plate` beyond `own` on the subject, all of `plate` on the background, each times the
/// picture's coverage `alpha`. Every frame has its own grain, which is reproducible.
pub fn grain(codes: &mut Encoded, [mask, alpha]: [&Mask; 2], [plate, own]: [&Grain; 2], amount: f32, frame: usize) {
    let subject = plate.beyond(own, amount);
    let behind = plate.beyond(&Grain::default(), amount);
    let pixels = codes.0.pixels.par_iter_mut().enumerate();
    pixels.with_min_len(4096).for_each(|(i, pixel)| {
        let (covered, alpha) = (mask.pixels[i], alpha.pixels[i]);
        let place = place(i, frame);
        for (c, code) in pixel.iter_mut().enumerate() {
            let inside = subject.at(*code, c);
            let outside = behind.at(*code, c);
            let deviation = alpha * (outside + covered * (inside - outside));
            *code = (*code + deviation * normal(place, c)).clamp(0.0, 1.0);
        }
    });
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct GrainParams {
    size: [u32; 2],
    frame: u32,
    step: u32,
    inside: [[f32; 4]; BINS],
    outside: [[f32; 4]; BINS],
}

impl Recording<'_> {
    /// [`grain`] on the GPU: the fourth value of `codes` is the picture's coverage, that of `matte` the subject's.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn grain(
        &mut self,
        codes: &GpuPicture,
        matte: &GpuPicture,
        [plate, own]: [&Grain; 2],
        amount: f32,
        frame: usize,
    ) -> Result<GpuPicture> {
        let padded = |grain: Grain| grain.deviation.map(|[r, g, b]| [r, g, b, 0.0]);
        let params = GrainParams {
            size: extent(codes.size()),
            frame: frame as u32,
            step: 1,
            inside: padded(plate.beyond(own, amount)),
            outside: padded(plate.beyond(&Grain::default(), amount)),
        };
        let (shader, size) = ((&SHADER, "grain"), codes.size());
        self.run(shader, bytes_of(&params), codes, Some(matte), size)
    }

    /// Grain of codes where the matte is solid, as in [`Grain::new`]: from the same places, at most 40,000,
    /// which are 1.9 MB.
    ///
    /// # Errors
    /// When the GPU fails.
    pub fn measure_grain(&mut self, codes: &GpuPicture, mask: &Mask) -> Result<Grain> {
        let Some((step, count)) = places(codes.size()) else { return Ok(Grain::default()) };
        let params = GrainParams {
            size: extent(codes.size()),
            frame: 0,
            step: step as u32,
            inside: [[0.0; 4]; BINS],
            outside: [[0.0; 4]; BINS],
        };
        let (shader, size) = ((&SHADER, "survey"), (count, 3));
        let survey = self.run(shader, bytes_of(&params), codes, None, size)?;
        let [survey] = self.read([&survey])?;
        Ok(Grain::measured(mask, |place, _, channel| {
            let [code, gradient, high, _] = survey.at(place, channel);
            Sample { code, gradient, high }
        }))
    }
}

/// Hash of a pixel in a frame.
fn place(pixel: usize, frame: usize) -> u32 {
    hash(hash(frame as u32) ^ pixel as u32)
}

/// Random number of mean 0 and deviation 1 for a channel of a place: the sum of the four bytes of a hash, which
/// is near enough to normal and the same on every device.
fn normal(place: u32, channel: usize) -> f32 {
    let bytes = hash(place ^ channel as u32).to_le_bytes().map(u32::from);
    let sum: u32 = bytes.iter().sum();
    // Four uniform draws from 0 to 255 have the mean 510 and the variance 4 · (256² − 1) / 12.
    (sum as f32 - 510.0) / 147.8
}

/// PCG's output permutation (Jarzynski and Olano, *Hash Functions for GPU Rendering*, JCGT 2020).
fn hash(input: u32) -> u32 {
    let state = input.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Raster;

    /// A ramp with texture, and grain whose deviation grows with its code.
    fn grainy(size: usize, deviation: f32) -> Encoded {
        Encoded(Raster::from_fn(size, size, |x, y| {
            let code = 0.1 + 0.8 * x as f32 / size as f32;
            let edge = if y % 40 < 2 { 0.1 } else { 0.0 };
            std::array::from_fn(|c| code + edge + deviation * code * normal(place(y * size + x, 99), c))
        }))
    }

    fn deviation(values: impl Iterator<Item = f32> + Clone) -> f32 {
        let n = values.clone().count() as f32;
        let mean = values.clone().sum::<f32>() / n;
        (values.map(|v| (v - mean).powi(2)).sum::<f32>() / n).sqrt()
    }

    #[test]
    fn the_grain_of_a_plate_is_measured_through_texture_and_slopes() {
        let solid = Mask::filled(256, 256, 1.0);
        for wanted in [0.0, 0.02, 0.06] {
            let grain = Grain::new(&grainy(256, wanted), &solid);
            for bin in 1..7 {
                let code = (bin as f32 + 0.5) / BINS as f32;
                for c in 0..3 {
                    let found = grain.deviation[bin][c];
                    assert!(
                        (found - wanted * code).abs() < 0.08 * wanted * code + 1e-5,
                        "{found} at {code}, not {}",
                        wanted * code
                    );
                }
            }
        }
    }

    #[test]
    fn a_clean_picture_gets_the_plate_s_grain_and_a_grainy_one_no_more() {
        let solid = Mask::filled(256, 256, 1.0);
        let plate = Grain::new(&grainy(256, 0.05), &solid);
        for own in [0.0, 0.03, 0.05] {
            let mut picture = grainy(256, own);
            let had = Grain::new(&picture, &solid);
            grain(&mut picture, [&solid; 2], [&plate, &had], 1.0, 3);
            let has = Grain::new(&picture, &solid);
            for bin in 1..7 {
                let ratio = has.deviation[bin][1] / plate.deviation[bin][1];
                assert!((ratio - 1.0).abs() < 0.1, "{own}: {ratio}");
            }
        }
    }

    #[test]
    fn grain_has_no_mean_is_of_its_frame_and_repeats() {
        let plate = Grain { deviation: [[0.04; 3]; BINS] };
        let solid = Mask::filled(128, 128, 1.0);
        let made = |frame| {
            let mut flat = Encoded(Image::filled(128, 128, [0.5; 3]));
            grain(&mut flat, [&solid; 2], [&plate, &Grain::default()], 1.0, frame);
            flat
        };
        let first = made(1);
        assert_eq!(first, made(1));
        assert_ne!(first, made(2));
        let values = first.0.pixels.iter().map(|p| p[0]);
        assert!((values.clone().sum::<f32>() / 16384.0 - 0.5).abs() < 0.001);
        assert!((deviation(values) / 0.04 - 1.0).abs() < 0.02);
        let other = made(2).0.pixels;
        let apart = first.0.pixels.iter().zip(other).map(|(a, b)| a[0] - b[0]);
        assert!((deviation(apart) / (0.04 * 2f32.sqrt()) - 1.0).abs() < 0.03);
    }

    #[test]
    fn hard_plates_have_no_grain_and_empty_pictures_none_to_get() {
        for size in [0, 1, 2, 16] {
            for value in [f32::NAN, f32::INFINITY, 0.0, 1e6] {
                for alpha in [0.0, 1.0] {
                    let mask = Mask::filled(size, size, alpha);
                    let plate = Image::filled(size, size, [value; 3]);
                    let found = Grain::from_plate(&plate, &mask, &Scene::default());
                    assert_eq!(found.most(), 0.0);
                    let mut codes = Encoded(Image::filled(size, size, [0.5; 3]));
                    let grainy = Grain { deviation: [[0.1; 3]; BINS] };
                    grain(&mut codes, [&mask; 2], [&grainy, &found], 1.0, 0);
                    let changed = codes.0.pixels.iter().any(|p| *p != [0.5; 3]);
                    assert_eq!(changed, alpha > 0.0 && size > 0);
                }
            }
        }
    }
}
