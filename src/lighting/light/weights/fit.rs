//! The fit: lamp energies under which simple subjects look most like they do under the environment.
//!
//! A viewer sees pictures, not panoramas, and sees ratios. Light a thousand times dimmer than the sun decides the
//! look of a face that the sun does not reach. So the fit compares pictures of [`sitters`] under environment and
//! lamps, pixel by pixel, in display values v^(1/2.2) at the exposure that suits each picture.
//!
//! The environment's light, blurred a little, is sampled in [`POINTS`] directions, and so is each lamp's footprint
//! (a heat kernel of the lamp's spread), with the same blur. Three steps follow, each a continuous function of that
//! light:
//!
//! 1. A start without a subject: both are blurred to half the lamps' spacing and fitted by least squares, each
//!    difference divided by the radiance to the power ¼.
//! 2. Least squares over the pixels of all sitters. A pixel's weight is the slope of the display curve between its
//!    true value and its value at the start, so that the squares are those of display values. Each sitter's errors are
//!    divided by those at the start: ratios count, as in decibels, and no sitter outweighs another. The problem of
//!    step 1 is added: it constrains lamps that no sitter sees, and prefers no particular subject.
//! 3. One factor for all lamps, a change of exposure, restores the environment's energy.

use super::super::Rig;
use super::heat::{HeatKernel, time_of};
use super::least_squares::Normal;
use super::nodes::Nodes;
use super::points::{POINTS, points, spiral};
use super::sitter::{Sitter, sitters};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Standard deviation of that light's blur in degrees; enough for a smooth result at this spacing.
const BLUR_DEG: f64 = 5.0;
/// Largest number of lamps fitted with sitters. Beyond it the start alone is as good, and faster.
const MOST_LAMPS: usize = 64;
/// Weight of step 1 in step 2: as much as all sitters together, because real subjects differ from each of them.
const START_SHARE: f64 = 1.0;
/// Weight of the energy sum in each problem, relative to the full problem.
const SUM_SHARE: f64 = 0.1;
/// Exponent of the display curve.
const DISPLAY: f64 = 1.0 / 2.2;
/// Exposed value of a picture's 95th percentile.
const EXPOSED: f64 = 0.5;
/// Flare added to exposed values: the light that a room adds to a screen's black.
const FLARE: f64 = 0.002;

/// A rig's lamps, prepared for the fit.
#[derive(Clone)]
pub(super) struct Fit {
    /// Lamps of each direction.
    lamps: Vec<Vec<usize>>,
    /// Blur from the light at the points: for each equation of the start, points with their shares.
    blur: Vec<Vec<(u16, f64)>>,
    /// Blurred footprints of the lamps, in the same form.
    footprints: Vec<Vec<(u16, f64)>>,
    /// Sitters with their pixels' values under one unit of each lamp's energy, pixel by pixel.
    pictures: Vec<(&'static Sitter, Vec<f64>)>,
}

/// Points that a texel's light reaches, with the amount at each, per steradian.
pub(super) struct Reach {
    points: Vec<DVec3>,
    kernel: HeatKernel,
    end: f64,
}

impl Reach {
    pub fn new() -> Self {
        let (kernel, end) = HeatKernel::new(time_of(BLUR_DEG.to_radians())).ended(1e-3);
        Self { points: points(), kernel, end }
    }

    pub fn amounts(&self, direction: DVec3) -> Vec<(u16, f32)> {
        let near = self.points.iter().enumerate().filter_map(|(i, point)| {
            let cosine = point.dot(direction);
            (cosine > self.end).then(|| (i as u16, self.kernel.at(cosine) as f32))
        });
        near.collect()
    }
}

impl Fit {
    /// Lamps of the non-empty directions.
    pub fn new(rig: &Rig, nodes: &Nodes) -> Self {
        let directions: Vec<DVec3> = nodes.real().copied().collect();
        let blurred = time_of(BLUR_DEG.to_radians());
        // A Gaussian of half the spacing: footprints overlap just enough to close the gaps. 30° already blurs a
        // hemisphere.
        let sigma = (0.5 * nodes.spacing()).clamp(BLUR_DEG.to_radians(), 30f64.to_radians());
        let times: Vec<f64> = nodes.lamps.iter().map(|lamps| time(rig, lamps)).collect();
        let points = points();
        // Blur missing from the points' own. It must reach from point to point, or the points stay unchanged.
        let lacking = time_of(sigma) - blurred;
        let enough = lacking < blurred;
        let places =
            if enough { points.clone() } else { spiral(((40.0 / (sigma * sigma)) as usize).clamp(64, POINTS)) };
        let (further, end) = HeatKernel::new(lacking.max(blurred)).ended(1e-4);
        let blur = places.par_iter().enumerate().map(|(i, place)| {
            if enough {
                return vec![(i as u16, 1.0)];
            }
            let near = points.iter().enumerate().filter_map(|(i, point)| {
                let cosine = point.dot(*place);
                (cosine > end).then(|| (i as u16, further.at(cosine)))
            });
            let near: Vec<(u16, f64)> = near.collect();
            let sum: f64 = near.iter().map(|(_, share)| share).sum();
            near.into_iter().map(|(i, share)| (i, share / sum)).collect()
        });
        let blur: Vec<_> = blur.collect();
        // The lamps' footprints at the points go through the same sums as the environment. Lamps of equal spread
        // share a kernel.
        let mut spreads = times.clone();
        spreads.sort_by(f64::total_cmp);
        spreads.dedup();
        let kernels: Vec<HeatKernel> = (spreads.par_iter()).map(|t| HeatKernel::new(t + blurred)).collect();
        let kernels: Vec<&HeatKernel> =
            (times.iter()).map(|t| &kernels[spreads.partition_point(|spread| spread < t)]).collect();
        let at_points: Vec<Vec<f64>> = points
            .par_iter()
            .map(|point| {
                let pairs = directions.iter().zip(&kernels);
                pairs.map(|(lamp, kernel)| kernel.at(lamp.dot(*point))).collect()
            })
            .collect();
        let summed = |shares: &mut dyn Iterator<Item = (usize, f64)>| -> Vec<f64> {
            let mut sum = vec![0.0; directions.len()];
            for (point, share) in shares {
                let pairs = sum.iter_mut().zip(&at_points[point]);
                pairs.for_each(|(sum, lamp)| *sum += share * lamp);
            }
            sum
        };
        let footprints = blur.par_iter().map(|shares| {
            let row = summed(&mut shares.iter().map(|&(i, share)| (usize::from(i), share)));
            let most = row.iter().copied().fold(0.0, f64::max);
            let lit = row.into_iter().enumerate().filter(|(_, v)| *v > 1e-4 * most);
            lit.map(|(i, v)| (i as u16, v)).collect()
        });
        let footprints = footprints.collect();
        let pictures = if directions.len() <= MOST_LAMPS {
            sitters()
                .par_iter()
                .map(|sitter| {
                    let pixels = sitter.pixels.iter().flat_map(|pixel| {
                        summed(&mut pixel.iter().map(|&(i, v)| (usize::from(i), solid_angle() * f64::from(v))))
                    });
                    (sitter, pixels.collect())
                })
                .collect()
        } else {
            vec![]
        };
        Self { lamps: nodes.lamps.clone(), blur, footprints, pictures }
    }

    /// Lamps of each direction.
    pub fn lamps(&self) -> &[Vec<usize>] {
        &self.lamps
    }

    /// Energies per channel of the directions with lamps, for the light at the points: not negative, with the sum
    /// `total`.
    pub fn energies(&self, light: &[[f64; 3]], total: [f64; 3]) -> Vec<[f64; 3]> {
        let channels: Vec<Vec<f64>> = (0..3)
            .into_par_iter()
            .map(|c| {
                if total[c].is_nan() || total[c] <= 0.0 {
                    return vec![0.0; self.lamps.len()];
                }
                // In units of the environment's energy, so that its brightness does not matter.
                let light: Vec<f64> = light.iter().map(|v| v[c] / total[c]).collect();
                self.shares(&light).iter().map(|x| x * total[c]).collect()
            })
            .collect();
        (0..self.lamps.len()).map(|i| [0, 1, 2].map(|c| channels[c][i])).collect()
    }

    /// Share of the energy for each lamp.
    fn shares(&self, light: &[f64]) -> Vec<f64> {
        let n = self.lamps.len();
        let mut x = vec![1.0 / n as f64; n];
        if n > 1 {
            let start = self.start(light);
            let mut problem = Normal::new(n);
            problem.add_all(&start, 1.0);
            problem.least(&mut x);
            if !self.pictures.is_empty() {
                let mut problem = self.looks(light, &x);
                problem.add_all(&start, START_SHARE);
                problem.least(&mut x);
            }
        }
        let sum: f64 = x.iter().sum();
        if sum > 0.0 {
            x.iter_mut().for_each(|x| *x /= sum);
        } else {
            x.fill(1.0 / n as f64);
        }
        x
    }

    /// Step 1: the environment as a sum of footprints.
    fn start(&self, light: &[f64]) -> Normal {
        let blurred: Vec<f64> = (self.blur.iter())
            .map(|shares| shares.iter().map(|&(i, share)| share * light[usize::from(i)]).sum())
            .collect();
        let most = blurred.iter().copied().fold(0.0, f64::max).max(f64::MIN_POSITIVE);
        let weight = |radiance: f64| 1.0 / (radiance + 1e-4 * most).sqrt();
        let whole: f64 = blurred.iter().map(|v| weight(*v) * v * v).sum();
        let mut problem = Normal::new(self.lamps.len());
        for (row, value) in self.footprints.iter().zip(&blurred) {
            problem.add_sparse(row, *value, weight(*value) / whole.max(f64::MIN_POSITIVE));
        }
        problem.add_sum(SUM_SHARE);
        problem
    }

    /// Step 2: the sitters' pictures, in display values between the true picture and the one under lamps with
    /// shares `x`.
    fn looks(&self, light: &[f64], x: &[f64]) -> Normal {
        let n = self.lamps.len();
        let mut parts = Vec::new();
        let mut whole = 0.0;
        for (sitter, picture) in &self.pictures {
            let truth: Vec<f64> = (sitter.pixels.iter())
                .map(|pixel| {
                    let seen = pixel.iter().map(|&(i, v)| f64::from(v) * light[usize::from(i)]);
                    solid_angle() * seen.sum::<f64>()
                })
                .collect();
            let level = percentile_95(&truth);
            if level <= 0.0 {
                continue;
            }
            let exposure = EXPOSED / level;
            let mut error = 0.0;
            let mut weights: Vec<f64> = truth
                .iter()
                .zip(picture.chunks_exact(n))
                .map(|(truth, lamps)| {
                    let start: f64 = lamps.iter().zip(x).map(|(lamp, x)| lamp * x).sum();
                    let [a, b] = [*truth, start].map(|v| exposure * v + FLARE);
                    let [shown, shown_start] = [a, b].map(|v| v.powf(DISPLAY));
                    error += (shown_start - shown).powi(2);
                    let tangent = DISPLAY * shown / a;
                    let slope = if (b - a).abs() < 1e-3 * a { tangent } else { (shown_start - shown) / (b - a) };
                    (exposure * slope).powi(2)
                })
                .collect();
            // Errors below a three-thousandth of white are ignored.
            let scale = 1.0 / (error + 1e-7 * truth.len() as f64);
            weights.iter_mut().for_each(|w| *w *= scale);
            whole += weights.iter().zip(&truth).map(|(w, v)| w * v * v).sum::<f64>();
            parts.push((truth, weights, picture));
        }
        let mut problem = Normal::new(n);
        for (truth, weights, picture) in parts {
            for ((row, value), weight) in picture.chunks_exact(n).zip(truth).zip(weights) {
                problem.add(row, value, weight / whole);
            }
        }
        problem.add_sum(SUM_SHARE);
        problem
    }
}

/// Solid angle of a point in steradians.
fn solid_angle() -> f64 {
    4.0 * PI / POINTS as f64
}

/// Heat-kernel time for the mean square spread of lamps in one direction.
fn time(rig: &Rig, lamps: &[usize]) -> f64 {
    let square = |&lamp: &usize| {
        let spread = f64::from(rig.lamps[lamp].spread_deg).to_radians();
        if spread.is_finite() { spread * spread } else { 0.0 }
    };
    let mean = lamps.iter().map(square).sum::<f64>() / lamps.len().max(1) as f64;
    (mean / 4.0).min(0.25)
}

/// The 95th percentile, interpolated linearly.
fn percentile_95(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_unstable_by(f64::total_cmp);
    let place = 0.95 * (values.len().max(1) - 1) as f64;
    let below = place as usize;
    let at = |i: usize| values.get(i.min(values.len().saturating_sub(1))).copied().unwrap_or(0.0);
    at(below) + place.fract() * (at(below + 1) - at(below))
}
