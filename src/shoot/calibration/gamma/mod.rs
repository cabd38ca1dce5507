//! Fit of the camera's dual gamma (the curve itself is [`imaging::DualGamma`]).
//!
//! Two things must agree under the right curve. First, the OLATs of the poses, summed with the interview's weights,
//! must look like the interview: pixel for pixel if a frame shows the pose itself, otherwise by their quantiles.
//! Second, on the mirror balls, where nothing moves, the sum of the lamps must equal the interview's ball pixel for
//! pixel. The first determines the power of the curve, the second its shape.
//!
//! The interview's light may not be a sum of the lamps. The light on its ball that the lamps do not explain (the
//! remainder) widens the errors of the relighting weights. It also lowers the influence of the balls' pixels, which
//! would otherwise bend the response to make lamps look like something else.
//!
//! A brighter interview and a higher power look alike, so the data hardly determine the exposure. It is assumed to
//! be close to 1, because the balls share one filter and the cameras were left untouched (the paper's section 3.1).
//! A changed exposure is a second case. Both cases are explored and stored with their probabilities. The more
//! probable one is the answer; deviations and intervals are those of the mixture.

mod brightness;
mod case;
mod compare;
mod covariance;
mod evidence;
mod expected_errors;
mod exponents;
mod frame_match;
mod gamma_fit;
mod matte;
mod objective;
mod posterior;
mod rivals;
mod study;
mod subject;
mod surface;

use super::code_values::ResponseTable;
use super::probe::Probes;
use super::trial::Trial;
use base::error::{Error, Result};
use base::progress::Progress;
use brightness::ExposurePrior;
use exponents::{GAMMA_PRIOR, gamma_prior, minimise};
use frame_match::FrameMatch;
use imaging::{DualGamma, Response};
use objective::{LinearPictures, Objective};
use posterior::Posterior;
use project::Shoot;
use rivals::Rival;
use subject::NearestFrame;

pub use case::{Case, Interval};
pub use evidence::Evidence;
pub use gamma_fit::{Comparison, CurveFit, GammaFit, InspectableFit};
pub use study::{CurvePoint, GammaStudy, Histogram, curve};
pub(super) use subject::{Subject, is_scene_linear, sample, sample_olat};
pub use surface::Surface;

/// Response used by a calibration: the fitted one, a standard curve that beats the fit, or one set by hand.
pub(super) struct ChosenResponse {
    pub response: Response,
    /// Standard deviations of γ1 and γ2; 0 if the response was not fitted.
    pub deviation: [f32; 2],
    pub exposure: f32,
    /// Interview weight of each lamp per channel, from the balls and the subject.
    pub weights: Vec<[f32; 3]>,
    /// Root-mean-square encoded distance of the quantiles, or of the pixels.
    pub residual: f32,
    pub evidence: Evidence,
}

impl ChosenResponse {
    /// The fitted response, or the standard curve that beats it.
    pub fn fitted(fit: &GammaFit, shoot: &Shoot) -> Self {
        let evidence = Evidence::new(fit, shoot);
        match &fit.better_curve {
            None => Self {
                response: fit.response.into(),
                deviation: [fit.deviation[0], fit.deviation[1]],
                exposure: fit.exposure,
                weights: fit.weights.clone(),
                residual: fit.residual,
                evidence,
            },
            Some(curve) => Self {
                response: curve.response,
                deviation: [fit.deviation[0], fit.deviation[1]],
                exposure: curve.exposure,
                weights: fit.weights.clone(),
                residual: curve.subject,
                evidence: Evidence { ball_residual: curve.ball, ..evidence },
            },
        }
    }

    /// A response set by hand.
    pub fn by_hand(subject: &Subject, probes: &Probes, trial: &Trial) -> Self {
        let mut chosen = Self::known(subject, probes, trial.response, Some(trial.exposure));
        chosen.evidence.by_hand = true;
        chosen
    }

    /// The response of pictures whose files are scene-linear: readers encode their light as sRGB for comparison, so it is
    /// sRGB's. Only the exposure is fitted.
    pub fn by_files(subject: &Subject, probes: &Probes) -> Self {
        let mut chosen = Self::known(subject, probes, Response::Srgb, None);
        chosen.evidence.by_files = true;
        chosen
    }

    /// A known response with the given exposure, or the best one.
    fn known(subject: &Subject, probes: &Probes, response: Response, exposure: Option<f32>) -> Self {
        let known = Objective::known_light(subject, probes, &response, exposure);
        let [residual, ball_residual] = known.distances;
        let [darkest, brightest] = Objective::new(subject, probes, vec![]).extent();
        Self {
            response,
            deviation: [0.0; 2],
            exposure: known.exposure,
            weights: known.weights,
            residual,
            evidence: Evidence { darkest, brightest, ball_residual, ..Evidence::default() },
        }
    }
}

/// Fits γ1, γ2 and the exposure with the given comparison; with `None`, pixel by pixel if a frame shows a pose,
/// else by distributions.
///
/// # Errors
/// When pixels are to be compared and no frame shows a pose, or the job was stopped.
pub(super) fn fit<'a>(
    subject: &'a Subject,
    probes: &'a Probes,
    wanted: Option<Comparison>,
    progress: &Progress,
) -> Result<InspectableFit<'a>> {
    let found = fit_by(Objective::new(subject, probes, vec![]), progress)?;
    if wanted == Some(Comparison::Distribution) {
        return Ok(found);
    }
    // Matching a frame to a pose needs a roughly right response.
    let table = ResponseTable::new(&found.fit.response);
    let nearest = subject.nearest(&table, &probes.weights(&table));
    let same: Vec<&NearestFrame> = nearest.iter().filter(|near| near.mismatch <= FrameMatch::MAX_MISMATCH).collect();
    if !same.is_empty() {
        let matched = same.iter().map(|near| near.pose).collect();
        let mut found = fit_by(Objective::new(subject, probes, matched), progress)?;
        let numbers = |near: &&NearestFrame| [near.frame_match.pose, near.frame_match.frame];
        found.fit.same_poses = same.iter().map(numbers).collect();
        return Ok(found);
    }
    if wanted.is_none() {
        return Ok(found);
    }
    let best = nearest.iter().min_by(|a, b| a.mismatch.total_cmp(&b.mismatch));
    Err(Error::invalid(
        best.map_or(
            "cannot compare pixel by pixel: no frame has the outline of a pose".into(),
            |NearestFrame { frame_match, mismatch, .. }| {
                format!(
                    "cannot compare pixel by pixel: pose {} and frame {} match best, with a mismatch of \
                     {mismatch:.2}, above {}",
                    frame_match.pose,
                    frame_match.frame,
                    FrameMatch::MAX_MISMATCH
                )
            },
        ),
        "Compare distributions, or film one of the poses",
    ))
}

/// Fits γ1, γ2 and the exposure by one comparison.
fn fit_by<'a>(mut objective: Objective<'a>, progress: &Progress) -> Result<InspectableFit<'a>> {
    // The cost has valleys, so searches start from the three best places of a grid.
    const GRID: [f64; 6] = [1.2, 1.6, 2.0, 2.4, 2.8, 3.3];
    const WALKS: usize = 3;
    let total = (GRID.len() + WALKS) as u64;
    let mut grid = Vec::new();
    for (row, gamma1) in GRID.into_iter().enumerate() {
        progress.check("nothing was changed")?;
        progress.step("response", row as u64, total, "");
        let places = GRID.map(|gamma2| [gamma1, gamma2]);
        grid.extend(places.into_iter().filter_map(|place| Some((place, objective.linearize(place)?))));
    }
    let best_ball = |a: &&([f64; 2], LinearPictures), b: &&([f64; 2], LinearPictures)| {
        objective.ball_square(&a.1.ball).total_cmp(&objective.ball_square(&b.1.ball))
    };
    if let Some((_, best)) = grid.iter().min_by(best_ball) {
        objective.weigh(best);
    }
    objective.profile_again(&mut grid);
    let mut starts: Vec<([f64; 2], f64)> =
        grid.iter().map(|(place, linear)| (*place, objective.score(linear).cost + gamma_prior(*place))).collect();
    starts.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut best = ([GAMMA_PRIOR.0; 2], f64::INFINITY);
    for (walk, (start, _)) in starts.iter().take(WALKS).enumerate() {
        progress.check("nothing was changed")?;
        progress.step("response", (GRID.len() + walk) as u64, total, "");
        let found = minimise(|gammas| objective.total(gammas), *start)?;
        if found.1 < best.1 {
            best = found;
        }
    }
    // The best place of the grid gives a rough noise estimate; the best search gives a good one.
    if let Some(linear) = objective.linearize(best.0) {
        objective.weigh(&linear);
    }
    objective.profile_again(&mut grid);
    // Each case has its own best place, which the grid may show better than the search under the other case.
    let mut cases = Vec::new();
    for prior in [ExposurePrior::LeftAlone, ExposurePrior::Changed] {
        progress.check("nothing was changed")?;
        objective.exposure = prior;
        let total_cost = |gammas: [f64; 2], linear: &LinearPictures| objective.score(linear).cost + gamma_prior(gammas);
        let mut start = (best.0, objective.total(best.0));
        for (place, linear) in &grid {
            let cost = total_cost(*place, linear);
            if cost < start.1 {
                start = (*place, cost);
            }
        }
        cases.push((prior, Posterior::find(&objective, start.0)?));
    }
    let odds_alone = (0.5 * (cases[1].1.cost - cases[0].1.cost)).exp();
    let changed_exposure = doubted(1.0 / (1.0 + odds_alone));
    if changed_exposure > 0.5 {
        cases.swap(0, 1);
    }
    let [(prior, found), (other_prior, other)] = [cases[0], cases[1]];
    let doubt = changed_exposure.min(1.0 - changed_exposure);
    objective.exposure = prior;
    let response = probable_curve(&found)?;
    let linear = objective.linearize_by(&response.into());
    let score = objective.score(&linear);
    let fit = GammaFit {
        response,
        exposure: score.brightness.log_exposure.exp() as f32,
        weights: score.weights(&linear),
        comparison: if objective.matched.is_empty() { Comparison::Distribution } else { Comparison::Pixels },
        residual: score.subject as f32,
        ball_residual: score.ball as f32,
        deviation: [0.0; 3],
        cases: [dual_case(&found, prior, 1.0 - doubt)?, dual_case(&other, other_prior, doubt)?],
        others: vec![],
        extent: objective.extent(),
        same_poses: vec![],
        better_curve: None,
    };
    let mut fitted = InspectableFit { objective, fit };
    fitted.compare_rivals([found.cost, other.cost]);
    Ok(fitted)
}

/// Probability of one of two cases, allowing for a wrong model in one of fifty shoots.
fn doubted(probability: f64) -> f64 {
    const WRONG: f64 = 0.02;
    (1.0 - WRONG) * probability + 0.5 * WRONG
}

/// Most probable curve.
fn probable_curve(posterior: &Posterior) -> Result<DualGamma> {
    DualGamma::new(posterior.gammas[0] as f32, posterior.gammas[1] as f32)
}

fn dual_case(posterior: &Posterior, prior: ExposurePrior, probability: f64) -> Result<Case> {
    let curve = probable_curve(posterior)?;
    Ok(Case {
        changed: prior == ExposurePrior::Changed,
        probability: probability as f32,
        gamma1: curve.gamma1,
        gamma2: curve.gamma2,
        exposure: posterior.log_exposure.exp() as f32,
        mean: posterior.mean.map(|v| v as f32),
        deviation: posterior.deviation.map(|v| v as f32),
    })
}

impl InspectableFit<'_> {
    /// Compares the dual gammas, whose cases have these costs, with other curves, and uses the most probable one.
    fn compare_rivals(&mut self, duals: [f64; 2]) {
        /// Smallest probability of a standard curve that counts as exact.
        const SURE: f64 = 0.99;
        let rivals = Rival::all(&self.objective);
        let probabilities = rivals::probabilities(&rivals, duals);
        let fit = &mut self.fit;
        let others = rivals.iter().flatten().zip(probabilities.iter().flatten());
        fit.others = others.map(|(rival, probability)| rival.case(*probability)).collect();
        // Both exposures together decide for a curve.
        let both = |[alone, changed]: &[f64; 2]| alone + changed;
        let dual = 1.0 - probabilities.iter().map(both).sum::<f64>();
        let curves = rivals.iter().zip(&probabilities);
        let best = curves.max_by(|a, b| both(a.1).total_cmp(&both(b.1)));
        let best = best.filter(|(_, probability)| both(probability) > dual);
        let chosen = best.map(|(rivals, probabilities)| {
            let better = usize::from(probabilities[1] > probabilities[0]);
            (&rivals[better], probabilities[better])
        });
        if let Some((rival, _)) = chosen {
            let linear = self.objective.linearize_by(&rival.fit.response);
            fit.weights = rival.score.weights(&linear);
            fit.better_curve = Some(rival.fit);
        }
        let chosen = chosen.map_or(fit.cases[0], |(rival, probability)| rival.case(probability));
        let here = [chosen.gamma1, chosen.gamma2, chosen.exposure.ln()];
        let accounts = fit.accounts();
        fit.deviation = [0, 1, 2].map(|i| {
            let square =
                |case: &Case| case.probability * (case.deviation[i].powi(2) + (case.mean[i] - here[i]).powi(2));
            accounts.iter().map(square).sum::<f32>().sqrt()
        });
        let is_exact =
            best.is_some_and(|([rival, _], probability)| rival.fit.parameters == 0 && both(probability) > SURE);
        if is_exact {
            [fit.deviation[0], fit.deviation[1]] = [0.0; 2];
        }
    }
}

#[cfg(test)]
mod tests;
