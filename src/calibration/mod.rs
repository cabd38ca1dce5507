//! Calibration: where the lamps are, how strong they are, which sum of them is the interview's
//! light, and how the camera encoded all of it.

mod blind_cone;
mod code;
mod footprint;
pub mod gamma;
mod least_squares;
pub mod mirror_ball;
pub mod probe;

use crate::error::{Error, Result};
use crate::imaging::DualGamma;
use crate::light::Rig;
use crate::progress::Progress;
use crate::project::{Project, save_toml};
use code::Table;
use gamma::{Comparison, Evidence, Subject};
use probe::Probes;
use serde::{Deserialize, Serialize};

/// Everything the calibration found, as kept in `calibration.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// The camera's response: encoded → linear.
    #[serde(flatten)]
    pub response: DualGamma,
    /// Standard deviations of γ1 and γ2: in about nineteen of twenty shoots, the truth is within two.
    pub gamma_deviation: [f32; 2],
    /// Factor between the OLAT session and the interview that the mirror balls do not explain:
    /// interview = exposure · Σ interview_weights_i · OLAT_i.
    pub exposure: f32,
    /// For each lamp and channel, its share in the interview's light.
    pub interview_weights: Vec<[f32; 3]>,
    /// Share of the interview probe's energy from where no lamp is.
    pub uncovered_energy: f32,
    /// Relative residual of the interview probe after the fit, 0 when lamps explain all of it.
    pub probe_residual: f32,
    /// Root-mean-square encoded distance of the quantiles, or pixels, that γ was fitted to.
    pub gamma_residual: f32,
    /// Share of the sphere that the ball does not show: behind it, and beyond the photograph.
    pub blind_share: f32,
    /// Share of the lamps' energy that the ball hides and that was filled in.
    pub filled_energy: f32,
    /// Clipped pixels in the mirror balls: their lamps are brighter than measured.
    pub clipped_pixels: usize,
    /// What the fit of the response rests on.
    #[serde(default)]
    pub gamma_evidence: Evidence,
    /// The lamps.
    #[serde(flatten)]
    pub rig: Rig,
}

/// Refuses a shoot that lacks poses, lamps or frames.
fn check_shoot(project: &Project) -> Result<()> {
    let shoot = &project.settings.shoot;
    for (what, count) in [
        ("poses", shoot.poses.len()),
        ("lamps", shoot.lamps.len()),
        ("frames", shoot.frames.len()),
    ] {
        if count == 0 {
            return Err(Error::unexpected(
                project.root.join("project.toml").display(),
                format!("at least one of {what}"),
                "none",
                "Import a shoot that has exemplars, probes and an interview",
            ));
        }
    }
    Ok(())
}

/// Calibrates a project from its mirror balls, poses and interview. The response is fitted by pixels
/// where a frame shows a pose, else by distributions.
///
/// # Errors
/// When the shoot lacks poses, frames or lamps, a file cannot be read or does not fit the others, or
/// a stop was asked for.
pub fn calibrate(project: &Project, progress: &Progress) -> Result<Calibration> {
    calibrate_by(project, None, progress)
}

/// Calibrates a project, with the response fitted by the comparison that is `wanted`.
///
/// # Errors
/// As [`calibrate`], and when pixels are to be compared and no frame shows a pose.
pub fn calibrate_by(
    project: &Project,
    wanted: Option<Comparison>,
    progress: &Progress,
) -> Result<Calibration> {
    check_shoot(project)?;
    let shoot = &project.settings.shoot;
    let probes = Probes::load(project, progress)?;
    let subject = Subject::load(project, &probes, progress)?;
    let fit = gamma::fit(&subject, &probes, wanted, progress)?.fit;
    let evidence = Evidence::new(&fit, shoot);
    if let Some(sentence) = evidence.same_poses_sentence() {
        progress.say(sentence);
    }
    let table = Table::new(&fit.response);
    let interview = probes.fit(&table);
    let (rig, filled_energy) = probes.rig(&shoot.lamps, &table);
    let calibration = Calibration {
        response: fit.response,
        gamma_deviation: [fit.deviation[0], fit.deviation[1]],
        exposure: fit.exposure,
        interview_weights: interview.weights,
        uncovered_energy: interview.uncovered,
        probe_residual: interview.residual,
        gamma_residual: fit.residual,
        blind_share: probes.ball().blind_share,
        clipped_pixels: probes.clipped_pixels() + probes.clipped_interview_pixels(),
        filled_energy,
        gamma_evidence: evidence,
        rig,
    };
    for warning in calibration.warnings() {
        progress.say(warning);
    }
    Ok(calibration)
}

impl Calibration {
    /// Reads the project's calibration.
    ///
    /// # Errors
    /// When there is none, it is damaged, or it belongs to other lamps.
    pub fn load(project: &Project) -> Result<Self> {
        const REMEDY: &str = "Run afterlight calibrate on the project";
        let path = project.calibration_path();
        let text =
            std::fs::read_to_string(&path).map_err(|e| Error::file("open", &path, e, REMEDY))?;
        let calibration: Self =
            toml::from_str(&text).map_err(|e| Error::file("read", &path, e.message(), REMEDY))?;
        DualGamma::new(calibration.response.gamma1, calibration.response.gamma2)?;
        let refuse = |expected: String, found: String| {
            Err(Error::unexpected(path.display(), expected, found, REMEDY))
        };
        let lamps = &project.settings.shoot.lamps;
        let (found, weights) = (&calibration.rig.lamps, &calibration.interview_weights);
        if found.len() != lamps.len() || weights.len() != lamps.len() {
            return refuse(
                format!("{} lamps", lamps.len()),
                format!("{} lamps and {} weights", found.len(), weights.len()),
            );
        }
        if let Some((name, lamp)) = lamps
            .iter()
            .zip(found)
            .find(|(name, lamp)| **name != lamp.name)
        {
            return refuse(format!("lamp {name}"), format!("lamp {}", lamp.name));
        }
        let is_light = |v: &f32| v.is_finite() && *v >= 0.0;
        let sound = weights.iter().flatten().all(is_light)
            && is_light(&calibration.exposure)
            && found
                .iter()
                .all(|lamp| lamp.direction.is_normalized() && lamp.energy.iter().all(is_light));
        if !sound {
            return refuse(
                "finite weights and energies, unit directions".into(),
                "others".into(),
            );
        }
        Ok(calibration)
    }

    /// Writes the calibration into the project.
    pub fn save(&self, project: &Project) -> Result<()> {
        save_toml(&project.calibration_path(), self)
    }

    /// What the person should know before trusting the calibration, a sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.clipped_pixels > 0 {
            warnings.push(format!(
                "{} pixels of the mirror balls are clipped: their lamps are brighter than measured. Photograph \
                 the balls with a denser filter",
                self.clipped_pixels
            ));
        }
        let doubtful: Vec<&str> = self
            .rig
            .lamps
            .iter()
            .filter(|lamp| lamp.confidence < 0.5)
            .map(|lamp| lamp.name.as_str())
            .collect();
        if !doubtful.is_empty() {
            warnings.push(format!(
                "the mirror ball hardly shows {}: hidden behind it, clipped or dark",
                doubtful.join(", ")
            ));
        }
        if self.probe_residual > 0.1 {
            warnings.push(format!(
                "the lamps explain the interview's mirror ball only to {:.0} %: was it lit by other lamps?",
                100.0 * (1.0 - self.probe_residual)
            ));
        }
        warnings.extend(
            self.gamma_evidence
                .warnings(self.gamma_deviation, self.exposure),
        );
        warnings
    }
}

#[cfg(test)]
mod tests;
