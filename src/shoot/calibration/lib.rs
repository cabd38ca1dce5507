//! Calibration: lamp directions and energies, the interview's light as a sum of lamps, and the camera response.

mod blind_cone;
pub mod cholesky;
mod code_values;
pub mod develop;
mod footprint;
pub mod gamma;
mod highlight;
mod least_squares;
pub mod light_probe;
mod listed;
pub mod median;
mod minimizer;
pub mod mirror_ball;
mod motion;
pub mod probe;
pub mod rig_check;
mod second_ball;
mod settings;
pub mod shading;
pub mod silhouette;

pub use second_ball::{NearLamp, TwoBalls};
pub use settings::{CalibrateSettings, Trial};
pub use silhouette::Circle;

use base::error::{Error, Result};
use base::progress::Progress;
use code_values::ResponseTable;
use footage::Motion;
use gamma::{ChosenResponse, Evidence, Subject};
use glam::Vec3;
use imaging::Response;
use light::subset::{self, Subset};
use light::{Lamp, Rig};
use probe::Probes;
use project::{Picture, Project, read_sealed, save_sealed};
use rig_check::Fault;
use serde::{Deserialize, Serialize};
use silhouette::Photographs;

/// Response for reading the balls before the fit. Pixels far above black are so under any response.
pub const PROVISIONAL: Response = Response::Power(2.2);

/// Increase of the deviations of γ1 and γ2 for clipped balls, because the fit has no model of the glare around a
/// clipped lamp. Measured on a session whose balls were taken twice, clipped and not: both exponents came out 0.05
/// higher.
const CLIPPED_DEVIATION: f32 = 0.05;

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

/// The interview's light as a sum of only the learnt lamps, for shoots where other lamps lit it too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StandIn {
    /// Share of each learnt lamp per channel: the least-squares fit, in linear light, of the poses' OLATs to their
    /// sum under all [`Calibration::interview_weights`].
    pub weights: Vec<[f32; 3]>,
    /// Root-mean-square difference of the two sums, relative to the sum of all lamps.
    pub residual: f32,
}

/// Calibrates a project from its mirror balls, poses and interview. By default the response is fitted pixel by
/// pixel if a frame shows a pose, else by distributions. The settings' circle becomes the project's, in memory.
///
/// # Errors
/// When the shoot lacks poses, frames or lamps, a file cannot be read or does not match the others, no ball is
/// found, pixels are to be compared and no frame shows a pose, or the job was stopped. The project then stays
/// unchanged.
pub fn calibrate(
    project: &mut Project,
    settings: &CalibrateSettings,
    progress: &Progress,
) -> Result<Calibration> {
    project.check_parts()?;
    let mut within = project.clone();
    if let Some(circle) = settings.circle {
        circle.apply_to(&mut within.settings.shoot.ball);
    }
    let calibration = if project.settings.shoot.without_balls {
        listed::calibrate(project, settings, progress)?
    } else {
        find_circles(&mut within, settings.find_circle, progress)?;
        calibrate_within(&within, settings, progress)?
    };
    *project = within;
    for warning in calibration.warnings() {
        progress.say(warning);
    }
    Ok(calibration)
}

/// Finds the balls' circles in their photographs: the unknown ones, or all of them if `again`.
///
/// # Errors
/// When a photograph cannot be read or shows no ball, or the job was stopped.
fn find_circles(project: &mut Project, again: bool, progress: &Progress) -> Result<()> {
    if again || !project.settings.shoot.ball.has_circle() {
        let photographs = Photographs::read(&project.probe_pictures(), progress)?;
        let found = silhouette::find(&photographs)?;
        progress.say(format!(
            "Mirror ball found: centre {:.1}, {:.1}, radius {:.1} pixels. The rim follows that circle to {:.2} \
             pixels over {:.0} % of the circumference",
            found.circle.center_px[0],
            found.circle.center_px[1],
            found.circle.radius_px,
            found.residual_px,
            100.0 * found.rim_share
        ));
        found.circle.apply_to(&mut project.settings.shoot.ball);
    }
    second_ball::find_circle(project, again, progress)
}

/// Calibrates with the project's own circle.
fn calibrate_within(
    project: &Project,
    settings: &CalibrateSettings,
    progress: &Progress,
) -> Result<Calibration> {
    let shoot = &project.settings.shoot;
    let probes = Probes::load(project, progress)?;
    let subject = Subject::load(project, &probes, progress)?;
    let clipped_pixels = probes.clipped_pixels() + probes.clipped_interview_pixels();
    let found = match &settings.trial {
        Some(trial) => ChosenResponse::by_hand(&subject, &probes, trial),
        None if is_scene_linear(project)? => {
            progress
                .say("Interview and OLAT files are scene-linear: no response is fitted".to_owned());
            ChosenResponse::by_files(&subject, &probes)
        }
        None => {
            let mut fit = gamma::fit(&subject, &probes, settings.comparison, progress)?.fit;
            if clipped_pixels > 0 {
                fit.widen(CLIPPED_DEVIATION);
            }
            ChosenResponse::fitted(&fit, shoot)
        }
    };
    if let Some(sentence) = found.evidence.same_poses_sentence() {
        progress.say(sentence);
    }
    let table = ResponseTable::from_response(&found.response);
    let interview = probes.fit(&table);
    let measured = second_ball::rig(project, &probes, &table, progress)?;
    let second_ball::MeasuredRig { mut rig, filled_energy, two_balls } = measured;
    if let Some(two) = &two_balls {
        progress.say(two.sentence());
    }
    let motion = find_motion(project, settings, &found.response, &rig, progress)?;
    let wrong_circle = probes.wrong_circle().map(str::to_owned);
    let (rig_faults, rig_findings) = (wrong_circle.map(|sentence| (Fault::WrongCircle, sentence)))
        .into_iter()
        .chain(rig_findings(project, &rig, probes.ball().blind_half_angle_deg)?)
        .unzip();
    rig.lamps.truncate(shoot.lamps.len());
    let has_others = !shoot.other_lamps.is_empty();
    Ok(Calibration {
        response: found.response,
        gamma_deviation: found.deviation,
        exposure: found.exposure,
        stand_in: has_others.then(|| subject.stand_in(&table, &found.weights, shoot.lamps.len())),
        interview_weights: found.weights,
        uncovered_energy: interview.uncovered,
        probe_residual: interview.residual,
        gamma_residual: found.residual,
        blind_share: probes.ball().blind_share,
        clipped_pixels,
        filled_energy,
        gamma_evidence: found.evidence,
        rig_findings,
        rig_faults,
        two_balls,
        motion,
        by_list: false,
        rig,
    })
}

/// Motion of the subject between the lamps of `rig`, unless the settings skip it.
fn find_motion(
    project: &Project,
    settings: &CalibrateSettings,
    response: &Response,
    rig: &Rig,
    progress: &Progress,
) -> Result<Option<Motion>> {
    if settings.keep_motion {
        return Ok(None);
    }
    let direction = |lamp: &Lamp| lamp.is_usable().then_some(lamp.direction);
    let directions: Vec<_> = rig.lamps.iter().map(direction).collect();
    let motion = motion::find(project, response, &directions, progress)?;
    if let Some(sentence) = motion.sentence() {
        progress.say(sentence);
    }
    Ok(Some(motion))
}

/// True if the files of interview and OLATs hold scene-linear light.
///
/// # Errors
/// When only one of them does, or a file cannot be read.
fn is_scene_linear(project: &Project) -> Result<bool> {
    let (frame, olat) = (project.frame_picture(0), project.first_olat(0));
    let light = [&frame, &olat].map(footage::is_scene_linear);
    let [frame_light, olat_light] = light;
    match (frame_light?, olat_light?) {
        (true, true) => Ok(true),
        (false, false) => Ok(false),
        (frame_is_light, _) => {
            let (light, codes) = if frame_is_light { (frame, olat) } else { (olat, frame) };
            Err(Error::invalid(
                format!(
                    "{} is scene-linear, but {} has codes of an unknown curve, so they cannot be compared",
                    light.display(),
                    codes.display()
                ),
                (
                    "Develop interview and OLATs alike, or give the response of the coded pictures",
                    "afterlight calibrate PROJECT --gamma srgb",
                ),
            ))
        }
    }
}

/// Faults of the lamps, each with its sentence.
fn rig_findings(
    project: &Project,
    rig: &Rig,
    blind_half_angle_deg: f32,
) -> Result<Vec<(Fault, String)>> {
    let layout = &project.settings.shoot.lamp_layout;
    let findings = rig_check::check(rig, blind_half_angle_deg, layout);
    let mut found: Vec<(Fault, String)> =
        findings.into_iter().map(|f| (f.fault, f.sentence)).collect();
    // The first is the interview's ball.
    let balls = project.probe_pictures();
    for same in rig_check::same_pictures(balls.get(1..).unwrap_or_default())? {
        let names: Vec<&str> = same.iter().map(|&lamp| rig.lamps[lamp].name.as_str()).collect();
        let sentence = format!(
            "the mirror balls of {} are copies of one picture. Give each lamp its own photograph",
            names.join(", ")
        );
        found.push((Fault::SamePicture, sentence));
    }
    let shoot = &project.settings.shoot;
    let mut olats = std::collections::BTreeMap::<Vec<usize>, Vec<&str>>::new();
    for (pose, name) in shoot.poses.iter().enumerate() {
        let lamps = project.pose_lamps(pose);
        let olat = |&lamp: &usize| project.olat_picture(pose, lamp);
        let pictures: Vec<Picture> = lamps.iter().map(olat).collect();
        for same in rig_check::same_pictures(&pictures)? {
            let same = same.into_iter().map(|place| lamps[place]).collect();
            olats.entry(same).or_default().push(name);
        }
    }
    for (same, poses) in olats {
        let sentence = format!(
            "{} of {} are copies of one picture. Give each lamp its own OLAT, or leave these lamps out",
            same.iter().map(|&lamp| shoot.lamp(lamp).as_str()).collect::<Vec<_>>().join(", "),
            poses.join(", ")
        );
        found.push((Fault::SamePicture, sentence));
    }
    Ok(found)
}

/// Chooses `count` of the lamps that the project's network learns, evenly distributed, to be learnt alone; the caller
/// saves the project. The calibration still uses the others. Lamps that the balls do not show are skipped.
///
/// # Errors
/// When the project has fewer lamps, or the balls cannot be read.
pub fn keep_lamps(project: &mut Project, count: usize, progress: &Progress) -> Result<Subset> {
    if !project.settings.shoot.without_balls {
        find_circles(project, false, progress)?;
    }
    let shoot = &project.settings.shoot;
    let learnt = shoot.lamps.len();
    let (places, directions): (Vec<usize>, Vec<Vec3>) = if shoot.lamp_layout.is_empty() {
        let probes = Probes::load(project, progress)?;
        let table = ResponseTable::from_response(&PROVISIONAL);
        let rig = second_ball::rig(project, &probes, &table, progress)?.rig;
        let lamps = rig.lamps.iter().enumerate().take(learnt);
        let usable = lamps.filter(|(_, lamp)| lamp.is_usable());
        usable.map(|(i, lamp)| (i, lamp.direction)).unzip()
    } else {
        shoot.lamp_layout.iter().copied().enumerate().take(learnt).unzip()
    };
    let mut subset = subset::choose(&directions, count)?;
    for index in &mut subset.indices {
        *index = places[*index];
    }
    project.settings.shoot.learn(&subset.indices);
    Ok(subset)
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
            return Err(Error::missing(
                "Not calibrated yet",
                ("Calibrate first", "afterlight calibrate PROJECT"),
            ));
        }
        let text = read_sealed(&path, REMEDY)?;
        let calibration: Self =
            toml::from_str(&text).map_err(|e| Error::codec("read", &path, e.message(), REMEDY))?;
        let refuse =
            |problem: String| Err(Error::invalid(format!("{} {problem}", path.display()), REMEDY));
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
        if let Some((name, lamp)) = lamps.iter().zip(found).find(|(name, lamp)| **name != lamp.name)
        {
            return refuse(format!("has lamp {} where the project has lamp {name}", lamp.name));
        }
        let is_light = |v: &f32| v.is_finite() && *v >= 0.0;
        let sound = weights.iter().chain(stand_in).flatten().all(is_light)
            && is_light(&calibration.exposure)
            && found
                .iter()
                .all(|lamp| lamp.direction.is_normalized() && lamp.energy.iter().all(is_light));
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

#[cfg(test)]
mod tests;
