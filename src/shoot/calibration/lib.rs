//! Calibration: lamp directions and energies, the interview's light as a sum of lamps, and the camera response.

mod arc_cosine;
mod blind_cone;
mod calibration;
pub mod cholesky;
mod code_values;
pub mod develop;
mod footprint;
pub mod gamma;
mod highlight;
mod least_squares;
pub mod light_probe;
mod listed;
mod minimizer;
pub mod mirror_ball;
mod motion;
pub mod probe;
pub mod rig_check;
mod second_ball;
mod settings;
#[cfg(test)]
mod shading;
pub mod silhouette;
mod stand_in;
mod trial;

pub use calibration::Calibration;
pub use code_values::PROVISIONAL;
pub use second_ball::{NearLamp, TwoBalls};
pub use settings::CalibrateSettings;
pub use silhouette::Circle;
pub use stand_in::StandIn;
pub use trial::Trial;

use base::error::Result;
use base::progress::Progress;
use code_values::ResponseTable;
use gamma::{ChosenResponse, Subject, is_scene_linear};
use glam::Vec3;
use light::subset::{self, Subset};
use probe::Probes;
use project::Project;
use rig_check::Fault;
use silhouette::Photographs;

/// Increase of the deviations of γ1 and γ2 for clipped balls, because the fit has no model of the glare around a
/// clipped lamp. Measured on a session whose balls were taken twice, clipped and not: both exponents came out 0.05
/// higher.
const CLIPPED_DEVIATION: f32 = 0.05;

/// Calibrates a project from its mirror balls, poses and interview. By default the response is fitted pixel by
/// pixel if a frame shows a pose, else by distributions. The settings' circle becomes the project's, in memory.
///
/// # Errors
/// When the shoot lacks poses, frames or lamps, a file cannot be read or does not match the others, no ball is
/// found, pixels are to be compared and no frame shows a pose, or the job was stopped. The project then stays
/// unchanged.
pub fn calibrate(project: &mut Project, settings: &CalibrateSettings, progress: &Progress) -> Result<Calibration> {
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
fn calibrate_within(project: &Project, settings: &CalibrateSettings, progress: &Progress) -> Result<Calibration> {
    let shoot = &project.settings.shoot;
    let probes = Probes::load(project, progress)?;
    let subject = Subject::load(project, &probes, progress)?;
    let clipped_pixels = probes.clipped_pixels() + probes.clipped_interview_pixels();
    let found = match &settings.trial {
        Some(trial) => ChosenResponse::by_hand(&subject, &probes, trial),
        None if is_scene_linear(project)? => {
            progress.say("Interview and OLAT files are scene-linear: no response is fitted".to_owned());
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
    let motion = motion::measure(project, settings, &found.response, &rig, progress)?;
    let wrong_circle = probes.wrong_circle().map(str::to_owned);
    let (rig_faults, rig_findings) = (wrong_circle.map(|sentence| (Fault::WrongCircle, sentence)))
        .into_iter()
        .chain(rig_check::check_project(project, &rig, probes.ball().blind_half_angle_deg)?)
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

#[cfg(test)]
mod tests;
