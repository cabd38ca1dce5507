//! List of checkpoints to go back to.

use super::figures::clock;
use crate::command::{Command, TrainingCommand};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{Align, Button, Layout, RichText, Ui, WidgetInfo, vec2};
use training::checkpoints::SavedCheckpoint;

/// The list, newest first.
pub fn checkpoints_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    ui.label(RichText::new("Checkpoints").color(theme::QUIET));
    let kept = context.readers.training.records.as_ref().map_or(&[][..], |r| &r.kept);
    if kept.is_empty() {
        let text = "Training saves checkpoints as it goes, and one before you start over.";
        ui.label(RichText::new(text).size(12.0).color(theme::QUIET));
    }
    let idle = context.status.job.is_none();
    for one in kept {
        row_ui(ui, one, idle, out);
    }
}

/// A checkpoint's name: its step, its training time, and its PSNR on the held-out pose.
pub fn title(kept: &SavedCheckpoint) -> String {
    let info = &kept.info;
    let mut text = short(kept);
    if info.step > 0 {
        text += &format!(", {}", clock(info.seconds));
    }
    if let Some(judged) = info.held_out {
        text += &format!(", {:.2} dB", judged.decibels);
    }
    text
}

/// A short name: the step alone.
pub fn short(kept: &SavedCheckpoint) -> String {
    match kept.info.step {
        0 => "Start".to_owned(),
        step => format!("step {step}"),
    }
}

/// Reason for keeping a checkpoint, its folder and its size.
pub fn details(kept: &SavedCheckpoint) -> String {
    let why = if kept.aside { "Set aside" } else { "Saved by training" };
    format!("{why}: {}, {:.1} MB", kept.name, kept.bytes as f64 / 1e6)
}

fn row_ui(ui: &mut Ui, kept: &SavedCheckpoint, idle: bool, out: &mut Vec<Command>) {
    let info = &kept.info;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = GAP;
        let color = if kept.present { theme::ACCENT } else { theme::TEXT };
        ui.label(RichText::new(title(kept)).size(12.5).color(color)).on_hover_text(details(kept));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if kept.present {
                ui.label(RichText::new("Current").size(12.0).color(theme::QUIET));
                return;
            }
            let back = Button::new(RichText::new("Go back").size(12.5)).min_size(vec2(64.0, 20.0));
            let response = ui
                .add_enabled(idle, back)
                .on_hover_text("Training resumes from here. The current one moves to the list.");
            response.widget_info(|| {
                let name = format!("Go back to step {}", info.step);
                WidgetInfo::labeled(egui::Role::Button, idle, name)
            });
            if response.clicked() {
                out.push(Command::Training(TrainingCommand::GoBack(kept.name.clone())));
            }
        });
    });
}
