//! Calibration of a shoot without mirror balls: directions from its list of lamps, energies and the interview's light from
//! the subject.

mod curve;
mod pictures;
mod stereo;

use crate::calibration::Calibration;
use crate::code_values::PROVISIONAL;
use crate::gamma::{Evidence, is_scene_linear};
use crate::settings::CalibrateSettings;
use crate::{motion, rig_check};
use base::error::Result;
use base::progress::Progress;
use curve::Curve;
use imaging::Response;
use pictures::Pictures;
use project::Project;
use stereo::rig;

/// Calibrates a shoot without mirror balls.
///
/// # Errors
/// When a picture cannot be read, no frame shows the subject like a pose, or the job was stopped.
pub fn calibrate(project: &Project, settings: &CalibrateSettings, progress: &Progress) -> Result<Calibration> {
    let shoot = &project.settings.shoot;
    let by_files = settings.trial.is_none() && is_scene_linear(project)?;
    let known = match &settings.trial {
        Some(trial) => Some(trial.response),
        None => by_files.then_some(Response::Srgb),
    };
    let mut pictures = Pictures::read(project, &known.unwrap_or(PROVISIONAL), progress)?;
    let mut light = pictures.interview_light(project)?;
    let mut found = Curve { response: known.unwrap_or(PROVISIONAL), deviation: 0.0, is_fitted: false };
    if known.is_none() {
        found = Curve::fit(project, &light)?;
        if found.response != PROVISIONAL {
            pictures = Pictures::read(project, &found.response, progress)?;
            light = pictures.interview_light(project)?;
        }
    }
    let evidence = Evidence { by_hand: settings.trial.is_some(), by_files, ..found.evidence(project, &light) };
    progress.say(format!(
        "No mirror balls: frame {} is a sum of the lamps of pose {} within {:.1} %",
        shoot.frames.name(light.frame),
        shoot.poses[light.pose],
        100.0 * light.residual
    ));
    let mut rig = rig(&pictures.poses, shoot.all_lamps(), &shoot.lamp_layout);
    let motion = motion::measure(project, settings, &found.response, &rig, progress)?;
    let (rig_faults, rig_findings) = rig_check::check_project(project, &rig, 0.0)?.into_iter().unzip();
    let learnt = shoot.lamps.len();
    let stand_in = (!shoot.other_lamps.is_empty()).then(|| pictures.stand_in(&light, learnt));
    rig.lamps.truncate(learnt);
    Ok(Calibration {
        response: found.response,
        gamma_deviation: [found.deviation as f32; 2],
        exposure: settings.trial.map_or(1.0, |trial| trial.exposure),
        interview_weights: light.weights,
        stand_in,
        uncovered_energy: 0.0,
        probe_residual: light.residual,
        gamma_residual: light.residual,
        blind_share: 0.0,
        filled_energy: 0.0,
        clipped_pixels: 0,
        gamma_evidence: evidence,
        rig_findings,
        rig_faults,
        two_balls: None,
        motion,
        by_list: true,
        rig,
    })
}
