//! The status line: the running job, or the network's device and the picture's size and rate; save state and
//! checks.

use super::checks::{color, dot_ui, verdict};
use super::job::{JobPanel, job_ui};
use super::widgets::missing;
use crate::command::{Command, WindowCommand};
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::status::Phase;
use crate::theme::{self, GAP};
use egui::{Align, Layout, Response, RichText, Ui};

/// Width in points that a figure needs.
const FIGURE_WIDTH: f32 = 180.0;

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
                check_ui(ui, context, out);
                saved_ui(ui, context);
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| match job {
                    Some(job) => {
                        ui.spacing_mut().item_spacing.x = GAP;
                        job_ui(ui, job, out);
                    }
                    None => figures_ui(ui, context, out),
                });
            });
        });
    }
}

/// Device of the network, size and rate of the picture, and share of the light not covered by lamps.
fn figures_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let device = small(match &context.status.phase {
        _ if context.status.job.is_some() && !context.is_live() => "Working",
        Phase::NoProject => "No project",
        Phase::Opening => "Opening",
        Phase::Blocked(_) => "Action needed",
        Phase::Ready { device } => device,
    });
    let (hint, command) = match &context.status.phase {
        Phase::Blocked(blocked) if context.status.job.is_none() => {
            (missing::hint(blocked.need), missing::place(blocked.need))
        }
        _ => ("Performance of this machine", Command::Window(WindowCommand::ToggleMachine)),
    };
    if ui.button(device).on_hover_text(hint).clicked() {
        out.push(command);
    }
    let Some(project) = context.session.project else { return };
    // 24000 / 1001 has endless decimals.
    let rate = (1e3 * project.settings.shoot.frame_rate).round() / 1e3;
    let rate = match context.preview.played(ui.input(|input| input.time)) {
        // Steps of a tenth, and no more frames than there are.
        Some(played) => {
            let played = (10.0 * played.min(rate)).round() / 10.0;
            format!("{played} of {rate}")
        }
        None => rate.to_string(),
    };
    match context.relit() {
        Some(relit) => figure_ui(ui, &format!("{} × {}, {rate} fps", relit.width, relit.height)),
        None => figure_ui(ui, &format!("{rate} fps")),
    };
    let share = context.relit().map_or(0.0, |relit| relit.uncovered * 100.0);
    if share >= 0.1
        && let Some(figure) = figure_ui(ui, &format!("{share:.1} % of the light not covered"))
    {
        figure.on_hover_text("Light from directions without a lamp; added to the nearest lamps.");
    }
}

/// Save state of the settings on the disk.
fn saved_ui(ui: &mut Ui, context: &PanelContext) {
    if context.session.project.is_none() || context.session.read_only.is_some() {
        return;
    }
    match context.unsaved() {
        Some(why) => ui.label(small("Not saved").color(theme::WARNING)).on_hover_text(why),
        None if context.autosave.saving() == Some(true) => {
            ui.label(small("Saving…").color(theme::QUIET)).on_hover_text("The disk is slow")
        }
        None => ui.label(small("Saved").color(theme::QUIET)).on_hover_text("Saved as you work, with undo"),
    };
}

/// Summary of the checks, once there are results.
fn check_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let Some(level) = context.readers.check.level() else { return };
    let text = small(&format!("Checks: {}", verdict(level).to_lowercase())).color(color(level));
    let hint = "Findings, and what to do about them";
    if ui.button(text).on_hover_text(hint).clicked() {
        out.push(Command::Window(WindowCommand::ShowPane(Pane::Checks)));
    }
    dot_ui(ui, level);
}

/// A figure; skipped without enough room.
fn figure_ui(ui: &mut Ui, text: &str) -> Option<Response> {
    let room = ui.available_width() >= FIGURE_WIDTH;
    room.then(|| ui.label(small(text).color(theme::QUIET)))
}

fn small(text: &str) -> RichText {
    RichText::new(text).size(13.0)
}
