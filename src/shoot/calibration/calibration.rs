//! Result of a calibration.

use super::gamma::Evidence;
use super::rig_check::Fault;
use super::second_ball::TwoBalls;
use super::stand_in::StandIn;
use base::error::{Error, Result};
use footage::Motion;
use imaging::Response;
use light::Rig;
use project::{Project, read_sealed, save_sealed};
use serde::{Deserialize, Serialize};

/// Result of the calibration, stored in `calibration.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// The camera's response: encoded → linear.
    #[serde(flatten)]
    pub response: Response,
    /// Standard deviations of γ1 and γ2; 0 if not fitted. The true value is within two deviations in about nineteen
    /// of twenty shoots.
    pub gamma_deviation: [f32; 2],
    /// Factor between the OLAT session and the interview that the mirror balls do not explain: interview = exposure
    /// · Σ interview_weights_i · OLAT_i.
    pub exposure: f32,
    /// Share of each lamp (all of them) per channel in the interview's light.
    pub interview_weights: Vec<[f32; 3]>,
    /// The interview's light from the learnt lamps only; `None` if the network learns every lamp.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stand_in: Option<StandIn>,
    /// Share of the energy on the interview's ball from directions without lamps.
    pub uncovered_energy: f32,
    /// Relative residual of the interview's ball after the fit; 0 if the lamps explain all of it.
    pub probe_residual: f32,
    /// Root-mean-square encoded distance of the quantiles or pixels used to fit γ.
    pub gamma_residual: f32,
    /// Share of the sphere that the ball does not show: the cone behind it and the part cut off by the frame.
    pub blind_share: f32,
    /// Share of the lamps' energy hidden by the ball and filled in.
    pub filled_energy: f32,
    /// Clipped pixels on the mirror balls; those lamps are brighter than measured.
    pub clipped_pixels: usize,
    /// Basis of the fit of the response.
    #[serde(default)]
    pub gamma_evidence: Evidence,
    /// Faults of the lamps, one sentence each.
    #[serde(default)]
    pub rig_findings: Vec<String>,
    /// Kinds of fault, one per sentence; empty in files of older versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rig_faults: Vec<Fault>,
    /// Agreement of two mirror balls; `None` if there was one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub two_balls: Option<TwoBalls>,
    /// Motion of the subject during the lamp cycle, removed from exemplars; `None` if not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Motion>,
    /// True if the shoot has no mirror balls: directions are its list's, energies and the interview's light the subject's.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub by_list: bool,
    /// The lamps that the network learns.
    #[serde(flatten)]
    pub rig: Rig,
}

impl Calibration {
    /// Reads the project's calibration.
    ///
    /// # Errors
    /// When there is no calibration, it is damaged, or it belongs to other lamps.
    pub fn load(project: &Project) -> Result<Self> {
        const REMEDY: (&str, &str) = ("Calibrate the project", "afterlight calibrate PROJECT");
        let path = project.calibration_path();
        if !path.exists() {
            return Err(Error::missing("Not calibrated yet", ("Calibrate first", "afterlight calibrate PROJECT")));
        }
        let text = read_sealed(&path, REMEDY)?;
        let calibration: Self = toml::from_str(&text).map_err(|e| Error::codec("read", &path, e.message(), REMEDY))?;
        let refuse = |problem: String| Err(Error::invalid(format!("{} {problem}", path.display()), REMEDY));
        let shoot = &project.settings.shoot;
        let (lamps, all) = (&shoot.lamps, shoot.all_lamps().len());
        let (found, weights) = (&calibration.rig.lamps, &calibration.interview_weights);
        if found.len() != lamps.len() || weights.len() != all {
            return refuse(format!(
                "has {} lamps and {} interview weights; the project learns {} lamps of {all}",
                found.len(),
                weights.len(),
                lamps.len()
            ));
        }
        let stand_in = calibration.stand_in.as_ref().map_or(&[][..], |s| &s.weights);
        if stand_in.len() != if all > lamps.len() { lamps.len() } else { 0 } {
            return refuse(format!(
                "has {} stand-in weights; needs one per learnt lamp if the shoot has other lamps, else none",
                stand_in.len()
            ));
        }
        if let Some((name, lamp)) = lamps.iter().zip(found).find(|(name, lamp)| **name != lamp.name) {
            return refuse(format!("has lamp {} where the project has lamp {name}", lamp.name));
        }
        let is_light = |v: &f32| v.is_finite() && *v >= 0.0;
        let sound = weights.iter().chain(stand_in).flatten().all(is_light)
            && is_light(&calibration.exposure)
            && found.iter().all(|lamp| lamp.direction.is_normalized() && lamp.energy.iter().all(is_light));
        let light = calibration.interview_light().into_iter();
        let mut light = light.chain(calibration.learnt_light()).flatten();
        if !sound || !light.all(|v| v.is_finite()) {
            return refuse(
                "has a weight or energy that is negative, NaN or infinite, or a direction that is not of unit length"
                    .into(),
            );
        }
        Ok(calibration)
    }

    /// Writes the calibration into the project.
    pub fn save(&self, project: &Project) -> Result<()> {
        save_sealed(&project.calibration_path(), self)
    }

    /// Weights of all lamps in the interview's light, including exposure: interview = Σ interview_light_i · OLAT_i.
    pub fn interview_light(&self) -> Vec<[f32; 3]> {
        self.exposed(&self.interview_weights)
    }

    /// Weights of only the learnt lamps: exact if the network learns every lamp, else the nearest fit.
    pub fn learnt_light(&self) -> Vec<[f32; 3]> {
        self.exposed(match &self.stand_in {
            Some(stand_in) => &stand_in.weights,
            None => &self.interview_weights,
        })
    }

    fn exposed(&self, weights: &[[f32; 3]]) -> Vec<[f32; 3]> {
        weights.iter().map(|weight| weight.map(|w| w * self.exposure)).collect()
    }

    /// Cautions before trusting the calibration, one sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.clipped_pixels > 0 {
            warnings.push(format!(
                "{} pixels of the mirror balls are clipped, so those lamps are brighter than measured. Photograph \
                 the balls through a denser filter",
                self.clipped_pixels
            ));
        }
        warnings.extend(self.rig_findings.iter().cloned());
        if let Some(two) = self.two_balls.as_ref().filter(|two| two.median_deg > 2.5) {
            warnings.push(format!(
                "the two mirror balls disagree on the lamps by a median of {:.1}°. Check both circles. If the lamps are \
                 near, give `ball_position_m` of both balls, their radius and the camera's position in the manifest",
                two.median_deg
            ));
        }
        if self.probe_residual > 0.1 && !self.by_list {
            warnings.push(format!(
                "the lamps explain only {:.0} % of the light on the interview's mirror ball. Check whether other \
                 lamps lit the interview",
                100.0 * (1.0 - self.probe_residual)
            ));
        }
        if let Some(stand_in) = self.stand_in.as_ref().filter(|s| s.residual > 0.1) {
            warnings.push(format!(
                "the learnt lamps miss the interview's light, made by all lamps, by {:.0} %, and training on the \
                 interview will learn part of this error. Let the network learn more lamps",
                100.0 * stand_in.residual
            ));
        }
        warnings.extend(self.gamma_evidence.warnings(self.gamma_deviation, self.exposure));
        warnings
    }
}
