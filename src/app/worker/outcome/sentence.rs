//! Sentences for reports without a sentence of their own.

use super::report::{EnvironmentsReport, ImportReport};
use calibration::develop::DevelopReport;
use evaluation::review::{Means, ReviewReport};
use evaluation::{EvaluateReport, Method};
use footage::scan::counted;
use training::TrainReport;
use virtual_stage::StageReport;

/// A duration in words, from seconds.
pub(super) fn for_so_long(seconds: f64) -> String {
    match seconds {
        ..60.0 => format!("{seconds:.0} s"),
        ..6000.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

/// A loss that no step computed is left out.
pub(super) fn trained(report: &TrainReport) -> String {
    let mut text = format!("Trained for {}, {}", for_so_long(report.seconds), counted(report.steps as usize, "step"));
    let losses = [("OLATs", report.loss_rec), ("relit", report.loss_render)];
    let known = losses.iter().filter(|(_, loss)| !loss.is_nan());
    let known: Vec<String> = known.map(|(of, loss)| format!("{of} {loss:.4}")).collect();
    if !known.is_empty() {
        text += &format!(". Error: {}, by {}", known.join(", "), report.features);
    }
    if let Some(found) = &report.prediction {
        text += &format!(
            ". OLATs of pose {}, held out: {:.1} dB carried over, {:.1} dB with the network",
            found.pose, found.carried_db, found.corrected_db
        );
    }
    text
}

pub(super) fn staged(report: &StageReport) -> String {
    let mut text = format!("{} files in {:.0} s. Traced:", report.files, report.seconds);
    for effect in &report.effects {
        let share = 100.0 * effect.share;
        text += &format!("\n  {} for {share:.1} % of {}; elsewhere {}", effect.name, effect.of, effect.skipped);
    }
    text
}

pub(super) fn imported(found: &ImportReport) -> String {
    let mut text = format!(
        "{}: {} frames, {} poses under {} lamps, {} environments, working size {} pixels. The project is in {}",
        found.name,
        found.frames,
        found.poses,
        found.lamps,
        found.environments,
        found.size,
        found.project.display()
    );
    for kind in &found.pictures {
        text += &format!("\n{kind}");
    }
    if let (Some(covering), Some(separation)) = (found.covering_deg, found.separation_deg) {
        text += &format!(
            "\nThe lamps are evenly distributed: every direction that the whole rig covers is within {covering:.1}° \
             of one of them, and no two are closer than {separation:.1}°"
        );
    }
    text
}

pub(super) fn listed(report: &EnvironmentsReport) -> String {
    let lines = report.environments.iter().map(|known| {
        let front = known.front.map_or(String::new(), |front| format!(", front at yaw {:.1}°", front.yaw_deg()));
        let owner = if known.added { "added" } else { "the shoot's" };
        let line = format!("{}: {}, {owner}{front}", known.name, known.file.display());
        match known.complaint() {
            Some(complaint) => format!("{line}. {complaint}"),
            None => line,
        }
    });
    let lines: Vec<String> = lines.collect();
    if lines.is_empty() { "The project has no environments of its own yet".to_owned() } else { lines.join("\n") }
}

pub(super) fn developed(report: &DevelopReport) -> String {
    let mut text = format!("{}:", report.written.display());
    for (i, ball) in report.balls.iter().enumerate() {
        text += &format!(
            " ball {} has its centre at {:.1}, {:.1} and a radius of {:.1} pixels; {:.0} % of its rim fits to within \
             {:.2} pixels; {} pixels are clipped;",
            i + 1,
            ball.circle.center_px[0],
            ball.circle.center_px[1],
            ball.circle.radius_px,
            100.0 * ball.rim_share,
            ball.residual_px,
            report.clipped_pixels[i]
        );
    }
    text += &format!(
        " the photographs do not show {:.1} % of the sphere, where {:.1} % of the light was filled in",
        100.0 * report.blind_share,
        100.0 * report.filled_share
    );
    let estimated = report.estimated_energy_share.iter().copied().fold(0.0, f32::max);
    if estimated > 0.0 {
        text += &format!("; {:.1} % of the light was estimated, for clipped lamps", 100.0 * estimated);
    }
    if let (Some(ratio), Some(stops)) = (report.exposure_ratio, report.disagreement_stops) {
        text += &format!("; the second ball is {ratio:.3} times as bright, and differs by {stops:.2} stops (median)");
    }
    text
}

pub(super) fn evaluated(report: &EvaluateReport) -> String {
    let scores = &report.scores;
    let method = match scores.method {
        Method::Prediction => "The prediction",
        Method::Transfer => "The poses carried over",
        Method::Network => "The network",
        Method::TruthOlats => "The true OLATs",
        Method::Nearest => "The nearest pose",
        Method::Ratio => "The ratio image",
        Method::Harmonics => "The ratio image of low-order harmonics",
        Method::Texler => "Patch-based training (Texler 2020)",
        Method::Sun => "Portrait relighting (Sun 2019)",
    };
    let relit: Vec<String> = scores.relit_psnr_db.iter().map(|(name, db)| format!("{db:.2} dB under {name}")).collect();
    let olats = scores.olat_psnr_db.map_or(String::new(), |db| format!("; OLATs {db:.2} dB"));
    let edges = scores
        .olat_shadow_edges
        .map_or(String::new(), |edges| format!(", {:.2} dB at the edges of shadows", edges.psnr_db));
    let frames: Vec<String> = scores.frames.iter().map(ToString::to_string).collect();
    let (relit, frames) = (relit.join(", "), frames.join(", "));
    let flicker = report.flicker.map_or(String::new(), |flicker| format!("\n{}", flicker.sentence()));
    let learnt = match (report.training_seconds, report.training_steps) {
        (Some(seconds), Some(steps)) if scores.method.learns() => {
            let minutes = seconds / 60.0;
            let ms = scores.frame_ms.unwrap_or_default();
            format!("; learnt for {minutes:.1} min, {steps} steps; {ms:.0} ms a picture")
        }
        _ => String::new(),
    };
    format!("{method}: {relit}{olats}{edges}; frames {frames}{learnt}{flicker}")
}

pub(super) fn reviewed(report: &ReviewReport) -> String {
    let over = |what: &str, means: &Means| {
        let cell = &means.over_cells;
        format!("{} {what}: FLIP {:.3}, PSNR {:.1} dB, SSIM {:.3}", means.cases, cell.flip, cell.psnr_db, cell.ssim)
    };
    let unseen = (report.unseen.iter()).map(|m| over("frames or poses kept out of training", m));
    let seen = report.seen.iter().map(|m| over("seen in training", m));
    let mut text = unseen.chain(seen).collect::<Vec<_>>().join("; ");
    if let Some(worst) = report.worst.first() {
        text += &format!(". The worst is {} in {}, FLIP {:.3}", worst.lamp, worst.case, worst.cell.flip);
    }
    if let Some(path) = &report.report {
        text += &format!(". The report is {}", path.display());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use training::Prediction;

    fn report(loss_rec: f32, loss_render: f32) -> TrainReport {
        TrainReport {
            steps: 1,
            seconds: 90.0,
            device: "CPU".to_owned(),
            features: "the built-in features".to_owned(),
            parameters: 1,
            loss_rec,
            loss_render,
            skipped_steps: 0,
            held_out: None,
            prediction: None,
            dead_lamps: vec![],
        }
    }

    #[test]
    fn a_loss_that_no_step_had_is_left_out() {
        let said = |loss_rec, loss_render| trained(&report(loss_rec, loss_render));
        let begin = "Trained for 2 min, 1 step";
        let both = format!("{begin}. Error: OLATs 0.2500, relit 0.1250, by the built-in features");
        assert_eq!(said(0.25, 0.125), both);
        let relit = format!("{begin}. Error: relit 0.1250, by the built-in features");
        assert_eq!(said(f32::NAN, 0.125), relit);
        assert_eq!(said(f32::NAN, f32::NAN), begin);
    }

    #[test]
    fn what_training_adds_to_a_held_out_pose_is_said() {
        let mut report = report(f32::NAN, f32::NAN);
        report.prediction = Some(Prediction { pose: 4, carried_db: 28.94, corrected_db: 29.06 });
        let found = "OLATs of pose 4, held out: 28.9 dB carried over, 29.1 dB with the network";
        assert_eq!(trained(&report), format!("Trained for 2 min, 1 step. {found}"));
    }
}
