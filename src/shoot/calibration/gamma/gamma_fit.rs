//! Result of the fit of the response, and of other curves beside it.

use super::case::Case;
use super::objective::{Objective, Score};
use imaging::{DualGamma, Response};
use serde::{Deserialize, Serialize};

/// Comparison between the relit poses and the interview.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Comparison {
    /// Frequency of each level in the subject; works for any poses.
    #[default]
    Distribution,
    /// Pixel by pixel, if a frame shows one of the poses.
    Pixels,
}

/// Result of the fit.
#[derive(Clone, Debug, PartialEq)]
pub struct GammaFit {
    /// The camera's response.
    pub response: DualGamma,
    /// Interview = exposure · Σ weights · OLAT.
    pub exposure: f32,
    /// Interview weight of each lamp per channel, from the balls and the subject.
    pub weights: Vec<[f32; 3]>,
    /// Comparison used.
    pub comparison: Comparison,
    /// Root-mean-square encoded distance of the quantiles, or of the pixels.
    pub residual: f32,
    /// The same on the mirror balls, pixel for pixel.
    pub ball_residual: f32,
    /// Standard deviations of γ1, γ2 and ln exposure.
    pub deviation: [f32; 3],
    /// Both accounts of the exposure, first the more probable one, used by the fit.
    pub cases: [Case; 2],
    /// Curves other than dual gammas, each as its nearest dual gamma, with its probability relative to all dual
    /// gammas.
    pub others: Vec<Case>,
    /// The 1 % and the 99 % quantile of the compared values.
    pub extent: [f32; 2],
    /// Poses shown by a frame: indices of pose and frame in the project.
    pub same_poses: Vec<[usize; 2]>,
    /// A standard or log curve that explains the pictures better than the dual gammas.
    pub better_curve: Option<CurveFit>,
}

impl GammaFit {
    /// Probability that the exposure was changed between the balls and the filming.
    pub fn changed_exposure(&self) -> f32 {
        let changed = self.cases.iter().find(|case| case.changed);
        changed.map_or(0.0, |case| case.probability)
    }

    /// Adds an error of both exponents from effects outside the fit. A standard curve has none.
    pub(crate) fn widen(&mut self, deviation: f32) {
        let cases = self.cases.iter_mut().chain(&mut self.others);
        let deviations = cases.map(|case| &mut case.deviation).chain([&mut self.deviation]);
        for own in deviations.flat_map(|all| &mut all[..2]) {
            if *own > 0.0 {
                *own = own.hypot(deviation);
            }
        }
    }

    /// All accounts of the pictures with probabilities that add up to 1.
    pub(super) fn accounts(&self) -> Vec<Case> {
        let others: f32 = self.others.iter().map(|other| other.probability).sum();
        let duals = self.cases.iter().map(|case| Case { probability: (1.0 - others) * case.probability, ..*case });
        duals.chain(self.others.iter().copied()).collect()
    }
}

/// A fit with its data, for [`InspectableFit::surface`] and [`InspectableFit::compare`].
pub struct InspectableFit<'a> {
    pub(super) objective: Objective<'a>,
    /// The fit.
    pub fit: GammaFit,
}

/// Fit of a curve to the pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveFit {
    /// The curve with its fitted exponents.
    pub response: Response,
    /// Number of fitted parameters.
    pub parameters: usize,
    /// Best exposure.
    pub exposure: f32,
    /// Evidence against the curve: −2·ln of the pictures' probability, relative to the dual gamma, without the
    /// priors of the exponents. 10 is strong evidence; below 0, the curve is better than the dual gamma.
    pub evidence: f32,
    /// Root-mean-square encoded distance of the subject: of its quantiles, or of its pixels if a frame shows a
    /// pose.
    pub subject: f32,
    /// Root-mean-square encoded distance on the mirror balls, pixel for pixel.
    pub ball: f32,
}

impl CurveFit {
    /// A curve's score relative to the least cost.
    pub(super) fn new(response: Response, parameters: usize, score: &Score, least: f64) -> Self {
        Self {
            response,
            parameters,
            exposure: score.brightness.log_exposure.exp() as f32,
            evidence: (score.cost - least) as f32,
            subject: score.subject as f32,
            ball: score.ball as f32,
        }
    }

    /// Peak signal-to-noise ratio of the balls in decibels.
    pub fn ball_psnr(&self) -> f32 {
        psnr(self.ball)
    }
}

/// −20·log10 of a root-mean-square distance, clamped to at least a millionth.
fn psnr(distance: f32) -> f32 {
    -20.0 * distance.max(1e-6).log10()
}
