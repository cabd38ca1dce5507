//! The paths of all poses, as Gaussian processes.
//!
//! What the alignment says of lamp i in pose p is path_p(t_i) + own_i + noise, all up to a constant. The path is smooth
//! in time and another one in each pose. `own_i` is what the lamp's shadows and highlights pretend, the same in every
//! pose; tracking frames, which are all lit alike, have none. The sizes of the three and the path's smoothness are those
//! of greatest likelihood, for all poses together; there is motion if the odds for it are large.

use super::cholesky::Cholesky;

/// What the alignment says of one pose.
pub struct Series<'a> {
    /// When, from 0 to 1.
    pub times: &'a [f32],
    pub values: Vec<f64>,
    /// Relative to each other.
    pub variances: Vec<f64>,
}

/// Where something is at some times, and the standard deviations of that.
#[derive(Clone, Debug)]
pub struct Path {
    pub mean: Vec<f64>,
    pub deviation: Vec<f64>,
}

/// Log odds from which on there is motion. Of eight subjects that sat still none had more than 11.5; one that swayed by
/// three pixels of 256 had 48.
const LOG_ODDS: f64 = 12.0;
/// Fewer pictures of a pose do not tell a path from chance.
const LEAST: usize = 4;
/// Sizes of path, own part and noise that are tried, relative to the values' spread.
const SIZES: [f64; 7] = [0.1, 0.2, 0.35, 0.6, 1.0, 1.5, 2.2];
/// Smoothness that is tried: times over which the path forgets where it was.
const LENGTHS: [f64; 4] = [0.1, 0.16, 0.25, 0.4];

#[derive(Clone, Copy, Debug)]
struct Sizes {
    path: f64,
    length: f64,
    own: f64,
    noise: f64,
}

/// The paths of all poses at times `at`, whose mean over these is 0. If nothing moves for sure, they are 0 and their
/// deviations say what could be unseen. `None` if too little is known to tell. `own`: whether lamps may pretend motion.
pub fn find(series: &[Series], at: &[f32], own: bool) -> Option<Vec<Path>> {
    let (poses, n) = (series.len(), series.first()?.times.len());
    if series.iter().any(|s| s.times != series[0].times) {
        return find_apart(series, at, own);
    }
    if n < LEAST {
        return None;
    }
    let problem = Problem::new(series)?;
    let (still, _) = problem.best(false, own)?;
    let (moving, sizes) = problem.best(true, own)?;
    let mut paths = problem.paths(&sizes, at, poses)?;
    if moving - still <= LOG_ODDS {
        // What could be there without being seen.
        for path in &mut paths {
            for (mean, deviation) in path.mean.iter_mut().zip(&mut path.deviation) {
                *deviation = deviation.hypot(*mean);
                *mean = 0.0;
            }
        }
    }
    Some(paths)
}

/// Poses that were taken at different times, each by itself.
fn find_apart(series: &[Series], at: &[f32], own: bool) -> Option<Vec<Path>> {
    let each = series
        .iter()
        .map(|one| find(std::slice::from_ref(one), at, own));
    let paths: Option<Vec<Vec<Path>>> = each.collect();
    paths.map(|paths| paths.into_iter().flatten().collect())
}

/// The values of all poses, turned so that their mean over poses comes first: of the parts, only that contains what is
/// the same in each pose.
struct Problem {
    times: Vec<f64>,
    /// Differences from the mean over time, in orthonormal axes (Helmert's): one row for each part.
    parts: Vec<Vec<f64>>,
    /// Mean relative variances.
    variances: Vec<f64>,
    spread: f64,
    poses: usize,
}

impl Problem {
    fn new(series: &[Series]) -> Option<Self> {
        let (poses, n) = (series.len(), series[0].values.len());
        let times = series[0].times.iter().map(|&t| f64::from(t)).collect();
        let mut variances: Vec<f64> = (0..n)
            .map(|i| series.iter().map(|s| s.variances[i]).sum::<f64>() / poses as f64)
            .collect();
        let mean = variances.iter().sum::<f64>() / n as f64;
        variances.iter_mut().for_each(|v| *v /= mean);
        let values: Vec<Vec<f64>> = series.iter().map(|s| contrasts(&s.values)).collect();
        let parts = (0..poses)
            .map(|part| {
                (0..n - 1)
                    .map(|i| {
                        (0..poses)
                            .map(|p| turn(part, p, poses) * values[p][i])
                            .sum()
                    })
                    .collect()
            })
            .collect();
        let squares: f64 = values.iter().flatten().map(|v| v * v).sum();
        let spread = (squares / (poses * (n - 1)) as f64).sqrt();
        (spread > 0.0 && spread.is_finite()).then_some(Self {
            times,
            parts,
            variances,
            spread,
            poses,
        })
    }

    /// The covariance of the path at the values' times.
    fn smooth(&self, sizes: &Sizes) -> Vec<f64> {
        let n = self.times.len();
        let at = |i: usize| kernel(self.times[i / n], self.times[i % n], sizes);
        (0..n * n).map(at).collect()
    }

    /// The factored covariance of the first part, which holds what is the same in each pose, or of the others.
    fn covariance(&self, sizes: &Sizes, first: bool) -> Option<Cholesky> {
        let n = self.times.len();
        let mut matrix = self.smooth(sizes);
        for i in 0..n {
            let own = if first {
                self.poses as f64 * sizes.own.powi(2)
            } else {
                0.0
            };
            matrix[i * n + i] += sizes.noise.powi(2) * self.variances[i] + own;
        }
        Cholesky::new(contrasted(&matrix, n), n - 1)
    }

    fn log_likelihood(&self, sizes: &Sizes) -> Option<f64> {
        let (first, others) = (
            self.covariance(sizes, true)?,
            self.covariance(sizes, false)?,
        );
        let of = |part: &Vec<f64>, covariance: &Cholesky| {
            let z = covariance.forward(part);
            -0.5 * z.iter().map(|v| v * v).sum::<f64>() - covariance.half_log_determinant()
        };
        let rest: f64 = self.parts[1..].iter().map(|part| of(part, &others)).sum();
        Some(of(&self.parts[0], &first) + rest)
    }

    /// The greatest log likelihood, and of what.
    fn best(&self, moves: bool, own: bool) -> Option<(f64, Sizes)> {
        let scaled = |size: &f64| size * self.spread;
        let owns: Vec<f64> = match own && self.poses > 1 {
            true => std::iter::once(0.0)
                .chain(SIZES.iter().map(scaled))
                .collect(),
            false => vec![0.0],
        };
        let paths: Vec<(f64, f64)> = match moves {
            true => (SIZES.iter())
                .flat_map(|size| LENGTHS.iter().map(move |&length| (scaled(size), length)))
                .collect(),
            false => vec![(0.0, 1.0)],
        };
        let mut best: Option<(f64, Sizes)> = None;
        for &(path, length) in &paths {
            for &own in &owns {
                for noise in SIZES
                    .iter()
                    .map(scaled)
                    .chain([0.05 * self.spread, 0.02 * self.spread])
                {
                    let sizes = Sizes {
                        path,
                        length,
                        own,
                        noise,
                    };
                    let likelihood = self.log_likelihood(&sizes);
                    if let Some(l) = likelihood.filter(|l| best.is_none_or(|b| *l > b.0)) {
                        best = Some((l, sizes));
                    }
                }
            }
        }
        best
    }

    /// The paths of all poses at times `at`.
    fn paths(&self, sizes: &Sizes, at: &[f32], poses: usize) -> Option<Vec<Path>> {
        let (first, others) = (
            self.covariance(sizes, true)?,
            self.covariance(sizes, false)?,
        );
        let at: Vec<f64> = at.iter().map(|&t| f64::from(t)).collect();
        // The covariance of the path, less its mean over `at`, with the values.
        let rows: Vec<Vec<f64>> = (at.iter())
            .map(|&a| self.times.iter().map(|&b| kernel(a, b, sizes)).collect())
            .collect();
        let mean: Vec<f64> = (0..self.times.len())
            .map(|i| rows.iter().map(|row| row[i]).sum::<f64>() / at.len() as f64)
            .collect();
        let cross: Vec<Vec<f64>> = (rows.iter())
            .map(|row| {
                contrasts(
                    &row.iter()
                        .zip(&mean)
                        .map(|(a, b)| a - b)
                        .collect::<Vec<_>>(),
                )
            })
            .collect();
        let before = centred_variances(&at, sizes);
        let of = |part: usize| -> (Vec<f64>, Vec<f64>) {
            let covariance = if part == 0 { &first } else { &others };
            let solved = covariance.solve(&self.parts[part]);
            (cross.iter().zip(&before))
                .map(|(row, before)| {
                    let mean: f64 = row.iter().zip(&solved).map(|(a, b)| a * b).sum();
                    let z = covariance.forward(row);
                    let variance = before - z.iter().map(|v| v * v).sum::<f64>();
                    (mean, variance.max(0.0))
                })
                .unzip()
        };
        let parts: Vec<_> = (0..poses).map(of).collect();
        let path = |pose: usize| {
            let sum = |of: &dyn Fn(f64, usize) -> f64| -> f64 {
                let turned = (0..poses).map(|part| of(turn(part, pose, poses), part));
                turned.sum()
            };
            let mean: Vec<f64> = (0..at.len())
                .map(|i| sum(&|w, part| w * parts[part].0[i]))
                .collect();
            let deviation = (0..at.len())
                .map(|i| sum(&|w, part| w * w * parts[part].1[i]).sqrt())
                .collect();
            Path { mean, deviation }
        };
        Some((0..poses).map(path).collect())
    }
}

/// The covariance of the path at two times.
fn kernel(a: f64, b: f64, sizes: &Sizes) -> f64 {
    sizes.path.powi(2) * (-0.5 * ((a - b) / sizes.length).powi(2)).exp()
}

/// Variances of the path less its mean over the times.
fn centred_variances(at: &[f64], sizes: &Sizes) -> Vec<f64> {
    let n = at.len() as f64;
    let means: Vec<f64> = at
        .iter()
        .map(|&a| at.iter().map(|&b| kernel(a, b, sizes)).sum::<f64>() / n)
        .collect();
    let all = means.iter().sum::<f64>() / n;
    means
        .iter()
        .map(|m| sizes.path.powi(2) - 2.0 * m + all)
        .collect()
}

/// Row `row` of an orthonormal n × n matrix whose first row is constant (Helmert's).
fn turn(row: usize, column: usize, n: usize) -> f64 {
    match row {
        0 => 1.0 / (n as f64).sqrt(),
        _ => {
            let scale = 1.0 / ((row * (row + 1)) as f64).sqrt();
            match column.cmp(&row) {
                std::cmp::Ordering::Less => scale,
                std::cmp::Ordering::Equal => -(row as f64) * scale,
                std::cmp::Ordering::Greater => 0.0,
            }
        }
    }
}

/// All of Helmert's rows but the first, times `values`: what is left without their mean.
fn contrasts(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    (1..n)
        .map(|row| (0..=row).map(|i| turn(row, i, n) * values[i]).sum())
        .collect()
}

/// The covariance of the contrasts of values with covariance `matrix`.
fn contrasted(matrix: &[f64], n: usize) -> Vec<f64> {
    let half: Vec<Vec<f64>> = matrix.chunks(n).map(contrasts).collect();
    let columns = (0..n - 1).map(|j| contrasts(&half.iter().map(|row| row[j]).collect::<Vec<_>>()));
    let columns: Vec<Vec<f64>> = columns.collect();
    (0..n - 1)
        .flat_map(|i| columns.iter().map(move |column| column[i]))
        .collect()
}
