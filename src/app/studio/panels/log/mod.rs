//! The log: messages of jobs, and errors with their remedies, to read again and to copy.

use crate::command::{Command, WindowCommand};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::status::{LogLine, Severity};
use crate::theme::{self, GAP};
use egui::{Rect, RichText, ScrollArea, Ui, UiBuilder};
use std::collections::VecDeque;

/// Width in points of the buttons.
const BUTTONS: f32 = 104.0;
/// Width of the pane in points below which the buttons are above the lines.
const NARROW: f32 = 420.0;

/// The log; it keeps no state.
#[derive(Default)]
pub struct LogPanel;

impl LogPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let lines = &context.status.log;
        let rect = ui.available_rect_before_wrap();
        if rect.width() < NARROW {
            ui.horizontal(|ui| buttons_ui(ui, lines, out));
            lines_ui(ui, lines);
        } else {
            // Beside the lines, which leaves more lines visible.
            let middle = rect.right() - BUTTONS;
            let part = |rect: Rect| UiBuilder::new().max_rect(rect);
            ui.scope_builder(part(rect.with_max_x(middle - GAP)), |ui| {
                lines_ui(ui, lines);
            });
            ui.scope_builder(part(rect.with_min_x(middle)), |ui| {
                buttons_ui(ui, lines, out);
            });
            ui.advance_cursor_after_rect(rect);
        }
    }
}

fn buttons_ui(ui: &mut Ui, lines: &VecDeque<LogLine>, out: &mut Vec<Command>) {
    if lines.is_empty() {
        return;
    }
    ui.spacing_mut().item_spacing.y = 2.0;
    if icons::worded_ui(ui, icons::COPY, "Copy all").clicked() {
        let text: Vec<String> = lines.iter().map(ToString::to_string).collect();
        ui.ctx().copy_text(text.join("\n"));
    }
    if ui.button("Clear").clicked() {
        out.push(Command::Window(WindowCommand::ClearLog));
    }
}

fn lines_ui(ui: &mut Ui, lines: &VecDeque<LogLine>) {
    if lines.is_empty() {
        ui.label(RichText::new("No messages yet").color(theme::QUIET));
        return;
    }
    ScrollArea::vertical().auto_shrink(false).stick_to_bottom(true).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        // A line is as high as its text.
        ui.spacing_mut().interact_size.y = 0.0;
        lines.iter().for_each(|line| line_ui(ui, line));
    });
}

fn line_ui(ui: &mut Ui, line: &LogLine) {
    let (color, icon) = match line.severity {
        Severity::Info => (theme::TEXT, ""),
        Severity::Error => (theme::WARNING, icons::WARNING),
    };
    ui.horizontal_top(|ui| {
        let quiet = RichText::new(&line.time).monospace().size(12.0);
        ui.label(quiet.color(theme::QUIET));
        let place = egui::vec2(14.0, 16.0);
        let icon = RichText::new(icon).size(14.0).color(color);
        ui.add_sized(place, egui::Label::new(icon));
        let sentence = RichText::new(&line.sentence).size(13.0).color(color);
        // Part of a sentence can be copied too.
        ui.add(egui::Label::new(sentence).wrap().selectable(true));
    });
}
