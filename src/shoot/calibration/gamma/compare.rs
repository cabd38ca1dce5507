//! Comparison of other curves with the dual gamma, by their fit to the pictures.

use super::brightness::ExposurePrior;
use super::exponents::bounds;
use super::gamma_fit::{CurveFit, InspectableFit};
use base::error::Result;
use base::progress::Progress;
use imaging::Response;

impl InspectableFit<'_> {
    /// Fit of a curve relative to the cost `least`, and its own cost. The exposure is that of the more probable
    /// case, which may differ from the fit's: a wrong curve makes the exposure look changed.
    fn curve(&self, response: Response, parameters: usize, least: f64) -> (CurveFit, f64) {
        let linear = self.objective.linearize_by(&response);
        let [alone, changed] =
            [ExposurePrior::LeftAlone, ExposurePrior::Changed].map(|prior| self.objective.score_under(prior, &linear));
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
