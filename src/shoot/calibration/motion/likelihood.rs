//! Likelihood of the alignment's shifts, as a Gaussian process.
//!
//! The measured shift of body or head under lamp i in pose p is, up to a constant, path_p(t_i) + own_i + pose_pi +
//! noise. The path is smooth in time and differs in each pose. `own_i` is the false shift from the lamp's shadows
//! and highlights in every pose, `pose_pi` the false shift in that pose only; both are similar for neighbouring
//! lamps. Tracking frames all have the same light and neither term. The noise is correlated over lamps, and between
//! body and head, according to the alignment's equations.

use super::alignment::SHIFTS;
use super::helmert::{contrasted, contrasts, turn};
use crate::cholesky::Cholesky;
use glam::Vec3;

/// Shifts of one pose from the alignment.
pub struct Series<'a> {
    /// Times, from 0 to 1.
    pub times: &'a [f32],
    pub shifts: &'a [[f64; SHIFTS]],
    /// Covariance of the shifts' errors, up to a factor common to all poses.
    pub noise: &'a [f64],
}

/// Standard deviations relative to the picture's side, for the body and for the head relative to it.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Factor on the alignment's covariances.
    pub noise: f64,
    pub own: [f64; 2],
    pub pose: [f64; 2],
    /// Share of the false shifts common to near lamps.
    pub near: f64,
    /// Standard deviation of the path, the same for body and head.
    pub path: f64,
    /// Correlation time of the path.
    pub length: f64,
}

/// Positions of body and face, to the right and down, relative to the picture's side, and their variances.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    pub way: [[f64; 2]; 2],
    pub variance: [[f64; 2]; 2],
}

/// Distance, as a chord of the unit sphere, over which false shifts are similar.
const NEAR: f32 = 0.6;

/// Shifts of all poses, rotated (Helmert) so that their mean over poses comes first: only that part contains the
/// common shift of all poses. Each part holds the four components one after the other, without the means over time.
pub struct Problem {
    times: Vec<f64>,
    parts: Vec<Vec<f64>>,
    /// Mean covariance of the noise.
    noise: Vec<f64>,
    /// Correlation of false shifts between near lamps.
    near: Vec<f64>,
    poses: usize,
}

/// Factored covariances of the first part and of the others.
struct Factors {
    first: Cholesky,
    others: Cholesky,
}

impl Problem {
    /// Problem of series with the same times. `lamps` holds each lamp's direction (`None` if unknown) and is `None`
    /// for uniform light.
    pub fn new(series: &[Series], lamps: Option<&[Option<Vec3>]>) -> Option<Self> {
        let (poses, n) = (series.len(), series.first()?.times.len());
        let values: Vec<Vec<f64>> = series.iter().map(components).collect();
        let sum = |part: usize, i: usize| -> f64 { (0..poses).map(|p| turn(part, p, poses) * values[p][i]).sum() };
        let length = SHIFTS * (n - 1);
        let parts: Vec<Vec<f64>> = (0..poses).map(|part| (0..length).map(|i| sum(part, i)).collect()).collect();
        let mut noise = vec![0.0; length * length];
        for one in series {
            for (sum, v) in noise.iter_mut().zip(noise_covariance(one)) {
                *sum += v / poses as f64;
            }
        }
        let alike = |a: usize, b: usize| match lamps.map(|l| [a, b].map(|i| l.get(i).copied().flatten())) {
            _ if a == b => 1.0,
            Some([Some(a), Some(b)]) => f64::from((-0.5 * (a.distance(b) / NEAR).powi(2)).exp()),
            _ => 0.0,
        };
        let alike: Vec<f64> = (0..n * n).map(|i| alike(i / n, i % n)).collect();
        let is_sound = parts.iter().flatten().chain(&noise).all(|v| v.is_finite());
        is_sound.then(|| Self {
            times: series[0].times.iter().map(|&t| f64::from(t)).collect(),
            parts,
            noise,
            near: contrasted(&alike, n),
            poses,
        })
    }

    pub fn poses(&self) -> usize {
        self.poses
    }

    /// `None` if the covariances are not positive definite.
    fn factors(&self, sizes: &Sizes) -> Option<Factors> {
        let n = self.times.len();
        let smooth: Vec<f64> = (0..n * n).map(|i| kernel(self.times[i / n], self.times[i % n], sizes)).collect();
        let smooth = contrasted(&smooth, n);
        let (m, length) = (n - 1, SHIFTS * (n - 1));
        let factor = |own_share: f64| {
            let mut matrix: Vec<f64> = self.noise.iter().map(|v| sizes.noise * v).collect();
            for component in 0..SHIFTS {
                let [own, pose] = [sizes.own, sizes.pose].map(|size| size[component / 2]);
                let pretended = own_share * own.powi(2) + pose.powi(2);
                for (i, smooth) in smooth.iter().enumerate() {
                    let (a, b) = (i / m, i % m);
                    let alone = (1.0 - sizes.near) * f64::from(a == b);
                    matrix[(component * m + a) * length + component * m + b] +=
                        smooth + pretended * (alone + sizes.near * self.near[i]);
                }
            }
            Cholesky::new(matrix, length)
        };
        Some(Factors { first: factor(self.poses as f64)?, others: factor(0.0)? })
    }

    /// `None` if the sizes are invalid.
    pub fn log_likelihood(&self, sizes: &Sizes) -> Option<f64> {
        let factors = self.factors(sizes)?;
        let term = |part: &Vec<f64>, covariance: &Cholesky| {
            let z = covariance.forward(part);
            -0.5 * z.iter().map(|v| v * v).sum::<f64>() - covariance.half_log_determinant()
        };
        let rest: f64 = self.parts[1..].iter().map(|part| term(part, &factors.others)).sum();
        Some(term(&self.parts[0], &factors.first) + rest)
    }

    /// Positions of body and face in each pose at times `at`, with mean 0, under these sizes.
    pub fn places(&self, sizes: &Sizes, at: &[f64]) -> Option<Vec<Vec<Place>>> {
        let factors = self.factors(sizes)?;
        let n = self.times.len();
        // Covariance of the path with the shifts, minus its mean over `at`.
        let rows: Vec<Vec<f64>> =
            (at.iter()).map(|&a| self.times.iter().map(|&b| kernel(a, b, sizes)).collect()).collect();
        let mean: Vec<f64> = (0..n).map(|i| rows.iter().map(|row| row[i]).sum::<f64>() / at.len() as f64).collect();
        let less =
            |row: &Vec<f64>| -> Vec<f64> { contrasts(&row.iter().zip(&mean).map(|(a, b)| a - b).collect::<Vec<_>>()) };
        let rows: Vec<Vec<f64>> = rows.iter().map(less).collect();
        let before = centred_variances(at, sizes);
        let covariances = [&factors.first, &factors.others];
        let spreads = covariances.map(|c| spreads(c, &rows, &before));
        let solved: Vec<Vec<f64>> =
            (self.parts.iter().enumerate()).map(|(part, values)| covariances[part.min(1)].solve(values)).collect();
        let place = |pose: usize, i: usize| {
            let mut place = Place::default();
            for (part, solved) in solved.iter().enumerate() {
                let share = turn(part, pose, self.poses);
                let component = |k: usize| -> f64 {
                    let own = &solved[k * (n - 1)..(k + 1) * (n - 1)];
                    rows[i].iter().zip(own).map(|(a, b)| a * b).sum()
                };
                for axis in 0..2 {
                    let (body, head) = (component(axis), component(axis + 2));
                    place.way[0][axis] += share * body;
                    place.way[1][axis] += share * (body + head);
                }
                let spread = &spreads[part.min(1)][i];
                let both = place.variance.iter_mut().flatten();
                for (variance, spread) in both.zip(spread.iter().flatten()) {
                    *variance += share * share * spread;
                }
            }
            place
        };
        let poses = 0..self.poses;
        Some(poses.map(|pose| (0..at.len()).map(|i| place(pose, i)).collect()).collect())
    }
}

/// Remaining uncertainty of a part at each time: variances of body and face in both directions.
fn spreads(covariance: &Cholesky, rows: &[Vec<f64>], before: &[f64]) -> Vec<[[f64; 2]; 2]> {
    let m = rows[0].len();
    let known = |row: &Vec<f64>, component: usize| {
        let mut padded = vec![0.0; SHIFTS * m];
        padded[component * m..(component + 1) * m].copy_from_slice(row);
        covariance.forward(&padded)
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let spread = |(row, before): (&Vec<f64>, &f64)| {
        let along = |axis: usize| -> [f64; 2] {
            let (body, head) = (known(row, axis), known(row, axis + 2));
            let own = dot(&body, &body);
            let both = own + dot(&head, &head) + 2.0 * dot(&body, &head);
            [(before - own).max(0.0), (2.0 * before - both).max(0.0)]
        };
        let [right, down] = [along(0), along(1)];
        [0, 1].map(|which: usize| [right[which], down[which]])
    };
    rows.iter().zip(before).map(spread).collect()
}

/// Contrasts of each component of the shifts.
fn components(series: &Series) -> Vec<f64> {
    (0..SHIFTS).flat_map(|k| contrasts(&series.shifts.iter().map(|s| s[k]).collect::<Vec<_>>())).collect()
}

/// Noise covariance of the contrasts.
fn noise_covariance(series: &Series) -> Vec<f64> {
    let n = series.shifts.len();
    let (m, length) = (n - 1, SHIFTS * (n - 1));
    let mut all = vec![0.0; length * length];
    for a in 0..SHIFTS {
        for b in 0..SHIFTS {
            let noise = |i: usize| series.noise[((i / n) * SHIFTS + a) * n * SHIFTS + (i % n) * SHIFTS + b];
            let block = contrasted(&(0..n * n).map(noise).collect::<Vec<_>>(), n);
            for (i, v) in block.iter().enumerate() {
                all[(a * m + i / m) * length + b * m + i % m] = *v;
            }
        }
    }
    all
}

/// Covariance of the path at two times (Matérn, smoothness 3/2: people drift and sway at once).
fn kernel(a: f64, b: f64, sizes: &Sizes) -> f64 {
    let apart = 3f64.sqrt() * (a - b).abs() / sizes.length;
    sizes.path.powi(2) * (1.0 + apart) * (-apart).exp()
}

/// Variances of the path minus its mean over the times.
fn centred_variances(at: &[f64], sizes: &Sizes) -> Vec<f64> {
    let n = at.len() as f64;
    let means: Vec<f64> = at.iter().map(|&a| at.iter().map(|&b| kernel(a, b, sizes)).sum::<f64>() / n).collect();
    let all = means.iter().sum::<f64>() / n;
    means.iter().map(|m| sizes.path.powi(2) - 2.0 * m + all).collect()
}
