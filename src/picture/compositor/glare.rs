//! Pass `glare`: a lens scatters part of the light above white. The scattered light
//! falls off like the glare of the eye and of lenses, between 1/θ² and 1/θ³ of the angle (Vos and van
//! den Berg, CIE 135/1, 1999; Spencer et al., SIGGRAPH 1995): here as 1/θ^2.5, a sum of round spots, each
//! twice as wide as the one before with 1/√2 of its energy. Light up to white stays unchanged.

use super::descriptor::{Descriptor, LightStep, Run, decide};
use super::facts::key;
use super::passes::{GpuPicture, Recording, Shader};
use super::pyramid::{Rgba, double_onto, halve, rgba};
use base::error::Result;
use imaging::Image;
use rayon::prelude::*;
use scene::{Pass, Scene};

const SHADER: Shader = Shader::new("glare", include_str!("../../../shaders/glare.wgsl"));

pub(crate) const GLARE: Descriptor = Descriptor {
    settings: |context| {
        let settings = [context.effects.glare, context.scene.exposure_stops];
        key(settings.map(f32::to_bits))
    },
    shader: Some(&SHADER),
    run: Run::Light(LightStep {
        in_memory: |context, picture| glare(picture, context.effects.glare, white(context.scene)),
        on_gpu: |context, recording, picture| recording.glare(picture, context.effects.glare, white(context.scene)),
        cached: true,
    }),
    ..Descriptor::new(Pass::Glare, |context| {
        context.asked(Pass::Glare)?;
        let brightest = context.facts.brightest * context.scene.exposure_stops.exp2();
        decide(
            brightest > 1.0,
            || format!("the brightest light is {brightest:.1} times white"),
            "nothing is brighter than white",
        )
    })
};

/// Light that is white after exposure.
fn white(scene: &Scene) -> f32 {
    (-scene.exposure_stops).exp2()
}

/// Energy of a spot relative to that of half its width.
const PER_OCTAVE: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Largest number of spots: the widest, of 512 pixels, covers a quarter of the picture.
const MOST_SPOTS: u32 = 7;

/// Scatters `amount` (`[0, 1]`) of the light above `white` over the picture. The picture's energy stays:
/// light that would leave it is mirrored back. Linear light, `white` above 0.
pub fn glare(picture: &mut Image, amount: f32, white: f32) {
    let shares = shares(picture.width, picture.height);
    if shares.is_empty() || amount.is_nan() || amount <= 0.0 {
        return;
    }
    let excess = |p: [f32; 3]| p.map(|v| (v - white).max(0.0));
    let source = rgba(picture, |_, p| {
        let [r, g, b] = excess(p);
        [r, g, b, 0.0]
    });
    let scattered = spread(source, &shares, 0.0);
    let pairs = picture.pixels.par_iter_mut().zip(&scattered.pixels);
    pairs.with_min_len(4096).for_each(|(pixel, more)| {
        let less = excess(*pixel);
        *pixel = std::array::from_fn(|c| pixel[c] + amount * (more[c] - less[c]));
    });
}

/// The largest finite value of a picture's channels, 0 for an empty one.
pub fn brightest(picture: &Image) -> f32 {
    let rows = picture.pixels.par_chunks(4096);
    let larger = |m: f32, v: f32| if v > m && v < f32::INFINITY { v } else { m };
    let largest = |row: &[[f32; 3]]| {
        let most = row.iter().fold([0f32; 3], |m, p| std::array::from_fn(|c| larger(m[c], p[c])));
        most.into_iter().fold(0.0, f32::max)
    };
    rows.map(largest).reduce(|| 0.0, f32::max)
}

/// Energies of the spots, the narrowest first; their sum is 1. Empty if a picture is too small for
/// scattering.
fn shares(width: usize, height: usize) -> Vec<f32> {
    let octaves = width.min(height).checked_ilog2().unwrap_or(0);
    let spots = if octaves == 0 { 0 } else { (octaves - 1).clamp(1, MOST_SPOTS) };
    let energies: Vec<f32> = (0..spots).map(|k| PER_OCTAVE.powi(k as i32)).collect();
    let total: f32 = energies.iter().sum();
    energies.iter().map(|e| e / total).collect()
}

/// `keep` · `fine` plus the sum of the spots of all coarser sizes.
fn spread(mut fine: Rgba, shares: &[f32], keep: f32) -> Rgba {
    if let [share, wider @ ..] = shares {
        let mut coarse = halve(&fine);
        weigh_odd_ends(&mut coarse, fine.size(), 0.5);
        let mut coarse = spread(coarse, wider, *share);
        weigh_odd_ends(&mut coarse, fine.size(), 2.0);
        double_onto(&coarse, &mut fine, keep);
    } else {
        fine.pixels.iter_mut().flatten().for_each(|v| *v *= keep);
    }
    fine
}

/// The last pixel of a halved odd row covers half as many pixels as the others, so it carries half
/// the energy: `weight` is ½ on the way down and 2 on the way up.
fn weigh_odd_ends(coarse: &mut Rgba, fine: (usize, usize), weight: f32) {
    let (width, height) = coarse.size();
    let scale = |pixel: &mut [f32; 4]| pixel.iter_mut().for_each(|v| *v *= weight);
    if fine.0 % 2 == 1 {
        (0..height).for_each(|y| scale(&mut coarse.pixels[y * width + width - 1]));
    }
    if fine.1 % 2 == 1 {
        (0..width).for_each(|x| scale(&mut coarse.pixels[(height - 1) * width + x]));
    }
}

impl Recording<'_> {
    /// [`glare`] on the GPU.
    ///
    /// # Errors
    /// When the GPU cannot hold its pictures.
    pub fn glare(&mut self, picture: &GpuPicture, amount: f32, white: f32) -> Result<GpuPicture> {
        let values = [white.to_bits(), amount.to_bits()];
        let shares = shares(picture.width, picture.height);
        let mut scattered = self.plain((&SHADER, "excess"), values, picture, None)?;
        let Some(&last) = shares.last() else { return self.plain((&SHADER, "lay"), values, picture, Some(&scattered)) };
        let mut levels = Vec::with_capacity(shares.len());
        for _ in &shares {
            let half = self.halve(&scattered, 0.5)?;
            levels.push(std::mem::replace(&mut scattered, half));
        }
        // The coarsest level has nothing wider to add to: it takes its own share here.
        scattered = self.scale(&scattered, last)?;
        let keeps = std::iter::once(0.0).chain(shares);
        let pairs: Vec<_> = levels.iter().zip(keeps).collect();
        for (level, keep) in pairs.into_iter().rev() {
            scattered = self.double_onto(&scattered, level, keep, 2.0)?;
        }
        self.plain((&SHADER, "lay"), values, picture, Some(&scattered))
    }

    /// [`brightest`] on the GPU: reads 1 KiB.
    ///
    /// # Errors
    /// When the GPU fails.
    pub fn brightest(&mut self, picture: &GpuPicture) -> Result<f32> {
        let parts = self.parts("largest", picture)?;
        let largest = parts.iter().flat_map(|[r, g, b, _]| [r, g, b]);
        Ok(largest.fold(0.0, |most, &v| most.max(v)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(picture: &Image) -> f64 {
        let values = picture.pixels.iter().flatten();
        values.map(|&v| f64::from(v)).sum()
    }

    fn lamp(width: usize, height: usize, at: (usize, usize), value: f32) -> Image {
        Image::from_fn(width, height, |x, y| [if (x, y) == at { value } else { 0.2 }; 3])
    }

    #[test]
    fn energy_is_kept_wherever_the_light_is() {
        for (width, height) in [(2, 2), (33, 17), (64, 64), (65, 128), (100, 31)] {
            for at in [(0, 0), (width - 1, height - 1), (width / 2, 1)] {
                let sharp = lamp(width, height, at, 1e4);
                let mut shone = sharp.clone();
                glare(&mut shone, 0.7, 1.0);
                let change = sum(&shone) / sum(&sharp) - 1.0;
                assert!(change.abs() < 1e-5, "{width} × {height} {at:?}: {change}");
            }
        }
    }

    #[test]
    fn what_is_not_above_white_is_left_alone() {
        let mut dim = lamp(32, 32, (4, 5), 1.0);
        let before = dim.clone();
        glare(&mut dim, 1.0, 1.0);
        assert_eq!(dim, before);
        assert_eq!(brightest(&dim), 1.0);
    }

    #[test]
    fn the_glare_falls_off_as_a_power_between_two_and_three() {
        let mut shone = lamp(513, 513, (256, 256), 1e9).map(|p| p.map(|v| v - 0.2));
        glare(&mut shone, 0.5, 1.0);
        let at = |r: usize| {
            let ring = [
                shone.at(256 + r, 256)[0],
                shone.at(256 - r, 256)[0],
                shone.at(256, 256 + r)[0],
                shone.at(256, 256 - r)[0],
            ];
            ring.iter().sum::<f32>() / 4.0
        };
        let power = (at(4) / at(64)).log2() / 4.0;
        assert!((2.0..3.0).contains(&power), "1/θ^{power}");
        for r in 2..100 {
            assert!(at(r + 1) < 1.01 * at(r), "a ring at {r}");
        }
    }

    #[test]
    fn hard_pictures_stay_finite() {
        for (width, height) in [(1, 1), (1, 9), (2, 3), (16, 16)] {
            for value in [f32::NAN, f32::INFINITY, 1e6, 0.0] {
                let mut picture = lamp(width, height, (0, 0), value);
                glare(&mut picture, 1.0, 1.0);
                let finite = |p: &[f32; 3]| p.iter().all(|v| v.is_finite());
                assert!(picture.pixels[1..].iter().all(finite));
            }
        }
        glare(&mut Image::filled(0, 0, [0.0; 3]), 1.0, 1.0);
    }
}
