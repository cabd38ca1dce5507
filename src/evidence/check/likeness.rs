//! Likeness of simple surfaces under an environment and under the lamps that replace it.
//!
//! Lamps cannot throw the sharp shadow edges of a small sun. So the surfaces are matt points all over a ball in
//! view of the camera, each at the foot of a wall that hides a part of its sky: if the light is small, a wall
//! hides all of it or none.

use glam::{Quat, Vec3};
use imaging::color::luminance;
use light::latlong::{texel_direction, texel_solid_angle};
use light::{Environment, LightWeights, Rig};
use rayon::prelude::*;
use std::f32::consts::{SQRT_2, TAU};

/// Columns of the environment: 2.8° per texel, a fraction of the distance between lamps.
const WIDTH: usize = 128;
/// Number of points on the ball, and of samples per lamp.
const POINTS: usize = 400;
const SAMPLES: usize = 24;
/// Display value of a picture's 95th percentile.
const EXPOSED: f64 = 0.5;

/// Light from a direction: its luminance energy.
type Ray = (Vec3, f64);

/// The peak signal-to-noise ratio in dB of the surfaces under the lamps, against the same surfaces under the
/// turned environment, in display values v^(1/2.2); NaN if the environment is black.
pub(super) fn likeness_db(environment: &Environment, turn: Quat, rig: &Rig, weights: &LightWeights) -> f32 {
    let (truth, lamps) = (sky(environment, turn), lamps(rig, weights));
    let pictures: Vec<[f64; 2]> =
        (0..POINTS).into_par_iter().map(|i| [&truth, &lamps].map(|rays| lit(i, rays))).collect();
    let mut levels: Vec<f64> = pictures.iter().map(|[truth, _]| *truth).collect();
    levels.sort_by(f64::total_cmp);
    let exposure = EXPOSED / levels[POINTS * 95 / 100];
    let squares = pictures.iter().map(|values| {
        let [a, b] = values.map(|v| (exposure * v).clamp(0.0, 1.0).powf(1.0 / 2.2));
        (a - b).powi(2)
    });
    let mean = squares.sum::<f64>() / POINTS as f64;
    if exposure.is_finite() { (-10.0 * mean.max(1e-9).log10()) as f32 } else { f32::NAN }
}

/// Light that a point reflects in every direction, up to a factor: Lambert's law, behind its wall.
fn lit(point: usize, rays: &[Ray]) -> f64 {
    let (normal, wall) = place(point);
    let seen = rays.iter().filter(|(from, _)| wall.dot(*from) > 0.0);
    seen.map(|(from, energy)| f64::from(normal.dot(*from).max(0.0)) * energy).sum()
}

/// A point's normal, and the normal of its wall on the point's side.
fn place(point: usize) -> (Vec3, Vec3) {
    // The golden angle, and steps of the R2 sequence (Roberts 2018), which fills a square evenly.
    const GOLDEN: f32 = 2.399_963;
    const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    let radius = ((point as f32 + 0.5) / POINTS as f32).sqrt();
    let (sin, cos) = (GOLDEN * point as f32).sin_cos();
    let normal = Vec3::new(radius * cos, radius * sin, (1.0 - radius * radius).sqrt());
    let [turn, lean] = STEPS.map(|step| (step * point as f64).fract() as f32);
    let (across, up) = normal.any_orthonormal_pair();
    let (sin, cos) = (TAU * turn).sin_cos();
    let lean = (60.0 + 50.0 * lean).to_radians();
    let wall = lean.cos() * normal + lean.sin() * (cos * across + sin * up);
    (normal, wall)
}

/// The light of the turned environment.
fn sky(environment: &Environment, turn: Quat) -> Vec<Ray> {
    let reduced = environment.reduced(WIDTH);
    let (width, height) = reduced.radiance.size();
    let pixels = reduced.radiance.pixels.iter().enumerate();
    let rays = pixels.map(|(i, radiance)| {
        let solid_angle = texel_solid_angle(i / width, width, height);
        let direction = texel_direction(i % width, i / width, width, height);
        (turn * direction, solid_angle * f64::from(luminance(*radiance)))
    });
    rays.filter(|(_, energy)| *energy > 0.0).collect()
}

/// The light of the lamps: even discs of their spread; a disc's radius is √2 times the spread.
fn lamps(rig: &Rig, weights: &LightWeights) -> Vec<Ray> {
    let pairs = rig.lamps.iter().zip(&weights.per_lamp);
    let lit = pairs.filter(|(lamp, _)| lamp.is_usable());
    let samples = lit.flat_map(|(lamp, weight)| {
        let energy = luminance([0, 1, 2].map(|c| weight[c] * lamp.energy[c]));
        let (across, up) = lamp.direction.any_orthonormal_pair();
        let reach = (SQRT_2 * lamp.spread_deg).to_radians().clamp(0.0, 1.0);
        (0..SAMPLES).map(move |i| {
            let off = reach * ((i as f32 + 0.5) / SAMPLES as f32).sqrt();
            let (sin, cos) = (2.399_963 * i as f32).sin_cos();
            let direction = lamp.direction + off.tan() * (cos * across + sin * up);
            (direction.normalize(), f64::from(energy) / SAMPLES as f64)
        })
    });
    samples.filter(|(_, energy)| *energy > 0.0).collect()
}
