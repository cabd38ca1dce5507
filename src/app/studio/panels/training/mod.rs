//! Training: curves and pictures, presets and their cost, and the checkpoints to go back to.

pub mod checkpoints;
pub mod command;
pub mod controls;
mod curves;
mod figures;
mod handler;
mod pictures;
mod preview;
pub mod query;

use crate::command::{Command, Dialog, JobCommand};
use crate::icons;
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::panels::widgets::notice::{backdrop_ui, notice_ui};
use crate::theme::{self, GAP};
use egui::{Frame, Margin, Panel, RichText, ScrollArea, Ui};
use project::Project;
use training::Records;
use worker::Need;

/// Width of the column to the right of the curves, in points.
const SIDE: f32 = 292.0;
/// Height of a line of small text in points.
const LINE: f32 = 20.0;

/// Holds textures, and whether a confirmation is open.
#[derive(Default)]
pub struct TrainingPanel {
    pictures: pictures::Pictures,
    buttons: controls::Buttons,
}

impl TrainingPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let Some(project) = context.session.project else {
            return notice_ui(ui, |ui| {
                ui.heading("No project is open");
                ui.add_space(GAP);
                if icons::worded_ui(ui, icons::FOLDER, "Open project…").clicked() {
                    out.push(Command::Dialog(Dialog::Project));
                }
            });
        };
        let Some(records) = context.readers.training.records.as_deref() else {
            return notice_ui(ui, |ui| {
                ui.heading("Reading the training log");
            });
        };
        let frame = Frame::new().fill(theme::PANEL).inner_margin(Margin::symmetric(12, 0));
        Panel::right("training's side").exact_size(SIDE).frame(frame).show(ui, |ui| {
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                self.side_ui(ui, context, project, records, out);
            });
        });
        if context.readers.training.is_empty() && !context.shows(Pane::Picture) {
            backdrop_ui(ui, context);
        }
        Frame::new()
            .inner_margin(Margin::symmetric(12, 4))
            .show(ui, |ui| self.main_ui(ui, context, project, records, out));
    }

    fn main_ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        project: &Project,
        records: &Records,
        out: &mut Vec<Command>,
    ) {
        let points = context.readers.training.history.points();
        if points.is_empty() && !context.readers.training.running {
            return notice_ui(ui, |ui| instead_ui(ui, context, project, records, out));
        }
        let judged = points.iter().any(|point| point.held_out_db.is_some());
        // Three squares side by side, but not much higher than a third of the room.
        let room = ui.available_height();
        let thirds = (ui.available_width() - 2.0 * GAP) / 3.0 + LINE;
        let pictures = thirds.min(0.38 * room);
        let rest = (room - pictures - 3.0 * LINE - 2.0 * GAP).max(160.0);
        let below = if judged { 0.34 * rest } else { 0.0 };
        ui.horizontal(|ui| {
            ui.label(RichText::new("Losses").size(13.0));
            curves::legend_ui(ui);
        });
        curves::losses_ui(ui, rest - below, points);
        if judged {
            ui.label(RichText::new("PSNR on the held-out pose").size(13.0));
            curves::held_out_ui(ui, below - LINE, points);
        }
        ui.horizontal(|ui| pictures::lamp_ui(ui, context, out));
        self.pictures.ui(ui, pictures, context);
    }

    fn side_ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        project: &Project,
        records: &Records,
        out: &mut Vec<Command>,
    ) {
        ui.add_space(GAP);
        // Leaves room for the scroll bar.
        ui.set_max_width(ui.available_width() - GAP);
        let known = !context.readers.training.history.points().is_empty() || context.readers.training.running;
        let job = context.status.job.as_ref().filter(|_| context.readers.training.running);
        let held = job.and_then(|job| job.held.as_ref());
        for sentence in records.failure.iter().filter(|_| known).chain(held) {
            ui.label(RichText::new(sentence).size(12.5).color(theme::WARNING));
            ui.add_space(GAP);
        }
        controls::presets_ui(ui, context, project, out);
        controls::settings_ui(ui, context, project, out);
        if !is_empty(context) {
            self.buttons.ui(ui, context, project, out);
        }
        if known {
            ui.separator();
            ui.scope(|ui| figures::figures_ui(ui, context, project));
        }
        ui.separator();
        checkpoints::checkpoints_ui(ui, context, out);
        ui.add_space(GAP);
    }
}

/// True if nothing was trained yet: then the notice has the start button.
fn is_empty(context: &PanelContext) -> bool {
    context.readers.training.is_empty() && context.status.job.is_none()
}

/// Content shown in place of the curves.
fn instead_ui(ui: &mut Ui, context: &PanelContext, project: &Project, records: &Records, out: &mut Vec<Command>) {
    let heading = |ui: &mut Ui, text: &str| {
        ui.heading(text);
        ui.add_space(GAP);
    };
    if let Some(sentence) = &records.failure {
        heading(ui, "The training cannot be read");
        ui.label(sentence);
    } else if !records.calibrated {
        heading(ui, "Not calibrated yet");
        ui.label("Training needs the lamps and the camera's response.");
        ui.add_space(GAP);
        if context.status.job.is_none() && ui.add(theme::main_button(true, "Calibrate")).clicked() {
            out.push(Command::Job(JobCommand::Provide(Need::Calibration)));
        }
    } else if let Some(present) = &records.present
        && present.step == 0
    {
        heading(ui, "Not trained on this person yet");
        ui.label("Pictures come from the poses and a network that was trained on others.");
        ui.add_space(GAP);
        preview::preview_ui(ui, context, project);
    } else if let Some(present) = &records.present {
        heading(ui, "A trained network, but no training log");
        ui.label(format!("The network is at step {}. Resume continues from it.", present.step));
    } else {
        heading(ui, "Not trained yet");
        ui.label("Pictures come from the poses, carried over to each frame. Training corrects them.");
        ui.add_space(GAP);
        preview::preview_ui(ui, context, project);
        ui.add_space(GAP);
        if is_empty(context) {
            controls::start_ui(ui, false, out);
        }
    }
}
