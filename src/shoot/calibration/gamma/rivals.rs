//! Rival curves other than dual gammas, each with its probability relative to all dual gammas.

use super::brightness::ExposurePrior;
use super::case::Case;
use super::exponents::GAMMA_PRIOR;
use super::gamma_fit::CurveFit;
use super::objective::{Objective, Score};
use imaging::Response;

/// Prior share of cameras with each curve; all others have a dual gamma.
const SRGB: f64 = 0.1;
const REC709: f64 = 0.05;
const LINEAR: f64 = 0.02;
const LOG: f64 = 0.08;
/// Mean and deviation of ln K of log curves: most cameras are between 10 and 60.
const LOG_PRIOR: (f64, f64) = (3.2, 0.8);
/// Deviation of a camera's real curve from the dual gamma nearest to a standard.
const STANDARD_DEVIATION: f64 = 0.01;

/// A curve that is not a dual gamma, under one assumption about the exposure.
pub(super) struct Rival {
    pub fit: CurveFit,
    pub score: Score,
    exposure: ExposurePrior,
    /// −2·ln of the probability of the pictures and of the curve.
    cost: f64,
    /// Nearest dual gamma and ln exposure, with their deviations.
    mean: [f64; 3],
    deviation: [f64; 3],
}

/// Cost of several alternatives together: −2·ln of their summed probabilities.
fn either(costs: impl IntoIterator<Item = f64>) -> f64 {
    let costs: Vec<f64> = costs.into_iter().collect();
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let shares = costs.iter().map(|cost| (-0.5 * (cost - least)).exp());
    least - 2.0 * shares.sum::<f64>().ln()
}

/// Dual gamma nearest to a curve.
fn nearest(response: &Response) -> [f64; 2] {
    let (curve, _) = response.nearest_dual_gamma();
    [f64::from(curve.gamma1), f64::from(curve.gamma2)]
}

/// Assumptions about the exposure.
const EXPOSURES: [ExposurePrior; 2] = [ExposurePrior::LeftAlone, ExposurePrior::Changed];

/// Scores of a curve under both assumptions about the exposure.
fn scores(objective: &Objective, response: &Response) -> [Score; 2] {
    let linear = objective.linearize_by(response);
    EXPOSURES.map(|exposure| objective.score_under(exposure, &linear))
}

impl Rival {
    /// Standard curves, and the log curves as one: with the exposure left alone, and changed.
    pub fn all(objective: &Objective) -> Vec<[Self; 2]> {
        let standards = [(Response::Srgb, SRGB), (Response::Rec709, REC709), (Response::Linear, LINEAR)];
        let standard = |(response, chance)| Self::standard(objective, response, chance);
        standards.map(standard).into_iter().chain(Self::log(objective)).collect()
    }

    /// A standard curve that a share of cameras has.
    fn standard(objective: &Objective, response: Response, chance: f64) -> [Self; 2] {
        let [gamma1, gamma2] = nearest(&response);
        let [alone, changed] = scores(objective, &response);
        [(EXPOSURES[0], alone), (EXPOSURES[1], changed)].map(|(exposure, score)| Self {
            fit: CurveFit::new(response, 0, &score, 0.0),
            score,
            exposure,
            cost: score.cost - 2.0 * chance.ln(),
            mean: [gamma1, gamma2, score.brightness.log_exposure],
            deviation: [STANDARD_DEVIATION, STANDARD_DEVIATION, score.brightness.exposure_deviation],
        })
    }

    /// Log curves: under each assumption, K weighted by its probability over a row of places.
    fn log(objective: &Objective) -> Option<[Self; 2]> {
        const STEP: f64 = 0.2;
        /// First ln K, and number of places.
        const ROW: (f64, usize) = (1.0, 28);
        let (middle, deviation) = LOG_PRIOR;
        let place = |log_k: f64| {
            let response = Response::log(log_k.exp() as f32).ok()?;
            let prior = ((log_k - middle) / deviation).powi(2);
            Some((log_k, scores(objective, &response).map(|score| score.cost + prior)))
        };
        let row: Vec<_> = (0..ROW.1).filter_map(|i| place(ROW.0 + STEP * i as f64)).collect();
        let under = |exposure: usize| -> Option<Self> {
            let places = || row.iter().map(|(log_k, costs)| (log_k, costs[exposure]));
            let least = either(places().map(|(_, cost)| cost));
            let share = |cost: f64| (-0.5 * (cost - least)).exp();
            let mean: f64 = places().map(|(at, cost)| at * share(cost)).sum();
            let variance: f64 = places().map(|(at, cost)| (at - mean).powi(2) * share(cost)).sum();
            // A place represents its surroundings, half a step wide on either side.
            let spread = (variance + STEP * STEP / 12.0).sqrt();
            let response = Response::log(mean.exp() as f32).ok()?;
            let score = scores(objective, &response)[exposure];
            let bounds = Response::LOG_BOUNDS;
            let beside = [-spread, spread].map(|step| {
                let k = ((mean + step).exp() as f32).clamp(*bounds.start(), *bounds.end());
                nearest(&Response::Log(k))
            });
            let [gamma1, gamma2] = nearest(&response);
            let half = |i: usize| (0.5 * (beside[1][i] - beside[0][i])).hypot(STANDARD_DEVIATION);
            let density = STEP / (deviation * (2.0 * std::f64::consts::PI).sqrt());
            Some(Self {
                fit: CurveFit::new(response, 1, &score, 0.0),
                score,
                exposure: EXPOSURES[exposure],
                cost: least - 2.0 * (LOG * density).ln(),
                mean: [gamma1, gamma2, score.brightness.log_exposure],
                deviation: [half(0), half(1), score.brightness.exposure_deviation],
            })
        };
        Some([under(0)?, under(1)?])
    }

    /// The curve as an account of the pictures, represented by its nearest dual gamma.
    pub fn case(&self, probability: f64) -> Case {
        Case {
            changed: self.exposure == ExposurePrior::Changed,
            probability: probability as f32,
            gamma1: self.mean[0] as f32,
            gamma2: self.mean[1] as f32,
            exposure: self.mean[2].exp() as f32,
            mean: self.mean.map(|v| v as f32),
            deviation: self.deviation.map(|v| v as f32),
        }
    }
}

/// Probability of each rival relative to all dual gammas, given the costs of the dual gammas' cases, which include
/// an unnormalised prior of both exponents.
pub(super) fn probabilities(rivals: &[[Rival; 2]], duals: [f64; 2]) -> Vec<[f64; 2]> {
    let area = 2.0 * std::f64::consts::PI * GAMMA_PRIOR.1.powi(2);
    let chance = 1.0 - SRGB - REC709 - LINEAR - LOG;
    let dual = either(duals) + 2.0 * (area / chance).ln();
    let all = either(rivals.iter().flatten().map(|rival| rival.cost).chain([dual]));
    let probability = |rival: &Rival| (-0.5 * (rival.cost - all)).exp();
    rivals.iter().map(|pair| pair.each_ref().map(probability)).collect()
}
