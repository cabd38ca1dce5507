//! The status line: the running job, or where the network runs and how long the picture took; checks and effects.

use super::checks::{color, dot_ui};
use super::job::{JobPanel, job_ui};
use crate::command::{Command, WindowCommand};
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::status::Phase;
use crate::theme::GAP;
use egui::{Align, CursorIcon, Label, Layout, RichText, Sense, Ui};

/// Width of "predicted in 99999 ms", in points.
const FIGURE_WIDTH: f32 = 134.0;

/// The status line has no state of its own.
#[derive(Default)]
pub struct StatusPanel;

impl StatusPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let job = JobPanel::in_line(context);
        ui.horizontal_centered(|ui| {
            ui.spacing_mut().interact_size.y = 20.0;
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.spacing_mut().item_spacing.x = 2.0 * GAP;
                if ui.button(small("Keys ?")).clicked() {
                    out.push(Command::Window(WindowCommand::ToggleKeys));
                }
                if let (Some(relit), None) = (context.relit, job) {
                    let ran = relit.passes.iter().filter(|p| p.ran).count();
                    let text = format!("{ran} of {} effects", relit.passes.len());
                    let hint =
                        "Shows which effects ran, which did not, why, and how long each took";
                    if ui.button(small(&text)).on_hover_text(hint).clicked() {
                        out.push(Command::Window(WindowCommand::ShowPane(Pane::Effects)));
                    }
                }
                check_ui(ui, context, out);
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| match job {
                    Some(job) => {
                        ui.spacing_mut().item_spacing.x = GAP;
                        job_ui(ui, job, context.status.message.as_deref(), out);
                    }
                    None => figures_ui(ui, context, out),
                });
            });
        });
    }
}

/// Where the network runs, and what the picture took.
fn figures_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let device = small(match &context.status.phase {
        _ if context.status.job.is_some() && !context.is_live() => "Working",
        Phase::NoProject => "No project",
        Phase::Opening => "Opening",
        Phase::Blocked(_) => "Action needed",
        Phase::Ready { device } => device,
    });
    // As a sentence, not as a button: it is read far more often than it is clicked.
    let device = ui.add(Label::new(device).sense(Sense::click()));
    let device = device.on_hover_cursor(CursorIcon::PointingHand);
    if device.on_hover_text("What can this machine do?").clicked() {
        out.push(Command::Window(WindowCommand::ToggleMachine));
    }
    if let Some(relit) = context.relit {
        figure_ui(ui, &format!("predicted in {:.0} ms", relit.predict_ms));
        figure_ui(ui, &format!("relit in {:.1} ms", relit.relight_ms));
        let share = relit.uncovered * 100.0;
        if ui.available_width() < FIGURE_WIDTH {
            return;
        }
        let text = if share < 0.1 {
            "all light covered".to_owned()
        } else {
            format!("{share:.1} % of the light not covered")
        };
        ui.label(small(&text)).on_hover_text(
            "Share of the environment's light from directions without a lamp; the nearest lamps take it over.",
        );
    }
}

/// How far the project can be trusted, once something was measured.
fn check_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let Some(level) = context.check.level() else {
        return;
    };
    let text = small(&format!("Checks: {}", level.word())).color(color(level));
    let hint = "Shows what was found of lamps, camera, frames and light, and what to do about it";
    if ui.button(text).on_hover_text(hint).clicked() {
        out.push(Command::Window(WindowCommand::ShowPane(Pane::Checks)));
    }
    dot_ui(ui, level);
}

/// A figure in a space of fixed width, so that the line does not move as it changes; nothing where there is no room.
fn figure_ui(ui: &mut Ui, text: &str) {
    if ui.available_width() < FIGURE_WIDTH {
        return;
    }
    let left = egui::Layout::left_to_right(egui::Align::Center);
    ui.allocate_ui_with_layout(egui::vec2(FIGURE_WIDTH, 20.0), left, |ui| {
        ui.set_min_width(FIGURE_WIDTH);
        ui.label(small(text));
    });
}

fn small(text: &str) -> RichText {
    RichText::new(text).size(13.0)
}
