//! The figures of a run.

use crate::panel_context::PanelContext;
use crate::panels::job;
use crate::panels::lamp_title;
use crate::status::RunningJob;
use crate::theme::{self, GAP};
use base::progress::{LossPoint, TrainingPhase, TrainingPoint};
use egui::{RichText, Ui};
use footage::scan::counted;
use project::Project;

/// The figures of the run, and its warnings.
pub fn figures_ui(ui: &mut Ui, context: &PanelContext, project: &Project) {
    // Rows of text alone need no room for buttons.
    ui.spacing_mut().interact_size.y = 0.0;
    let rows = rows(context);
    let (plain, details) = rows.split_at(PLAIN);
    grid_ui(ui, "figures of training", plain);
    egui::CollapsingHeader::new(RichText::new("Details").size(12.0).color(theme::QUIET))
        .id_salt("details of training")
        .show(ui, |ui| grid_ui(ui, "details of training", details));
    let point = context.readers.training.point.as_ref();
    for warning in point.map_or(vec![], |point| warnings(point, project)) {
        ui.label(RichText::new(warning).size(12.5).color(theme::WARNING));
    }
}

/// Name, value and explanation.
type Figure = (&'static str, String, &'static str);

/// Number of figures at the top; the rest are the optimiser's, and folded.
const PLAIN: usize = 5;

fn grid_ui(ui: &mut Ui, name: &str, figures: &[Figure]) {
    egui::Grid::new(name).num_columns(2).spacing([2.0 * GAP, 2.0]).show(ui, |ui| {
        for (name, value, hint) in figures {
            ui.label(RichText::new(*name).size(12.0).color(theme::QUIET)).on_hover_text(*hint);
            ui.label(RichText::new(value).size(12.5)).on_hover_text(*hint);
            ui.end_row();
        }
    });
}

/// All figures; a dash for those not known yet.
fn rows(context: &PanelContext) -> [Figure; 11] {
    let training = &context.readers.training;
    let present = training.records.as_ref().and_then(|r| r.present.as_ref());
    let (point, last) = (training.point.as_ref(), training.history.points().last());
    let none = || "–".to_owned();
    let job = context.status.job.as_ref().filter(|_| training.running);
    let recent = |term: fn(&LossPoint) -> Option<f32>| {
        let mut points = training.history.points().iter().rev();
        points.find_map(term)
    };
    let loss = |value: Option<f32>| value.map_or_else(none, |value| format!("{value:.4}"));
    let step = last.map(|p| p.step).or(present.map(|p| p.step));
    let seconds = last.map(|p| p.seconds).or(present.map(|p| p.seconds));
    let best = present.and_then(|p| p.held_out);
    let held_out = recent(|p| p.held_out_db).map(|db| match best {
        Some(best) => format!("{db:.2} dB, best {:.2}", best.decibels),
        None => format!("{db:.2} dB"),
    });
    [
        ("Step", step.map_or_else(none, |s| s.to_string()), "Optimiser steps, including earlier runs"),
        ("Trained", seconds.map_or_else(none, clock), "Training time, without pauses"),
        ("Progress", job.map_or_else(none, left), "Time left, and share done"),
        ("Rate", point.map_or_else(none, rate), "Speed of training"),
        ("Held-out pose", held_out.unwrap_or_else(none), "PSNR on the held-out pose; the best network is used"),
        ("Phase", point.map_or_else(none, |p| phase(p).to_owned()), "Current training pictures"),
        (
            "Learning rate",
            point.map_or_else(none, |p| format!("{:.2e}", p.learning_rate)),
            "The optimiser's learning rate",
        ),
        (
            "Gradient",
            point.map_or_else(none, |p| format!("{:.3}", p.gradient_norm)),
            "Norm of all gradients before clipping",
        ),
        ("Loss, OLATs", loss(recent(|p| p.reconstruction)), "Reconstruction loss of the last steps"),
        ("Loss, relit", loss(recent(|p| p.rendering)), "Rendering loss of the last steps"),
        (
            "Memory",
            point.and_then(|p| p.memory_bytes).map_or_else(none, |b| format!("{} MB", b / 1_000_000)),
            "Used by the whole program",
        ),
    ]
}

/// Problems of the run.
fn warnings(point: &TrainingPoint, project: &Project) -> Vec<String> {
    let mut warnings = Vec::new();
    if !point.dead_lamps.is_empty() {
        let lamps = &project.settings.shoot.lamps;
        let names: Vec<String> =
            (point.dead_lamps.iter()).filter_map(|&lamp| lamps.get(lamp).map(|name| lamp_title(name))).collect();
        warnings.push(format!("Stuck at black or white: {}. Stop and start over.", names.join(", ")));
    }
    if point.skipped_steps > 0 {
        let steps = counted(point.skipped_steps as usize, "step");
        warnings.push(format!("{steps} skipped: NaN or infinite values"));
    }
    warnings
}

fn phase(point: &TrainingPoint) -> &'static str {
    match point.phase {
        TrainingPhase::Exemplars => "Poses",
        TrainingPhase::Interview => "Interview",
    }
}

fn rate(point: &TrainingPoint) -> String {
    match point.steps_per_second {
        rate if rate <= 0.0 => "–".to_owned(),
        rate if rate < 1.0 => format!("{:.2} s per step", 1.0 / rate),
        rate => format!("{rate:.1} steps per second"),
    }
}

fn left(job: &RunningJob) -> String {
    match job::state(job) {
        text if text.is_empty() => format!("{:.0} % done", 100.0 * job.share),
        text => format!("{text}, {:.0} % done", 100.0 * job.share),
    }
}

/// Hours, minutes and seconds.
pub fn clock(seconds: f64) -> String {
    let seconds = seconds.max(0.0) as u64;
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    match hours {
        0 => format!("{minutes}:{seconds:02}"),
        _ => format!("{hours}:{minutes:02}:{seconds:02}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_of_training_is_a_clock_s() {
        assert_eq!([9.5, 754.0, 7265.0].map(clock), ["0:09", "12:34", "2:01:05"]);
    }
}
