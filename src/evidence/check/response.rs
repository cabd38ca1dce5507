//! The camera's response and the interview's light.

use super::check::{Check, Level, Subject};
use calibration::Calibration;
use calibration::gamma::Evidence;

/// Half the width of a 90 % interval in standard deviations.
const HALF_WIDTH: f32 = 1.645;
/// Probability from which the second case is likely enough to matter.
const LIKELY: f32 = 0.2;
/// Difference of an exponent from which the two cases give different pictures: see [`Evidence::ROUGH`].
const DIFFERENT: f32 = 0.3;
/// Limits for the share of the light on the interview's ball that the lamps do not explain. Measured on stages:
/// with 8 % the true exponents are inside the intervals, with 15 % and 25 % they may be far outside.
const UNEXPLAINED: [f32; 2] = [0.05, 0.12];

/// Checks the certainty of the response.
pub(super) fn response(calibration: &Calibration) -> Check {
    let evidence = &calibration.gamma_evidence;
    let check = |level, sentence: String| Check::new(Subject::Response, level, sentence);
    if evidence.by_files {
        let sentence = "Scene-linear interview and OLAT files";
        return check(Level::Good, sentence.into());
    }
    if evidence.by_hand {
        let sentence = format!("Set by hand: {}. Its accuracy is not checked", calibration.response);
        return check(Level::Unknown, sentence)
            .remedy("Calibrate without a response set by hand to compare it with the pictures");
    }
    if let Some(curve) = &evidence.better_curve {
        let sentence =
            format!("{curve} fits the pictures better than any dual gamma and is used. Its uncertainty is unknown");
        return check(Level::Doubtful, sentence)
            .remedy("If the camera records another curve, set it by hand in the Gamma workspace");
    }
    let ninety = (evidence.intervals.iter()).find(|i| (i.probability - 0.9).abs() < 1e-3);
    let (intervals, says) = match (ninety, calibration.response.exponents()) {
        (Some(interval), _) => ([interval.gamma1, interval.gamma2], "90 % interval"),
        (None, Some(exponents)) if calibration.gamma_deviation != [0.0; 2] => {
            let [d1, d2] = calibration.gamma_deviation.map(|d| HALF_WIDTH * d);
            let [g1, g2] = exponents;
            ([[g1 - d1, g1 + d1], [g2 - d2, g2 + d2]], "± 1.64 deviations")
        }
        _ => {
            let sentence = "The calibration has no uncertainty for the response";
            return check(Level::Unknown, sentence.into()).remedy("Calibrate again");
        }
    };
    let [width1, width2] = intervals.map(|[low, high]| 0.5 * (high - low));
    let width = larger(width1, width2);
    let [rough, undetermined] = [Evidence::ROUGH, Evidence::UNDETERMINED].map(|d| HALF_WIDTH * d);
    let mut level = Level::new(width, rough, undetermined);
    let [[low1, high1], [low2, high2]] = intervals;
    let mut sentence = format!("γ1 {low1:.2} to {high1:.2}, γ2 {low2:.2} to {high2:.2} ({says})");
    let mut remedy = "Film one of the poses in the interview's light, or expose poses and interview so that they use \
                      all levels, and calibrate again";
    if let [first, second] = evidence.open_cases() {
        let apart = (first.gamma1 - second.gamma1).abs();
        let apart = apart.max((first.gamma2 - second.gamma2).abs());
        let both_likely = second.probability > LIKELY && apart > DIFFERENT;
        level = level.worst(if both_likely { Level::Bad } else { Level::Doubtful });
        sentence += &format!(
            ". The camera curve is uncertain: {:.0} % for γ1 {:.2}, γ2 {:.2} with {} exposure",
            100.0 * second.probability,
            second.gamma1,
            second.gamma2,
            if second.changed { "a changed" } else { "the same" }
        );
        remedy = "Compare both in Gamma, and choose the one with the right picture";
    }
    let exposure = calibration.exposure;
    if exposure.is_finite() && exposure.ln().abs() > Evidence::OTHER_EXPOSURE {
        level = level.worst(Level::Doubtful);
        sentence +=
            &format!(". Interview {exposure:.2} times as bright as the mirror balls predict: exposure changed?");
    }
    if calibration.by_list {
        if evidence.same_poses.is_empty() {
            sentence = format!(
                "{} is assumed: without mirror balls, the response needs a frame that shows a pose",
                calibration.response
            );
        }
        return check(level, sentence).remedy(Evidence::REMEDY);
    }
    // The intervals assume that the lamps explain the interview's light.
    let [doubtful, bad] = UNEXPLAINED;
    let light = Level::new(unexplained(calibration), doubtful, bad);
    if light != Level::Good {
        level = level.worst(light);
        sentence += ". The lamps do not explain all of the interview's light: both figures may be wrong";
        remedy = "Fix the interview's light first";
    }
    check(level, sentence).remedy(remedy)
}

/// Checks the share of the interview's light that is not a sum of the lamps.
pub(super) fn interview_light(calibration: &Calibration) -> Check {
    if calibration.by_list {
        return by_subject(calibration);
    }
    let missed = calibration.stand_in.as_ref().map_or(0.0, |s| s.residual);
    let [doubtful, bad] = UNEXPLAINED;
    let level = Level::new(larger(unexplained(calibration), missed), doubtful, bad);
    let [beside, misfit] = [calibration.uncovered_energy, calibration.probe_residual].map(|share| 100.0 * share);
    let mut sentence = if beside < 0.5 && misfit < 0.5 {
        "The lamps together match the light on the interview's mirror ball".to_owned()
    } else {
        format!(
            "Interview ball: {beside:.0} % of the light comes from directions without a lamp; the best sum of the lamps is \
             off by {misfit:.0} %"
        )
    };
    let mut remedy = "Light the interview with the stage's own lamps, or photograph its mirror ball again if the light \
                      was changed. Otherwise the relit poses and the frames differ in light";
    if missed >= doubtful {
        sentence += &format!("; the lamps that the network learns miss it by {:.0} %", 100.0 * missed);
        remedy = "Let the network learn more lamps";
    }
    Check::new(Subject::InterviewLight, level, sentence).remedy(remedy)
}

/// The interview's light of a shoot without mirror balls.
fn by_subject(calibration: &Calibration) -> Check {
    /// Limits for the misfit of the frame: a subject that moved a little has some.
    const MISFIT: [f32; 2] = [0.15, 0.4];
    let [doubtful, bad] = MISFIT;
    let level = Level::new(calibration.probe_residual, doubtful, bad);
    let sentence = format!(
        "The closest pose, relit to match its frame, is off by {:.0} %. Light that misses the subject is unknown",
        100.0 * calibration.probe_residual
    );
    Check::new(Subject::InterviewLight, level, sentence)
        .remedy("Film one of the poses in the interview's light, or photograph a mirror ball in it")
}

/// Share of the light on the interview's ball that the lamps do not explain.
fn unexplained(calibration: &Calibration) -> f32 {
    larger(calibration.probe_residual, calibration.uncovered_energy)
}

/// The larger value; NaN if one is NaN.
fn larger(a: f32, b: f32) -> f32 {
    if a.is_nan() || b.is_nan() { f32::NAN } else { a.max(b) }
}
