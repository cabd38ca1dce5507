//! Energies of lamps at listed directions, by photometric stereo.

use super::pictures::Pose;
use base::median::median;
use glam::{DMat3, DVec3, Vec3};
use imaging::color::luminance;
use light::{Lamp, Rig};
use rayon::prelude::*;
use std::f32::consts::PI;

/// Median albedo of the subject. Without balls only the ratios of the lamps' energies are known.
const ALBEDO: f32 = 0.4;
/// Confidence of a listed direction, which nothing checks.
const LISTED: f32 = 0.6;
/// Angular radius of a lamp in degrees, which lists do not give.
const SPREAD_DEG: f32 = 3.0;
/// Rounds of normals and energies.
const ROUNDS: usize = 8;
/// Smallest cosine of light that counts: grazing light is often shadowed.
const GRAZING: f64 = 0.2;

/// Lamps at the listed directions, with energies by photometric stereo (Woodham 1980): in turn the albedo times the normal
/// of each pixel, and the energy of each lamp, without pixels in shadow or glint. The mean lamp is white. A lamp that
/// lights too few pixels has the median energy.
pub fn rig<'a>(poses: &[Pose], names: impl Iterator<Item = &'a String>, directions: &[Vec3]) -> Rig {
    let lights: Vec<Vec<[f32; 3]>> =
        (poses.iter()).flat_map(|pose| pose.solid().into_iter().map(move |at| pose.under_each(at))).collect();
    let mut energies = vec![1.0f32; directions.len()];
    let mut surfaces: Vec<Option<Surface>> = vec![];
    for _ in 0..ROUNDS {
        surfaces = (lights.par_iter()).map(|light| Surface::new(light, &energies, directions)).collect();
        energies = energies_by(&lights, &surfaces, directions, |_, light| luminance(light));
    }
    let lengths = surfaces.iter().flatten().map(|surface| surface.normal.length() as f32);
    let scale = median(lengths) * PI / ALBEDO;
    let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len().max(1) as f32;
    let by_channel = [0, 1, 2].map(|c| {
        let shares: Vec<f32> = surfaces
            .iter()
            .zip(&lights)
            .map(|(surface, light)| {
                let used = surface.iter().flat_map(|surface| surface.used.iter().copied());
                median(used.map(|i| light[i][c] / luminance(light[i]).max(f32::MIN_POSITIVE)))
            })
            .collect();
        let energies = energies_by(&lights, &surfaces, directions, |pixel, light| light[c] / shares[pixel].max(1e-3));
        let white = mean(&energies).max(f32::MIN_POSITIVE);
        energies.iter().map(|energy| energy / white).collect::<Vec<_>>()
    });
    let scale = scale * mean(&energies);
    let lamp = |(i, (name, direction)): (usize, (&String, &Vec3))| Lamp {
        name: name.clone(),
        direction: *direction,
        energy: [0, 1, 2].map(|c| scale * by_channel[c][i]),
        spread_deg: SPREAD_DEG,
        confidence: LISTED,
        clipped: 0.0,
    };
    Rig { lamps: names.zip(directions).enumerate().map(lamp).collect() }
}

/// A matte surface under the lamps.
struct Surface {
    /// Normal times albedo over π, in units of the lamps' energies.
    normal: DVec3,
    /// Lamps that light it without shadow or glint.
    used: Vec<usize>,
}

impl Surface {
    /// Least squares over the lamps that light a pixel (Lambert), without outliers; None if fewer than four do.
    fn new(light: &[[f32; 3]], energies: &[f32], directions: &[Vec3]) -> Option<Self> {
        let values: Vec<f64> = light.iter().zip(energies).map(|(l, e)| f64::from(luminance(*l) / e)).collect();
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        // Without the brightest tenth, which may be glints.
        let bright = sorted[9 * (sorted.len() - 1) / 10];
        let mut used: Vec<usize> = (0..values.len()).filter(|&i| values[i] > 0.3 * bright).collect();
        let mut normal = DVec3::ZERO;
        for _ in 0..4 {
            if used.len() < 4 {
                return None;
            }
            let (mut gram, mut sum) = (DMat3::ZERO, DVec3::ZERO);
            for &i in &used {
                let to = directions[i].as_dvec3();
                gram += DMat3::from_cols(to.x * to, to.y * to, to.z * to);
                sum += values[i] * to;
            }
            if gram.determinant().abs() < 1e-6 {
                return None;
            }
            normal = gram.inverse() * sum;
            let size = normal.length();
            let cosine = |i: usize| directions[i].as_dvec3().dot(normal) / size;
            let off = |i: usize| (values[i] / size - cosine(i)).abs();
            let facing = (0..values.len()).filter(|&i| cosine(i) > GRAZING);
            let typical = f64::from(median(facing.clone().map(|i| off(i) as f32)));
            let limit = 3.0 * typical.max(0.01);
            used = facing.filter(|&i| off(i) < limit).collect();
        }
        Some(Self { normal, used })
    }
}

/// Energy of each lamp relative to the median lamp's: the median over the pixels that face it of their light by their
/// cosine. Few pixels, as of a lamp behind the subject, count less than the likeness of the lamps.
fn energies_by(
    lights: &[Vec<[f32; 3]>],
    surfaces: &[Option<Surface>],
    directions: &[Vec3],
    light_of: impl Fn(usize, [f32; 3]) -> f32 + Sync,
) -> Vec<f32> {
    /// Share of all pixels that counts as much as the likeness of the lamps.
    const FEW: f32 = 0.05;
    let energy = |lamp: usize| {
        let to = directions[lamp].as_dvec3();
        let ratios: Vec<f32> = (surfaces.iter().zip(lights).enumerate())
            .filter_map(|(pixel, (surface, light))| {
                let normal = surface.as_ref()?.normal;
                let cosine = to.dot(normal);
                // Shadowed pixels count too: which they are depends on the energy.
                (cosine > 2.0 * GRAZING * normal.length()).then(|| light_of(pixel, light[lamp]) / cosine as f32)
            })
            .collect();
        let count = ratios.len() as f32;
        (median(ratios), count / (count + FEW * lights.len() as f32).max(1.0))
    };
    let found: Vec<(f32, f32)> = (0..directions.len()).into_par_iter().map(energy).collect();
    let is_lit = |(energy, share): &&(f32, f32)| *energy > 0.0 && *share > 0.5;
    let typical = median(found.iter().filter(is_lit).map(|(energy, _)| *energy));
    let relative = |(energy, share): (f32, f32)| {
        if energy > 0.0 && typical > 0.0 { (energy / typical).powf(share) } else { 1.0 }
    };
    found.into_iter().map(relative).collect()
}
