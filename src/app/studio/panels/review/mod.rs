//! The review: the network's error for each lamp and frame, and a person's marks and notes.

mod chosen;
pub mod command;
mod handler;
mod map;
pub mod query;
mod sheet;
mod strip;
mod trust;
mod verdict;

pub use sheet::LampSheetPanel;

use crate::command::{Command, Dialog, ReviewCommand, ViewCommand};
use crate::panel_context::PanelContext;
use crate::panels::lamp_title;
use crate::panels::widgets::missing;
use crate::panels::widgets::rows::segments_ui;
use crate::status::Phase;
use crate::theme::{self, GAP};
use base::files::shown;
use chosen::ChosenUi;
use egui::{Button, RichText, ScrollArea, Ui};
use evaluation::review::{Means, Metric, Review};
use footage::scan::counted;
use worker::SavedReview;

/// Length of the list of largest errors.
const WORST: usize = 12;

/// The panel has no state of its own.
#[derive(Default)]
pub struct ReviewPanel;

impl ReviewPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.add_space(GAP);
            // Leaves room for the scroll bar.
            ui.set_max_width(ui.available_width() - GAP);
            self.contents_ui(ui, context, out);
            ui.add_space(GAP);
            trust::trust_ui(ui, context, out);
            ui.add_space(GAP);
        });
    }

    fn contents_ui(&self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let kept = match &context.readers.review.saved {
            _ if context.session.project.is_none() => {
                return quiet_ui(ui, "Open a project to review its network.");
            }
            None => return quiet_ui(ui, "Reading the last measurement."),
            Some(Err(sentence)) => {
                ui.colored_label(theme::WARNING, sentence);
                ui.add_space(GAP);
                return buttons_ui(ui, context, None, out);
            }
            Some(Ok(kept)) => kept,
        };
        let Some(review) = &kept.review else { return empty_ui(ui, context, kept, out) };
        buttons_ui(ui, context, Some(kept), out);
        if let Some(what) = kept.outdated {
            let changed = format!("This was measured before {what} changed. Measure again.");
            ui.colored_label(theme::WARNING, changed);
        }
        if let Some(failure) = &context.readers.review.failure {
            ui.colored_label(theme::WARNING, failure);
        }
        // A newer measurement may have fewer cases or lamps.
        let chosen = (context.state.review.chosen)
            .filter(|&(case, lamp)| case < review.cases.len() && lamp < review.lamps.len());
        let metric = context.state.review.metric;
        ui.add_space(GAP);
        metrics_ui(ui, metric, out);
        means_ui(ui, review, metric);
        ui.add_space(GAP);
        let view = map::MapUi {
            review,
            metric,
            marks: &context.readers.review.marks,
            chosen,
            solo: &context.state.solo,
            frame: context.state.frame,
        };
        let from_map = view.ui(ui);
        ui.add_space(GAP);
        match chosen {
            Some(cell) => {
                let ui_of_chosen = ChosenUi { review, cell, marks: &context.readers.review.marks, metric };
                ui_of_chosen.ui(ui, out);
            }
            None => chosen::next_ui(ui, out),
        }
        ui.add_space(GAP);
        quiet_ui(ui, "Frames and poses, the worst mean first");
        strip::strip_ui(ui, review, context, out);
        ui.add_space(GAP);
        let from_list = worst_ui(ui, review, metric, chosen);
        if let Some(cell) = from_map.or(from_list) {
            out.push(Command::Review(ReviewCommand::Choose(cell)));
        }
    }
}

fn quiet_ui(ui: &mut Ui, sentence: &str) {
    ui.label(RichText::new(sentence).color(theme::QUIET));
}

/// Reason for the missing figures, and the button that makes them.
fn empty_ui(ui: &mut Ui, context: &PanelContext, kept: &SavedReview, out: &mut Vec<Command>) {
    if let Phase::Blocked(blocked) = &context.status.phase {
        ui.label("Nothing to measure yet.");
        if let Some(why) = missing::why(blocked) {
            quiet_ui(ui, why);
        }
        if context.status.job.is_none() {
            missing::provide_ui(ui, blocked.need, out);
        }
        return;
    }
    let poses = match context.session.project.map_or(0, |p| p.settings.shoot.poses.len()) {
        1 => "the pose".to_owned(),
        poses => format!("each of {poses} poses"),
    };
    ui.label("Not measured yet.");
    let frames = match &kept.truth {
        Some(folder) => format!(", and with the truth in {}", shown(folder)),
        None => String::new(),
    };
    quiet_ui(
        ui,
        &format!(
            "Measuring compares the prediction under every lamp with the photograph, in {poses}\
             {frames}."
        ),
    );
    ui.add_space(GAP);
    buttons_ui(ui, context, Some(kept), out);
}

fn buttons_ui(ui: &mut Ui, context: &PanelContext, kept: Option<&SavedReview>, out: &mut Vec<Command>) {
    let idle = context.status.job.is_none();
    let able = idle && context.is_live();
    let why = match (idle, context.is_live()) {
        (false, _) => "Wait until the running job ends.",
        (_, false) => "Train the network first.",
        _ => "",
    };
    let mut button = |ui: &mut Ui, text: &str, main: bool, able: bool, hint: &str, command: Command| {
        let button = if main { theme::main_button(able, text) } else { Button::new(text) };
        let response = ui.add_enabled(able, button);
        if response.on_hover_text(hint).on_disabled_hover_text(why).clicked() {
            out.push(command);
        }
    };
    ui.horizontal_wrapped(|ui| {
        let hint = "Compares every prediction with its photograph or truth";
        button(ui, "Measure", true, able, hint, Command::Review(ReviewCommand::Measure(None)));
        let hint = "Measures against another folder that contains truth/";
        button(ui, "Truth…", false, able, hint, Command::Dialog(Dialog::Truth));
        if kept.is_some_and(|kept| kept.review.is_some()) {
            let hint = "A web page with figures, pictures and notes";
            button(ui, "Report…", false, able, hint, Command::Dialog(Dialog::ReportPage));
        }
    });
}

fn metrics_ui(ui: &mut Ui, chosen: Metric, out: &mut Vec<Command>) {
    segments_ui(ui, |ui| {
        for metric in Metric::ALL {
            let hint = match metric {
                Metric::Flip => "Difference that a viewer notices when flipping the pictures: 0 to 1, lower is better",
                Metric::Psnr => "Error against white in decibels: higher is better",
                Metric::Ssim => "Similarity of structure: up to 1, higher is better",
            };
            let name = ui.add(Button::selectable(metric == chosen, metric.name()));
            if name.on_hover_text(hint).clicked() {
                out.push(Command::View(ViewCommand::Metric(metric)));
            }
        }
    });
}

/// The means over all cells.
fn means_ui(ui: &mut Ui, review: &Review, metric: Metric) {
    let (seen, unseen): (Vec<_>, Vec<_>) = review.cases.iter().partition(|case| case.seen);
    for (what, cases) in [("unseen frame", unseen), ("frame", seen)] {
        if let Some(means) = Means::from_cases(&cases) {
            let figure = metric.text(metric.score(&means.over_cells));
            let mut count = counted(means.cases, what);
            if what == "frame" {
                count += " seen in training";
            }
            let text = match metric {
                Metric::Flip => format!("FLIP {figure} on {count} (0 is perfect)"),
                Metric::Psnr => format!("PSNR {figure} on {count}"),
                Metric::Ssim => format!("SSIM {figure} on {count} (1 is perfect)"),
            };
            ui.label(RichText::new(text).color(theme::QUIET));
        }
    }
    if let Some(flicker) = &review.flicker {
        quiet_ui(ui, &flicker.sentence());
    }
}

/// The largest errors, one button each. Returns the clicked cell.
fn worst_ui(ui: &mut Ui, review: &Review, metric: Metric, chosen: Option<(usize, usize)>) -> Option<(usize, usize)> {
    let mut pressed = None;
    ui.label(RichText::new("Largest errors").color(theme::QUIET));
    for cell in review.worst(metric).into_iter().take(WORST) {
        let (case, lamp) = (&review.cases[cell.0], &review.lamps[cell.1]);
        let figure = metric.text(metric.score(&case.cells[cell.1]));
        let text = format!("{}, {}: {figure}", case.name, lamp_title(lamp));
        if ui.selectable_label(chosen == Some(cell), text).clicked() {
            pressed = Some(cell);
        }
    }
    pressed
}
