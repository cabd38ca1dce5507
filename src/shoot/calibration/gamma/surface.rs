//! Cost of every pair of exponents, for drawing.

use super::exponents::{bounds, gamma_prior};
use super::gamma_fit::InspectableFit;
use base::error::Result;
use base::progress::Progress;
use rayon::prelude::*;

/// Cost over a grid of exponents, each at its best exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Exponents along either axis, ascending.
    pub gammas: Vec<f32>,
    /// Row by row: `cost[i2 · gammas.len() + i1]` belongs to γ1 = `gammas[i1]`, γ2 = `gammas[i2]`, relative to the
    /// fit: −2·ln of the relative probability. 1 is one standard deviation away, 4 is two. NaN if the curve is not
    /// monotone. Rounding may make it slightly negative.
    pub cost: Vec<f32>,
    /// Root-mean-square encoded distances of the subject and on the balls.
    pub subject: Vec<f32>,
    pub ball: Vec<f32>,
    /// Best exposure of each pair.
    pub exposure: Vec<f32>,
    /// γ1, γ2 and exposure of the fit.
    pub optimum: [f32; 3],
}

impl InspectableFit<'_> {
    /// Samples the cost at `count` × `count` pairs (at least 2 × 2) over the full range of exponents. A pair takes
    /// about 10 ms on one core; 16 × 16 are enough to show the valley.
    ///
    /// # Errors
    /// When the job was stopped.
    pub fn surface(&self, count: usize, progress: &Progress) -> Result<Surface> {
        let count = count.max(2);
        let (low, high) = bounds();
        let place = |i: usize| low + (high - low) * i as f64 / (count - 1) as f64;
        let fit = &self.fit;
        let least = self.objective.total([f64::from(fit.response.gamma1), f64::from(fit.response.gamma2)]);
        let mut surface = Surface {
            gammas: (0..count).map(|i| place(i) as f32).collect(),
            cost: vec![],
            subject: vec![],
            ball: vec![],
            exposure: vec![],
            optimum: [fit.response.gamma1, fit.response.gamma2, fit.exposure],
        };
        for row in 0..count {
            progress.check("nothing was changed")?;
            progress.step("response surface", row as u64, count as u64, "");
            let values: Vec<[f32; 4]> = (0..count)
                .into_par_iter()
                .map(|column| {
                    let gammas = [place(column), place(row)];
                    let score = self.objective.linearize(gammas).map(|s| self.objective.score(&s));
                    score.map_or([f32::NAN; 4], |s| {
                        [
                            (s.cost + gamma_prior(gammas) - least) as f32,
                            s.subject as f32,
                            s.ball as f32,
                            s.brightness.log_exposure.exp() as f32,
                        ]
                    })
                })
                .collect();
            for [cost, subject, ball, exposure] in values {
                surface.cost.push(cost);
                surface.subject.push(subject);
                surface.ball.push(ball);
                surface.exposure.push(exposure);
            }
        }
        Ok(surface)
    }
}
