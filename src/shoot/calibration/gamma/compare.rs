//! Comparison of other curves with the dual gamma, by their fit to the pictures.

use super::brightness::ExposurePrior;
use super::objective::Score;
use super::{InspectableFit, bounds};
use base::error::Result;
use base::progress::Progress;
use imaging::Response;

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

    /// Peak signal-to-noise ratio of the subject in decibels.
    pub fn subject_psnr(&self) -> f32 {
        psnr(self.subject)
    }
}

/// −20·log10 of a root-mean-square distance, clamped to at least a millionth.
fn psnr(distance: f32) -> f32 {
    -20.0 * distance.max(1e-6).log10()
}

impl InspectableFit<'_> {
    /// Fit of a curve relative to the cost `least`, and its own cost. The exposure is that of the more probable
    /// case, which may differ from the fit's: a wrong curve makes the exposure look changed.
    fn curve(&self, response: Response, parameters: usize, least: f64) -> (CurveFit, f64) {
        let linear = self.objective.linearize_by(&response);
        let [alone, changed] = [ExposurePrior::LeftAlone, ExposurePrior::Changed]
            .map(|prior| self.objective.score_under(prior, &linear));
        let score = if changed.cost < alone.cost { changed } else { alone };
        (CurveFit::new(response, parameters, &score, least), score.cost)
    }

    /// Returns the dual gamma first, then a fitted power, sRGB, Rec. 709, linear, and the log curve with the usual
    /// or the best K.
    ///
    /// # Errors
    /// When the job was stopped.
    pub fn compare(&self, progress: &Progress) -> Result<Vec<CurveFit>> {
        let curves = [
            (Response::Dual(self.fit.response), 2),
            (Response::Power(self.best_power()), 1),
            (Response::Srgb, 0),
            (Response::Rec709, 0),
            (Response::Linear, 0),
        ];
        let mut fits = Vec::new();
        let mut least = 0.0;
        for (response, parameters) in curves {
            progress.check("nothing was changed")?;
            let (mut fit, cost) = self.curve(response, parameters, least);
            if fits.is_empty() {
                (least, fit.evidence) = (cost, 0.0);
            }
            fits.push(fit);
        }
        Ok(fits)
    }

    /// Exponent of the best plain power, by ever finer rows around the best value so far.
    fn best_power(&self) -> f32 {
        const PLACES: usize = 9;
        let (mut low, mut high) = bounds();
        let cost = |gamma: f64| {
            let linear = self.objective.linearize_by(&Response::Power(gamma as f32));
            self.objective.score(&linear).cost
        };
        let mut best = (low, f64::INFINITY);
        while high - low > 2e-3 {
            let step = (high - low) / (PLACES - 1) as f64;
            for i in 0..PLACES {
                let gamma = low + step * i as f64;
                let found = cost(gamma);
                if found < best.1 {
                    best = (gamma, found);
                }
            }
            (low, high) = ((best.0 - step).max(low), (best.0 + step).min(high));
        }
        best.0 as f32
    }
}
