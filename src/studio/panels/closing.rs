//! The question before a window closes on work that would be lost.

use crate::command::{Command, WindowCommand};
use crate::theme::{self, GAP};
use egui::{Button, Frame, Id, Modal, Ui};

/// Asks; `ends` says what a close would end.
pub fn closing_ui(ui: &Ui, ends: &[String], out: &mut Vec<Command>) {
    let frame = Frame::window(ui.style()).inner_margin(2.0 * GAP);
    let asked = Modal::new(Id::unique("closing")).frame(frame);
    let shown = asked.show(ui.ctx(), |ui| {
        ui.set_width(420.0);
        ui.heading("Close while work is running?");
        ui.add_space(GAP);
        for sentence in ends {
            ui.label(sentence);
        }
        ui.add_space(2.0 * GAP);
        ui.horizontal(|ui| {
            let keep = Button::new("Keep working").fill(theme::PRIMARY);
            let keep = ui.add(keep).clicked();
            if ui.button("Close anyway").clicked() {
                out.push(Command::Window(WindowCommand::Close));
            }
            keep
        })
        .inner
    });
    if shown.inner || shown.should_close() {
        out.push(Command::Window(WindowCommand::KeepOpen));
    }
}
