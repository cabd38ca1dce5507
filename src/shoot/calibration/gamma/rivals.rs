//! Rival curves other than dual gammas, each with its probability relative to all dual gammas.

use super::brightness::ExposurePrior;
use super::objective::{Objective, Score};
use super::{Case, CurveFit, GAMMA_PRIOR};
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

/// A curve under an assumption about the exposure.
fn judged(
    objective: &Objective,
    response: &Response,
    exposure: ExposurePrior,
) -> (Score, CurveFit) {
    let score = objective.score_under(exposure, &objective.linearize_by(response));
    (score, CurveFit::of(*response, 0, &score, 0.0))
}

impl Rival {
    /// Standard curves, and the log curves as one: with the exposure left alone, and changed.
    pub fn all(objective: &Objective) -> Vec<[Self; 2]> {
        let both = [ExposurePrior::LeftAlone, ExposurePrior::Changed];
        let standards =
            [(Response::Srgb, SRGB), (Response::Rec709, REC709), (Response::Linear, LINEAR)];
        let log = match both.map(|exposure| Self::log(objective, exposure)) {
            [Some(alone), Some(changed)] => Some([alone, changed]),
            _ => None,
        };
        let of = |(response, chance)| {
            both.map(|exposure| Self::standard(objective, response, chance, exposure))
        };
        standards.map(of).into_iter().chain(log).collect()
    }

    /// A standard curve of a prior share of cameras.
    fn standard(
        objective: &Objective,
        response: Response,
        chance: f64,
        exposure: ExposurePrior,
    ) -> Self {
        let (score, fit) = judged(objective, &response, exposure);
        let [gamma1, gamma2] = nearest(&response);
        Self {
            fit,
            score,
            exposure,
            cost: score.cost - 2.0 * chance.ln(),
            mean: [gamma1, gamma2, score.brightness.log_exposure],
            deviation: [
                STANDARD_DEVIATION,
                STANDARD_DEVIATION,
                score.brightness.exposure_deviation,
            ],
        }
    }

    /// Log curves: K weighted by its probability over a row of places around the best.
    fn log(objective: &Objective, exposure: ExposurePrior) -> Option<Self> {
        let (middle, deviation) = LOG_PRIOR;
        let place = |log_k: f64| -> Option<(f64, f64)> {
            let response = Response::log(log_k.exp() as f32).ok()?;
            let prior = ((log_k - middle) / deviation).powi(2);
            Some((log_k, judged(objective, &response, exposure).0.cost + prior))
        };
        let row = |from: f64, step: f64, count: usize| -> Vec<(f64, f64)> {
            (0..count).filter_map(|i| place(from + step * i as f64)).collect()
        };
        let best = |places: &[(f64, f64)]| {
            let best = places.iter().min_by(|a, b| a.1.total_cmp(&b.1));
            best.map(|place| place.0)
        };
        const COARSE: f64 = 0.5;
        const FINE: f64 = 0.2;
        let near = best(&row(1.5, COARSE, 10))?;
        let places = row(near - 4.0 * FINE, FINE, 9);
        let least = either(places.iter().map(|place| place.1));
        let share = |cost: f64| (-0.5 * (cost - least)).exp();
        let mean: f64 = places.iter().map(|(at, cost)| at * share(*cost)).sum();
        let square = |(at, cost): &(f64, f64)| (at - mean).powi(2) * share(*cost);
        // A place represents its surroundings, half a step wide on either side.
        let spread = (places.iter().map(square).sum::<f64>() + FINE * FINE / 12.0).sqrt();
        let response = Response::log(mean.exp() as f32).ok()?;
        let (score, fit) = judged(objective, &response, exposure);
        let bounds = Response::LOG_BOUNDS;
        let beside = [-spread, spread].map(|step| {
            let k = ((mean + step).exp() as f32).clamp(*bounds.start(), *bounds.end());
            nearest(&Response::Log(k))
        });
        let [gamma1, gamma2] = nearest(&response);
        let half = |i: usize| (0.5 * (beside[1][i] - beside[0][i])).hypot(STANDARD_DEVIATION);
        let density = FINE / (deviation * (2.0 * std::f64::consts::PI).sqrt());
        Some(Self {
            fit: CurveFit { parameters: 1, ..fit },
            score,
            exposure,
            cost: least - 2.0 * (LOG * density).ln(),
            mean: [gamma1, gamma2, score.brightness.log_exposure],
            deviation: [half(0), half(1), score.brightness.exposure_deviation],
        })
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
