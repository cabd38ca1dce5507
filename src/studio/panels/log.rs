//! The log: messages of jobs, and errors with what to do about them, to read again and to copy. Beside it the hard
//! cases that are tested.

use crate::command::{Command, WindowCommand};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::hard_cases::hard_cases_ui;
use crate::status::Severity;
use crate::theme;
use egui::{RichText, ScrollArea, Ui};

#[derive(Default)]
pub struct LogPanel {
    /// Hard cases are shown, not messages.
    hard_cases: bool,
}

impl LogPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let lines = &context.status.log;
        ui.horizontal(|ui| {
            for (is_hard_cases, name) in [(false, "Messages"), (true, "Hard cases")] {
                ui.selectable_value(&mut self.hard_cases, is_hard_cases, name);
            }
            if self.hard_cases || lines.is_empty() {
                return;
            }
            ui.separator();
            if icons::worded_ui(ui, icons::COPY, "Copy all").clicked() {
                let text: Vec<String> = lines.iter().map(ToString::to_string).collect();
                ui.ctx().copy_text(text.join("\n"));
            }
            if ui.button("Clear").clicked() {
                out.push(Command::Window(WindowCommand::ClearLog));
            }
        });
        if self.hard_cases {
            return hard_cases_ui(ui);
        }
        if lines.is_empty() {
            ui.label(RichText::new("No messages yet").color(theme::QUIET));
            return;
        }
        ScrollArea::vertical()
            .auto_shrink(false)
            .stick_to_bottom(true)
            .show(ui, |ui| {
                for line in lines {
                    let (color, icon) = match line.severity {
                        Severity::Info => (theme::TEXT, ""),
                        Severity::Error => (theme::ACCENT, icons::WARNING),
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
            });
    }
}
