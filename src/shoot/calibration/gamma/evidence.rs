//! Basis and certainty of the fitted response.

use super::case::{Case, Interval};
use super::exponents::GAMMA_PRIOR;
use super::gamma_fit::{Comparison, GammaFit};
use project::Shoot;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Basis of the fitted response, stored in `calibration.toml`. Files without it use the default, which gives no
/// warning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Evidence {
    /// Response set by hand: nothing was fitted, and the deviations are 0.
    pub by_hand: bool,
    /// Scene-linear light in the files of interview and OLATs: no response applies.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub by_files: bool,
    /// Comparison between the relit poses and the interview.
    pub comparison: Comparison,
    /// Poses shown by a frame: the names of pose and frame.
    pub same_poses: Vec<[String; 2]>,
    /// Standard deviation of ln exposure.
    pub exposure_deviation: f32,
    /// Probability that the exposure was changed between the balls and the filming. The response is that of the
    /// more probable case.
    pub changed_exposure: f32,
    /// Exposure, γ1 and γ2 in the other case.
    pub other_case: [f32; 3],
    /// The 1 % and the 99 % quantile of the compared pixels, of OLATs, frames and balls, in encoded values from 0
    /// to 1.
    pub darkest: f32,
    pub brightest: f32,
    /// Root-mean-square encoded distance on the mirror balls, pixel for pixel.
    pub ball_residual: f32,
    /// Name of a standard or log curve that explains the pictures better than any dual gamma.
    pub better_curve: Option<String>,
    /// Both accounts of the pictures, the more probable first; empty if nothing was fitted or a standard curve is
    /// better.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cases: Vec<Case>,
    /// Intervals of 50, 90 and 99 % over both accounts and over other plausible curves, represented by their
    /// nearest dual gammas.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub intervals: Vec<Interval>,
}

impl Default for Evidence {
    fn default() -> Self {
        Self {
            by_hand: false,
            by_files: false,
            comparison: Comparison::Distribution,
            same_poses: vec![],
            exposure_deviation: 0.0,
            changed_exposure: 0.0,
            other_case: [1.0, GAMMA_PRIOR.0 as f32, GAMMA_PRIOR.0 as f32],
            darkest: 0.0,
            brightest: 1.0,
            ball_residual: 0.0,
            better_curve: None,
            cases: vec![],
            intervals: vec![],
        }
    }
}

impl Evidence {
    /// Evidence of a fit to a shoot.
    pub(crate) fn new(fit: &GammaFit, shoot: &Shoot) -> Self {
        let [_, other] = fit.cases;
        let cases = match fit.better_curve {
            None => fit.cases.to_vec(),
            Some(_) => vec![],
        };
        Self {
            by_hand: false,
            by_files: false,
            comparison: fit.comparison,
            same_poses: fit
                .same_poses
                .iter()
                .map(|[pose, frame]| {
                    let (pose, frame) = (shoot.poses.get(*pose), shoot.frames.get(*frame));
                    [pose.cloned().unwrap_or_default(), frame.map(Cow::into_owned).unwrap_or_default()]
                })
                .collect(),
            exposure_deviation: fit.deviation[2],
            changed_exposure: fit.changed_exposure(),
            other_case: [other.exposure, other.gamma1, other.gamma2],
            darkest: fit.extent[0],
            brightest: fit.extent[1],
            ball_residual: fit.ball_residual,
            better_curve: fit.better_curve.map(|curve| match curve.response {
                log @ imaging::Response::Log(_) => log.to_string(),
                standard => standard.name().to_owned(),
            }),
            intervals: Interval::from_cases(&fit.accounts()),
            cases,
        }
    }

    /// Deviation from which the pictures do not determine an exponent: less than half of the information comes from
    /// them, the rest from the prior.
    pub const UNDETERMINED: f32 = (GAMMA_PRIOR.1 * std::f64::consts::FRAC_1_SQRT_2) as f32;
    /// Deviation from which an exponent is only roughly known: at an encoded value of 0.2, a tenth of an exponent
    /// is a quarter of a stop.
    pub const ROUGH: f32 = 0.1;
    /// Remedy for a curve that the pictures do not determine.
    pub const REMEDY: &str = "Give the camera's curve, such as --gamma srgb, or film one of the poses in the interview's \
                              light, and calibrate again";
    /// Size of ln exposure that counts as a changed exposure.
    pub const OTHER_EXPOSURE: f32 = 0.08;
    /// Smallest probability of a changed exposure that gives a warning.
    pub const DOUBT: f32 = 0.05;

    /// Both accounts of the pictures if both are plausible, else empty.
    pub fn open_cases(&self) -> &[Case] {
        match &self.cases[..] {
            cases @ [_, second] if second.probability > Self::DOUBT => cases,
            _ => &[],
        }
    }

    /// Sentence with the poses compared pixel by pixel with a frame; `None` if distributions were compared.
    pub fn same_poses_sentence(&self) -> Option<String> {
        let pairs: Vec<String> = self.same_poses.iter().map(|[pose, frame]| format!("{frame} shows {pose}")).collect();
        (!pairs.is_empty()).then(|| format!("the camera's response was fitted pixel by pixel: {}", pairs.join(", ")))
    }

    /// Cautions before trusting the response, one sentence each.
    pub fn warnings(&self, deviation: [f32; 2], exposure: f32) -> Vec<String> {
        let mut warnings = Vec::new();
        let tones = [
            (
                "γ1",
                "dark",
                format!("99 % of the values are above {:.2}", self.darkest),
                "Use poses and frames with shadows, and balls on which the lamps have soft edges",
            ),
            (
                "γ2",
                "bright",
                format!("99 % of the values are below {:.2}", self.brightest),
                "Expose the OLATs and the interview brighter, just below clipping, or photograph the balls through \
                 a weaker filter",
            ),
        ];
        // An assumed exponent makes the other one rough too; only the cause is reported.
        let is_assumed = deviation.iter().any(|d| *d >= Self::UNDETERMINED);
        if deviation.iter().all(|d| *d >= Self::UNDETERMINED) && self.better_curve.is_none() {
            warnings.push(format!(
                "the pictures do not determine the camera's curve, or contradict every dual gamma. {}",
                Self::REMEDY
            ));
            return warnings;
        }
        for (deviation, (exponent, tone, extent, remedy)) in deviation.into_iter().zip(tones) {
            if deviation >= Self::UNDETERMINED {
                warnings.push(format!(
                    "the pictures do not determine the camera's {exponent}, which shapes the {tone} tones, so it \
                     is assumed ({extent}, on a scale from 0 to 1). {remedy}"
                ));
            } else if deviation >= Self::ROUGH && !is_assumed {
                warnings.push(format!(
                    "the camera's {exponent}, which shapes the {tone} tones, is uncertain by ± {deviation:.2} \
                     ({extent}, on a scale from 0 to 1). {remedy}"
                ));
            }
        }
        if let Some(curve) = &self.better_curve {
            // Warnings about the dual gamma's fit would only follow from this one.
            return vec![format!(
                "the camera encodes like {curve}, which no dual gamma matches, so {curve} is used. To override \
                 it, set a dual gamma by hand"
            )];
        }
        let is_other = |exposure: f32| exposure.is_finite() && exposure.ln().abs() > Self::OTHER_EXPOSURE;
        let words = |exposure: f32| {
            let than = if exposure > 1.0 { "brighter" } else { "darker" };
            format!("{:.0} % {than}", 100.0 * (exposure - 1.0).abs())
        };
        const REMEDY: &str = "Photograph the balls again at the interview's exposure, or film one of the poses";
        let [other_exposure, gamma1, gamma2] = self.other_case;
        if is_other(exposure) {
            let is_alone = self.cases.first().is_some_and(|first| !first.changed);
            let (account, otherwise) = if is_alone {
                ("although the camera's exposure was probably left alone", "If it was changed")
            } else {
                (
                    "the camera's exposure was probably changed between the balls and the filming",
                    "If it was left alone after all",
                )
            };
            let otherwise = match self.open_cases() {
                [_, other] => format!(
                    " {otherwise} (probability {:.0} %), γ1 = {:.2} and γ2 = {:.2}: the Gamma workspace shows both.",
                    100.0 * other.probability,
                    other.gamma1,
                    other.gamma2
                ),
                _ => String::new(),
            };
            warnings.push(format!(
                "the interview is {} than the mirror balls say (± {:.0} %): {account}, which makes the response less \
                 certain.{otherwise} {REMEDY}",
                words(exposure),
                100.0 * self.exposure_deviation,
            ));
        } else if self.changed_exposure > Self::DOUBT && is_other(other_exposure) {
            warnings.push(format!(
                "the camera's exposure may have been changed between the balls and the filming (probability {:.0} \
                 %). The interview would then be {} than the balls say, with γ1 = {gamma1:.2} and γ2 = \
                 {gamma2:.2}. {REMEDY}",
                100.0 * self.changed_exposure,
                words(other_exposure),
            ));
        }
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sure_fit_warns_of_nothing() {
        assert!(Evidence::default().warnings([0.03; 2], 1.02).is_empty());
    }

    #[test]
    fn each_doubt_has_its_sentence_and_its_remedy() {
        let evidence = Evidence { darkest: 0.4, exposure_deviation: 0.05, ..Evidence::default() };
        let [unknown] = &evidence.warnings([0.6; 2], 1.0)[..] else {
            panic!("one doubt, one sentence");
        };
        assert!(unknown.contains("contradict every dual gamma") && unknown.contains("--gamma"));
        let [dark] = &evidence.warnings([0.6, 0.03], 1.0)[..] else {
            panic!("one doubt, one sentence");
        };
        assert!(dark.contains("do not determine the camera's γ1") && dark.contains("0.40"));
        let [bright] = &evidence.warnings([0.03, 0.2], 1.0)[..] else {
            panic!("one doubt, one sentence");
        };
        assert!(bright.contains("γ2") && bright.contains("± 0.20") && bright.contains("filter"));
        let [brighter] = &evidence.warnings([0.03; 2], 1.25)[..] else {
            panic!("one doubt, one sentence");
        };
        assert!(brighter.contains("25 % brighter") && brighter.contains("± 5 %"));
        assert!(evidence.warnings([0.03; 2], 0.8)[0].contains("20 % darker"));
        let case = |changed: bool, probability: f32, exposure: f32| Case {
            changed,
            probability,
            gamma1: 2.81,
            gamma2: 1.9,
            exposure,
            mean: [2.81, 1.9, exposure.ln()],
            deviation: [0.1; 3],
        };
        let open = Evidence { cases: vec![case(true, 0.6, 0.5), case(false, 0.4, 1.0)], ..Evidence::default() };
        let [both] = &open.warnings([0.03; 2], 0.5)[..] else {
            panic!("one doubt, one sentence");
        };
        assert!(both.contains("50 % darker") && both.contains("40 %") && both.contains("γ1 = 2.81"));
        let left_alone = Evidence { cases: vec![case(false, 0.6, 1.1), case(true, 0.4, 1.3)], ..Evidence::default() };
        let [alone] = &left_alone.warnings([0.03; 2], 1.1)[..] else {
            panic!("one doubt, one sentence");
        };
        assert!(alone.contains("probably left alone") && alone.contains("If it was changed (probability 40 %)"));
        let doubtful = Evidence { changed_exposure: 0.3, other_case: [1.21, 2.5, 1.9], ..Evidence::default() };
        let [doubt] = &doubtful.warnings([0.03; 2], 1.01)[..] else {
            panic!("one doubt, one sentence");
        };
        assert!(doubt.contains("30 %") && doubt.contains("21 % brighter") && doubt.contains("2.50"));
        let other = Evidence { better_curve: Some("Rec. 709".into()), ..evidence };
        let [curve] = &other.warnings([0.6; 2], 0.5)[..] else {
            panic!("the cause alone, not what follows from it");
        };
        assert!(curve.contains("Rec. 709"));
    }
}
