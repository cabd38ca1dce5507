//! The fit of the camera's dual gamma (the curve itself is [`crate::imaging::DualGamma`]).
//!
//! Two things must agree under the right curve. The OLATs of the poses, summed with the interview's
//! weights, must look like the interview: as the poses differ from the frames, their quantiles are
//! compared. And on the mirror balls, where nothing moves, the sum of the lamps must be the
//! interview's ball pixel for pixel. The first rules the power of the curve, the second its shape; a
//! valley of the one crosses that of the other.
//!
//! A brighter interview and a higher power look alike, so the data hardly tell the exposure: it
//! keeps close to 1, because the balls share one filter and the cameras were not touched
//! (the paper's section 3.1).

use super::code::{Code, STEPS, Table, codes};
use super::probe::Probes;
use super::simplex::minimise;
use crate::error::{Error, Result};
use crate::imaging::{DualGamma, Mask, file};
use crate::progress::Progress;
use crate::project::Project;
use rayon::prelude::*;
use std::path::Path;

/// Levels at which distributions are compared: the middles of twenty equal parts.
const QUANTILES: usize = 20;
/// Pixels taken of each pose and of each frame: enough for steady quantiles.
const SAMPLES: usize = 3000;
/// Interview frames that are pooled, spread over the clip so that the head's turning averages out.
const FRAMES: usize = 8;
/// Standard deviation of the prior on ln exposure: a few hundredths of a stop.
const EXPOSURE_PRIOR: f64 = 0.03;
/// The weak prior on each exponent: video cameras are near 2.2.
const GAMMA_PRIOR: (f64, f64) = (2.2, 0.6);

/// What the fit found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GammaFit {
    /// The camera's response.
    pub response: DualGamma,
    /// Interview = exposure · Σ weights · OLAT.
    pub exposure: f32,
    /// Root-mean-square distance of the encoded quantiles.
    pub residual: f32,
    /// Standard deviations of γ1 and γ2, from the curvature at the minimum.
    pub deviation: [f32; 2],
}

/// The poses' and the frames' pixels inside the subject, as codes.
pub(super) struct Subject {
    /// Per pose, per pixel, one code for each lamp: `pose[pixel · lamps + lamp]`.
    poses: Vec<Vec<Code>>,
    /// The interview's encoded quantiles, of all frames together and of each.
    interview: Quantiles,
    frames: Vec<Quantiles>,
    lamps: usize,
}

/// Quantiles per channel.
type Quantiles = [[f32; QUANTILES]; 3];

impl Subject {
    /// Reads every pose and some frames at their own size: averaging encoded pixels would be wrong.
    pub fn load(project: &Project, progress: &Progress) -> Result<Self> {
        let shoot = &project.settings.shoot;
        let lamps = shoot.lamps.len();
        let mut poses = Vec::new();
        for (pose, name) in shoot.poses.iter().enumerate() {
            progress.check("nothing was changed")?;
            progress.step(
                "poses",
                pose as u64 + 1,
                shoot.poses.len() as u64,
                name.clone(),
            );
            let mask_path = project.exemplar_mask_path(pose);
            let mask = file::read_mask(&mask_path)?;
            let inside = inside(&mask, SAMPLES);
            let olats = (0..lamps)
                .into_par_iter()
                .map(|lamp| sample(&project.olat_path(pose, lamp), &mask, &mask_path, &inside))
                .collect::<Result<Vec<_>>>()?;
            poses.push(
                (0..inside.len())
                    .flat_map(|i| olats.iter().map(move |olat| olat[i]))
                    .collect(),
            );
        }
        let step = shoot.frames.len().div_ceil(FRAMES).max(1);
        let mut frames = (0..shoot.frames.len())
            .step_by(step)
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|frame| {
                let mask_path = project.frame_mask_path(frame);
                let mask = file::read_mask(&mask_path)?;
                sample(
                    &project.frame_path(frame),
                    &mask,
                    &mask_path,
                    &inside(&mask, SAMPLES),
                )
            })
            .collect::<Result<Vec<Vec<Code>>>>()?;
        poses.retain(|pose: &Vec<Code>| !pose.is_empty());
        frames.retain(|frame| !frame.is_empty());
        for (what, empty) in [
            ("exemplar_masks", poses.is_empty()),
            ("interview_masks", frames.is_empty()),
        ] {
            if empty {
                return Err(Error::unexpected(
                    project.shoot_path(what).display(),
                    "a subject: pixels of coverage above 0.98",
                    "none",
                    "Check the mattes; white is the subject",
                ));
            }
        }
        let encoded = |frames: &[Vec<Code>]| -> Quantiles {
            let values = |c: usize| {
                frames
                    .iter()
                    .flatten()
                    .map(move |code| f32::from(code[c]) / f32::from(STEPS))
            };
            [0, 1, 2].map(|c| quantiles(values(c).collect()))
        };
        let interview = encoded(&frames);
        let frames = frames.chunks(1).map(encoded).collect();
        Ok(Self {
            poses,
            interview,
            frames,
            lamps,
        })
    }

    /// A pose's pixels as the sum of its OLATs.
    fn relit(&self, pose: &[Code], table: &Table, weights: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let sum = |codes: &[Code]| {
            codes
                .iter()
                .zip(weights)
                .fold([0.0; 3], |sum, (code, weight)| {
                    [0, 1, 2].map(|c| sum[c] + weight[c] * table.light(code[c]))
                })
        };
        pose.par_chunks_exact(self.lamps)
            .with_min_len(256)
            .map(sum)
            .collect()
    }

    /// How far apart the quantiles are to be expected under the right response, because the poses are
    /// not the frames: the standard error of both means, from the differences among poses and among
    /// frames. Root-mean-square, in encoded values.
    fn scatter(&self, table: &Table, weights: &[[f32; 3]]) -> f64 {
        let poses: Vec<Quantiles> = self
            .poses
            .iter()
            .map(|pose| {
                let relit = self.relit(pose, table, weights);
                [0, 1, 2].map(|c| quantiles(relit.iter().map(|p| table.encode(p[c])).collect()))
            })
            .collect();
        let frames = variance(&self.frames);
        // A single pose is taken to be as special as a single frame is.
        let poses_variance = if poses.len() > 1 {
            variance(&poses)
        } else {
            frames
        };
        (poses_variance / poses.len() as f64 + frames / self.frames.len() as f64).sqrt()
    }

    /// Root-mean-square distance in encoded values between the quantiles of the relit poses and of the
    /// interview.
    fn distance(&self, table: &Table, weights: &[[f32; 3]], exposure: f32) -> f64 {
        let relit: Vec<[f32; 3]> = self
            .poses
            .par_iter()
            .flat_map_iter(|pose| self.relit(pose, table, weights))
            .collect();
        let square: f64 = (0..3usize)
            .into_par_iter()
            .map(|c| {
                let found = quantiles(relit.iter().map(|p| p[c]).collect());
                let pairs = found.iter().zip(&self.interview[c]);
                pairs
                    .map(|(light, is)| f64::from(table.encode(exposure * light) - is).powi(2))
                    .sum::<f64>()
            })
            .sum();
        (square / (3 * QUANTILES) as f64).sqrt()
    }
}

/// Fits γ1, γ2 and the exposure. The cost is that of independent errors of unknown size:
/// Σ n·ln(distance²) over both comparisons, plus the priors.
pub(super) fn fit(subject: &Subject, probes: &Probes, progress: &Progress) -> Result<GammaFit> {
    // Rounding to 8 bits alone leaves this distance; below it nothing can be told.
    let rounding = 1.0 / 255.0 / 12f64.sqrt();
    let middle = DualGamma::new(GAMMA_PRIOR.0 as f32, GAMMA_PRIOR.0 as f32)?;
    let table = Table::new(&middle);
    let scatter = subject
        .scatter(&table, &probes.fit(&table).weights)
        .max(rounding);
    // ln of both squared distances, with their floors.
    let distances = |[gamma1, gamma2, log_exposure]: [f64; 3]| -> Option<[f64; 2]> {
        let table = Table::new(&DualGamma::new(gamma1 as f32, gamma2 as f32).ok()?);
        let weights = probes.fit(&table).weights;
        let quantiles = subject.distance(&table, &weights, log_exposure.exp() as f32);
        let profile = probes.profile_distance(&table).unwrap_or(1.0);
        Some([quantiles.hypot(scatter), profile.hypot(rounding)].map(|d| 2.0 * d.ln()))
    };
    // The surface has valleys, so walks start from the three best places of a grid.
    const GRID: [f64; 6] = [1.2, 1.6, 2.0, 2.4, 2.8, 3.3];
    const WALKS: usize = 3;
    let mut grid = Vec::new();
    for (row, gamma1) in GRID.into_iter().enumerate() {
        progress.check("nothing was changed")?;
        progress.step("response", row as u64, (GRID.len() + WALKS) as u64, "");
        let places = GRID.map(|gamma2| [gamma1, gamma2, 0.0]);
        grid.extend(
            places
                .into_iter()
                .filter_map(|place| Some((place, distances(place)?))),
        );
    }
    // As far as rounding explains the distance on the balls, each pixel is an error of its own; the
    // rest, such as a ball that was moved, is one for each lamp.
    let least = grid.iter().map(|(_, d)| d[1]).fold(f64::INFINITY, f64::min);
    let own = (rounding.powi(2) / least.exp()).min(1.0);
    let profile_count = own * probes.profile_pixels() as f64 + (1.0 - own) * subject.lamps as f64;
    // Neighbouring quantiles move together: three channels of twenty count as twenty.
    let total = |[gamma1, gamma2, log_exposure]: [f64; 3], [quantiles, profile]: [f64; 2]| {
        let prior = |value: f64, mean: f64, deviation: f64| ((value - mean) / deviation).powi(2);
        QUANTILES as f64 * quantiles
            + profile_count * profile
            + prior(log_exposure, 0.0, EXPOSURE_PRIOR)
            + prior(gamma1, GAMMA_PRIOR.0, GAMMA_PRIOR.1)
            + prior(gamma2, GAMMA_PRIOR.0, GAMMA_PRIOR.1)
    };
    let cost = |place: [f64; 3]| distances(place).map_or(f64::INFINITY, |d| total(place, d));
    grid.sort_by(|a, b| total(a.0, a.1).total_cmp(&total(b.0, b.1)));
    let mut best = ([GAMMA_PRIOR.0, GAMMA_PRIOR.0, 0.0], f64::INFINITY);
    for (walk, (start, _)) in grid.iter().take(WALKS).enumerate() {
        progress.check("nothing was changed")?;
        progress.step(
            "response",
            (GRID.len() + walk) as u64,
            (GRID.len() + WALKS) as u64,
            "",
        );
        let found = minimise(cost, *start, [0.2, 0.2, 0.02], 120);
        if found.1 < best.1 {
            best = found;
        }
    }
    let ([gamma1, gamma2, log_exposure], _) = best;
    let response = DualGamma::new(gamma1 as f32, gamma2 as f32)?;
    let table = Table::new(&response);
    let exposure = log_exposure.exp() as f32;
    Ok(GammaFit {
        response,
        exposure,
        residual: subject.distance(&table, &probes.fit(&table).weights, exposure) as f32,
        deviation: deviation(cost, best.0),
    })
}

/// Standard deviations of the first two unknowns where the cost is −2·ln(probability): from the
/// inverse of its second derivatives.
fn deviation(cost: impl Fn([f64; 3]) -> f64, at: [f64; 3]) -> [f32; 2] {
    const STEP: [f64; 3] = [0.05, 0.05, 0.02];
    let moved = |signs: [f64; 3]| cost([0, 1, 2].map(|i| at[i] + signs[i] * STEP[i]));
    let middle = moved([0.0; 3]);
    let mut second = glam::DMat3::ZERO;
    for i in 0..3 {
        for j in 0..=i {
            let signs = |a: f64, b: f64| {
                let mut signs = [0.0; 3];
                signs[i] += a;
                signs[j] += b;
                moved(signs)
            };
            let value = if i == j {
                signs(0.5, 0.5) - 2.0 * middle + signs(-0.5, -0.5)
            } else {
                (signs(1.0, 1.0) - signs(1.0, -1.0) - signs(-1.0, 1.0) + signs(-1.0, -1.0)) / 4.0
            } / (STEP[i] * STEP[j]);
            second.col_mut(i)[j] = value;
            second.col_mut(j)[i] = value;
        }
    }
    let covariance = 2.0 * second.inverse();
    // At a bound or on noise the curvature may not be that of a minimum: then nothing is known beyond
    // the prior.
    [0, 1].map(|i| {
        let variance = covariance.col(i)[i];
        let known = variance.is_finite() && variance > 0.0;
        (if known {
            variance.sqrt()
        } else {
            GAMMA_PRIOR.1
        })
        .min(GAMMA_PRIOR.1) as f32
    })
}

/// Up to about `count` places whose whole neighbourhood is the subject, spread over it.
fn inside(mask: &Mask, count: usize) -> Vec<usize> {
    let (width, height) = mask.size();
    let margin = width.div_ceil(128);
    let solid = |x: usize, y: usize| mask.at(x, y) > 0.98;
    let places: Vec<usize> = (margin..height.saturating_sub(margin))
        .flat_map(|y| (margin..width.saturating_sub(margin)).map(move |x| (x, y)))
        .filter(|&(x, y)| {
            solid(x, y)
                && (y - margin..=y + margin)
                    .all(|row| (x - margin..=x + margin).all(|col| solid(col, row)))
        })
        .map(|(x, y)| y * width + x)
        .collect();
    let step = places.len().div_ceil(count).max(1);
    places.into_iter().step_by(step).collect()
}

/// The codes of a picture at some places of its matte.
fn sample(path: &Path, mask: &Mask, mask_path: &Path, places: &[usize]) -> Result<Vec<Code>> {
    let picture = file::read_encoded(path)?;
    if picture.0.size() != mask.size() {
        return Err(Error::unexpected(
            path.display(),
            format!(
                "{}×{} pixels as in {}",
                mask.width,
                mask.height,
                mask_path.display()
            ),
            format!("{}×{}", picture.0.width, picture.0.height),
            "Give the matte that belongs to the picture",
        ));
    }
    let codes = codes(&picture);
    Ok(places.iter().map(|&place| codes[place]).collect())
}

/// Mean variance of the quantiles of several pictures; 0 for one.
fn variance(pictures: &[Quantiles]) -> f64 {
    let n = pictures.len() as f64;
    let mut sum = 0.0;
    for (c, q) in (0..3).flat_map(|c| (0..QUANTILES).map(move |q| (c, q))) {
        let mean = pictures.iter().map(|p| f64::from(p[c][q])).sum::<f64>() / n;
        sum += pictures
            .iter()
            .map(|p| (f64::from(p[c][q]) - mean).powi(2))
            .sum::<f64>();
    }
    sum / (n - 1.0).max(1.0) / (3 * QUANTILES) as f64
}

/// The quantiles of values, at least one; interpolated.
fn quantiles(mut values: Vec<f32>) -> [f32; QUANTILES] {
    values.sort_unstable_by(f32::total_cmp);
    std::array::from_fn(|i| {
        let place = (i as f32 + 0.5) / QUANTILES as f32 * (values.len() - 1) as f32;
        let (low, part) = (place as usize, place.fract());
        values[low] + part * (values[(low + 1).min(values.len() - 1)] - values[low])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_the_middles_of_equal_parts() {
        let found = quantiles((0..=1000).rev().map(|i| i as f32 / 1000.0).collect());
        for (i, q) in found.iter().enumerate() {
            assert!((q - (i as f32 + 0.5) / QUANTILES as f32).abs() < 1e-4);
        }
        assert_eq!(quantiles(vec![0.3]), [0.3; QUANTILES]);
    }

    #[test]
    fn only_pixels_deep_inside_the_subject_count() {
        let mask = Mask::from_fn(20, 20, |x, y| {
            if (5..12).contains(&x) && (5..12).contains(&y) {
                1.0
            } else {
                0.5
            }
        });
        let places = inside(&mask, 100);
        assert_eq!(places.len(), 25);
        assert!(
            places
                .iter()
                .all(|p| (6..11).contains(&(p % 20)) && (6..11).contains(&(p / 20)))
        );
        assert!(inside(&Mask::filled(1, 1, 1.0), 10).is_empty());
    }

    #[test]
    fn curvature_gives_the_deviation_of_a_gaussian() {
        let gaussian =
            |[a, b, c]: [f64; 3]| (a / 0.1).powi(2) + (b / 0.2).powi(2) + (c / 0.3).powi(2);
        let [a, b] = deviation(gaussian, [0.0; 3]);
        assert!((a - 0.1).abs() < 1e-3 && (b - 0.2).abs() < 1e-3);
    }
}
