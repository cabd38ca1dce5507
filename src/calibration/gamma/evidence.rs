//! What the fit rests on, and what it leaves open.

use super::{Comparison, GAMMA_PRIOR, GammaFit};
use project::Shoot;
use serde::{Deserialize, Serialize};

/// What the fit of the response rests on, as kept in `calibration.toml`. Files without it give the
/// default, which warns of nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Evidence {
    /// Whether a person set the response; then nothing was fitted, and the deviations are 0.
    pub by_hand: bool,
    /// What was compared between the relit poses and the interview.
    pub comparison: Comparison,
    /// The poses that a frame shows, by name, beside that frame.
    pub same_poses: Vec<[String; 2]>,
    /// Standard deviation of ln exposure.
    pub exposure_deviation: f32,
    /// The probability that the exposure was changed between the balls and the filming; the response is
    /// that of the more probable case.
    pub changed_exposure: f32,
    /// Exposure, γ1 and γ2 in the other case.
    pub other_case: [f32; 3],
    /// The hundredth part of the compared pixels, of OLATs, frames and balls, is darker than the first
    /// and another brighter than the second, in encoded values from 0 to 1.
    pub darkest: f32,
    pub brightest: f32,
    /// Root-mean-square encoded distance on the mirror balls, pixel for pixel.
    pub ball_residual: f32,
    /// A standard curve that explains the pictures better than any dual gamma, by name.
    pub better_curve: Option<String>,
}

impl Default for Evidence {
    fn default() -> Self {
        Self {
            by_hand: false,
            comparison: Comparison::Distribution,
            same_poses: vec![],
            exposure_deviation: 0.0,
            changed_exposure: 0.0,
            other_case: [1.0, GAMMA_PRIOR.0 as f32, GAMMA_PRIOR.0 as f32],
            darkest: 0.0,
            brightest: 1.0,
            ball_residual: 0.0,
            better_curve: None,
        }
    }
}

impl Evidence {
    /// What a fit to a shoot rests on.
    pub(crate) fn new(fit: &GammaFit, shoot: &Shoot) -> Self {
        let name = |names: &[String], i: usize| names.get(i).cloned().unwrap_or_default();
        Self {
            by_hand: false,
            comparison: fit.comparison,
            same_poses: fit
                .same_poses
                .iter()
                .map(|[pose, frame]| [name(&shoot.poses, *pose), name(&shoot.frames, *frame)])
                .collect(),
            exposure_deviation: fit.deviation[2],
            changed_exposure: fit.changed_exposure,
            other_case: [
                fit.other_exposure,
                fit.other_response.gamma1,
                fit.other_response.gamma2,
            ],
            darkest: fit.extent[0],
            brightest: fit.extent[1],
            ball_residual: fit.ball_residual,
            better_curve: fit
                .better_curve
                .map(|curve| curve.response.name().to_owned()),
        }
    }

    /// An exponent that is no surer than this is not told by the pictures: less than half of what is
    /// known of it comes from them, the rest is the prior.
    pub const UNDETERMINED: f32 = (GAMMA_PRIOR.1 * std::f64::consts::FRAC_1_SQRT_2) as f32;
    /// An exponent that is no surer than this is only roughly known: where an encoded value is a fifth of
    /// the range, a tenth of an exponent is a quarter of a stop.
    pub const ROUGH: f32 = 0.1;
    /// ln exposure beyond this is no camera that was left alone.
    pub const OTHER_EXPOSURE: f32 = 0.08;
    /// From this probability on, a changed exposure is worth a sentence.
    pub const DOUBT: f32 = 0.05;

    /// Which poses were compared with a frame pixel by pixel, in a sentence; `None` where distributions
    /// were compared.
    pub fn same_poses_sentence(&self) -> Option<String> {
        let pairs: Vec<String> = self
            .same_poses
            .iter()
            .map(|[pose, frame]| format!("{frame} shows {pose}"))
            .collect();
        (!pairs.is_empty()).then(|| {
            format!(
                "the camera's response was fitted pixel by pixel, because {}",
                pairs.join(", ")
            )
        })
    }

    /// What the person should know before trusting the response, a sentence each.
    pub fn warnings(&self, deviation: [f32; 2], exposure: f32) -> Vec<String> {
        let mut warnings = Vec::new();
        let tones = [
            (
                "γ1",
                "dark",
                format!("hardly anything is darker than {:.2}", self.darkest),
                "Give poses and frames with shadows, and balls whose lamps have soft edges",
            ),
            (
                "γ2",
                "bright",
                format!("hardly anything is brighter than {:.2}", self.brightest),
                "Expose the OLATs and the interview brighter, just short of clipping, or the balls through a thinner \
                 filter",
            ),
        ];
        for (deviation, (exponent, tone, extent, remedy)) in deviation.into_iter().zip(tones) {
            if deviation >= Self::UNDETERMINED {
                warnings.push(format!(
                    "the pictures do not tell the camera's {exponent}, which rules {tone} pixels ({extent} in \
                     encoded values from 0 to 1): it is an assumption. {remedy}"
                ));
            } else if deviation >= Self::ROUGH {
                warnings.push(format!(
                    "the camera's {exponent}, which rules {tone} pixels, is known only to ± {deviation:.2} \
                     ({extent} in encoded values from 0 to 1). {remedy}"
                ));
            }
        }
        if let Some(curve) = &self.better_curve {
            // What the fit made of such pictures needs no further comment.
            return vec![format!(
                "the camera encodes as {curve} does, which no dual gamma comes near: its response was taken to be \
                 that. Fit a dual gamma by hand where you know better"
            )];
        }
        let is_other =
            |exposure: f32| exposure.is_finite() && exposure.ln().abs() > Self::OTHER_EXPOSURE;
        let words = |exposure: f32| {
            let than = if exposure > 1.0 { "brighter" } else { "darker" };
            format!("{:.0} % {than}", 100.0 * (exposure - 1.0).abs())
        };
        const REMEDY: &str =
            "Photograph the balls again at the interview's exposure, or film one of the poses";
        let [other_exposure, gamma1, gamma2] = self.other_case;
        if is_other(exposure) {
            warnings.push(format!(
                "the interview is {} than the mirror balls say (± {:.0} %), so its camera's exposure seems to have \
                 been changed between the balls and the filming, and the response is less sure. {REMEDY}",
                words(exposure),
                100.0 * self.exposure_deviation,
            ));
        } else if self.changed_exposure > Self::DOUBT && is_other(other_exposure) {
            warnings.push(format!(
                "the interview's exposure may have been changed between the balls and the filming (a chance of \
                 {:.0} %): it would be {} than the balls say, with γ1 = {gamma1:.2} and γ2 = {gamma2:.2}. {REMEDY}",
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
        let evidence = Evidence {
            darkest: 0.4,
            exposure_deviation: 0.05,
            ..Evidence::default()
        };
        let [dark] = &evidence.warnings([0.6, 0.03], 1.0)[..] else {
            panic!("one doubt, one sentence");
        };
        assert!(dark.contains("do not tell the camera's γ1") && dark.contains("0.40"));
        let [bright] = &evidence.warnings([0.03, 0.2], 1.0)[..] else {
            panic!("one doubt, one sentence");
        };
        assert!(bright.contains("γ2") && bright.contains("± 0.20") && bright.contains("filter"));
        let [brighter] = &evidence.warnings([0.03; 2], 1.25)[..] else {
            panic!("one doubt, one sentence");
        };
        assert!(brighter.contains("25 % brighter") && brighter.contains("± 5 %"));
        assert!(evidence.warnings([0.03; 2], 0.8)[0].contains("20 % darker"));
        let doubtful = Evidence {
            changed_exposure: 0.3,
            other_case: [1.21, 2.5, 1.9],
            ..Evidence::default()
        };
        let [doubt] = &doubtful.warnings([0.03; 2], 1.01)[..] else {
            panic!("one doubt, one sentence");
        };
        assert!(
            doubt.contains("30 %") && doubt.contains("21 % brighter") && doubt.contains("2.50")
        );
        let other = Evidence {
            better_curve: Some("Rec. 709".into()),
            ..evidence
        };
        let [curve] = &other.warnings([0.6; 2], 0.5)[..] else {
            panic!("the cause alone, not what follows from it");
        };
        assert!(curve.contains("Rec. 709"));
    }
}
