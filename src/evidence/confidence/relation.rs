//! Expected error as a function of two signs: the light that the best exemplar leaves unexplained, and the spread of
//! the exemplars. Fitted to poses that are predicted from the others.
//!
//! With e a cell's error, d its distance and s its spread, ln e = a + b ln d + c ln s is fitted over the cells of all
//! left-out poses, each pose weighted equally. The cells of one pose err together, so coverage is counted by pose, as
//! in conformal prediction (Vovk et al. 2005): each pose gives the factor that raises the relation until it holds for
//! the required share of its cells, and for its whole picture. If a new picture relates to the k poses as each of them
//! relates to the others, the largest factor holds for it with probability k / (k + 1).

use super::lamps::LampErrors;
use serde::{Deserialize, Serialize};

/// Distances, spreads and errors below these count as zero.
const LEAST_DISTANCE: f64 = 1e-3;
const LEAST_ERROR: f64 = 1e-4;
/// Largest power of distance, or of spread, with which an error may grow.
const MOST_SLOPE: f64 = 2.0;

/// Signs of a cell's error that need no truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sign {
    /// Root mean square of the logarithm of frame over best prediction under the interview's light.
    pub distance: f64,
    /// Standard deviation of the exemplars' predictions about their blend, as square roots of light.
    pub spread: f64,
}

impl Sign {
    fn logs(&self) -> [f64; 2] {
        [self.distance.max(LEAST_DISTANCE).ln(), self.spread.max(LEAST_ERROR).ln()]
    }
}

/// Logarithms of a cell's signs and error.
type Logs = ([f64; 2], f64);

/// Errors of a left-out pose, by cell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseErrors {
    pub signs: Vec<Sign>,
    /// Mean squared difference of encoded values, over lamps and pixels.
    pub squared_errors: Vec<f64>,
    #[serde(default)]
    pub lamps: LampErrors,
}

/// Error as a function of distance and spread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Relation {
    intercept: f64,
    /// Powers of distance and of spread.
    slopes: [f64; 2],
    /// Factors at which half of the poses, and all of them, have the required share of cells within the bound.
    cell_factors: [f64; 2],
    /// The same for the root mean square error of the whole picture.
    frame_factors: [f64; 2],
    /// Number of poses in the fit.
    pub poses: usize,
}

impl Relation {
    /// Learns the relation from the poses; `share` is the share of a picture's cells that must lie within the bound.
    /// None without two poses that have cells.
    pub fn learn(poses: &[PoseErrors], share: f64) -> Option<Self> {
        let logs: Vec<Vec<Logs>> = (poses.iter())
            .map(|pose| {
                let pairs = pose.signs.iter().zip(&pose.squared_errors);
                let usable =
                    pairs.filter(|(sign, e)| sign.distance.is_finite() && sign.spread.is_finite() && e.is_finite());
                let log = |(sign, e): (&Sign, &f64)| (sign.logs(), e.sqrt().max(LEAST_ERROR).ln());
                usable.map(log).collect()
            })
            .filter(|cells: &Vec<_>| !cells.is_empty())
            .collect();
        if logs.len() < 2 {
            return None;
        }
        let mean = |value: &dyn Fn(&Logs) -> f64| -> f64 {
            let means = logs.iter().map(|cells| cells.iter().map(value).sum::<f64>() / cells.len() as f64);
            means.sum::<f64>() / logs.len() as f64
        };
        let (x, y) = ([0, 1].map(|i| mean(&|c| c.0[i])), mean(&|c| c.1));
        let among = |i: usize, j: usize| mean(&|c| (c.0[i] - x[i]) * (c.0[j] - x[j]));
        let with = |i: usize| mean(&|c| (c.0[i] - x[i]) * (c.1 - y));
        let slopes = slopes([[among(0, 0), among(0, 1)], [among(1, 0), among(1, 1)]], [with(0), with(1)]);
        let mut found = Self {
            intercept: y - slopes[0] * x[0] - slopes[1] * x[1],
            slopes,
            cell_factors: [1.0; 2],
            frame_factors: [1.0; 2],
            poses: logs.len(),
        };
        let cell_ratios = logs.iter().map(|cells| {
            let mut ratios: Vec<f64> = (cells.iter()).map(|(sign, e)| (e - found.log(*sign)).exp()).collect();
            quantile(&mut ratios, share)
        });
        let cell_ratios: Vec<f64> = cell_ratios.collect();
        let frame_ratios = logs.iter().map(|cells| {
            let said: f64 = (cells.iter()).map(|(sign, _)| (2.0 * found.log(*sign)).exp()).sum();
            let real: f64 = cells.iter().map(|(_, e)| (2.0 * e).exp()).sum();
            (real / said).sqrt()
        });
        let frame_ratios: Vec<f64> = frame_ratios.collect();
        found.cell_factors = [0.5, 1.0].map(|share| quantile(&mut cell_ratios.clone(), share));
        found.frame_factors = [0.5, 1.0].map(|share| quantile(&mut frame_ratios.clone(), share));
        Some(found)
    }

    /// Logarithm of the fitted relation, without its factor, from the logarithms of distance and spread.
    fn log(&self, sign: [f64; 2]) -> f64 {
        self.intercept + self.slopes[0] * sign[0] + self.slopes[1] * sign[1]
    }

    /// Error bounds at these signs, as shares of encoded white, that hold for the required share of cells: in the usual
    /// picture, and in all but one of k + 1.
    pub fn cells(&self, sign: Sign) -> [f64; 2] {
        let alone = self.log(sign.logs()).exp();
        self.cell_factors.map(|factor| factor * alone)
    }

    /// PSNR of a picture's OLATs in decibels: the usual value, and the one that all but one of k + 1 pictures reach.
    /// None without cells.
    pub fn decibels(&self, signs: impl Iterator<Item = Sign>) -> Option<[f64; 2]> {
        let (mut sum, mut count) = (0.0, 0.0);
        for sign in signs {
            sum += (2.0 * self.log(sign.logs())).exp();
            count += 1.0;
        }
        let decibels = |factor: f64| -10.0 * (factor * factor * sum / count).log10();
        (count > 0.0).then(|| self.frame_factors.map(decibels))
    }

    /// Probability that the bound for all but one of k + 1 pictures holds.
    pub fn chance(&self) -> f64 {
        self.poses as f64 / (self.poses + 1) as f64
    }
}

/// The `share` quantile.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let rank = (share * values.len() as f64).ceil().max(1.0) as usize;
    values[rank.min(values.len()) - 1]
}

/// Best-fitting slopes, from the covariances of the two signs and of each with the error: limited to 0 to
/// [`MOST_SLOPE`].
fn slopes(among: [[f64; 2]; 2], with: [f64; 2]) -> [f64; 2] {
    let alone = |i: usize| {
        let slope = with[i] / among[i][i];
        let slope = if slope.is_finite() { slope.clamp(0.0, MOST_SLOPE) } else { 0.0 };
        let mut slopes = [0.0; 2];
        slopes[i] = slope;
        slopes
    };
    // Remaining squared error, up to a constant.
    let rest = |[b, c]: [f64; 2]| {
        let square = b * b * among[0][0] + 2.0 * b * c * among[0][1] + c * c * among[1][1];
        square - 2.0 * (b * with[0] + c * with[1])
    };
    let determinant = among[0][0] * among[1][1] - among[0][1] * among[1][0];
    let both = [
        (with[0] * among[1][1] - with[1] * among[0][1]) / determinant,
        (with[1] * among[0][0] - with[0] * among[1][0]) / determinant,
    ];
    let mut candidates = vec![alone(0), alone(1)];
    if both.iter().all(|slope| (0.0..=MOST_SLOPE).contains(slope)) {
        candidates.push(both);
    }
    let best = candidates.into_iter().min_by(|a, b| rest(*a).total_cmp(&rest(*b)));
    best.unwrap_or_default()
}
