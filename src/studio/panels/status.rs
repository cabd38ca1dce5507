//! The status line: where the network runs and why, how long the picture took, which passes ran.

use super::checks::{color, dot_ui};
use crate::command::{Command, WindowCommand};
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::status::Phase;
use crate::theme::GAP;
use egui::{RichText, Ui};

/// Width of "predicted in 99999 ms", in points.
const FIGURE_WIDTH: f32 = 134.0;

/// The status line has no state of its own.
#[derive(Default)]
pub struct StatusPanel;

impl StatusPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        ui.horizontal_centered(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0 * GAP;
            ui.spacing_mut().interact_size.y = 20.0;
            ui.label(small(match &context.status.phase {
                _ if context.status.job.is_some() && !context.is_live() => "Working",
                Phase::NoProject => "No project",
                Phase::Opening => "Opening",
                Phase::Blocked(_) => "Action needed",
                Phase::Ready { device } => device,
            }));
            if let Some(relit) = context.relit {
                figure_ui(ui, &format!("predicted in {:.0} ms", relit.predict_ms));
                figure_ui(ui, &format!("relit in {:.1} ms", relit.relight_ms));
                let share = relit.uncovered * 100.0;
                let text = if share < 0.1 {
                    "all light covered".to_owned()
                } else {
                    format!("{share:.1} % of the light not covered")
                };
                ui.label(small(&text)).on_hover_text(
                    "Share of the environment's light from directions without a lamp; the nearest lamps \
                     take it over.",
                );
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.button(small("Keys ?")).clicked() {
                    out.push(Command::Window(WindowCommand::ToggleKeys));
                }
                if let Some(relit) = context.relit {
                    let ran = relit.passes.iter().filter(|p| p.ran).count();
                    let text = format!("{ran} of {} passes ran", relit.passes.len());
                    let hint = "Shows which passes ran, which did not, and why";
                    if ui.button(small(&text)).on_hover_text(hint).clicked() {
                        out.push(Command::Window(WindowCommand::ShowPane(Pane::Effects)));
                    }
                }
                check_ui(ui, context, out);
            });
        });
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

/// A figure in a space of fixed width, so that the line does not move as it changes.
fn figure_ui(ui: &mut Ui, text: &str) {
    let left = egui::Layout::left_to_right(egui::Align::Center);
    ui.allocate_ui_with_layout(egui::vec2(FIGURE_WIDTH, 20.0), left, |ui| {
        ui.set_min_width(FIGURE_WIDTH);
        ui.label(small(text));
    });
}

fn small(text: &str) -> RichText {
    RichText::new(text).size(13.0)
}
