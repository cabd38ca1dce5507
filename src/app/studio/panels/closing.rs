//! Confirmation dialogs: before the window closes, or another project opens, and running work would be lost.

use crate::command::{Command, ProjectCommand, WindowCommand};
use crate::state::Leaving;
use crate::theme::{self, GAP};
use egui::{Frame, Id, Modal, Ui};

/// Asks whether to close the window. `ends` lists the work that this would end.
pub fn closing_ui(ui: &Ui, ends: &[String], out: &mut Vec<Command>) {
    let close = ("Close anyway", Command::Window(WindowCommand::Close));
    question_ui(ui, "Close while work is running?", ends, close, out);
}

/// Asks whether to stop running work and open a project.
pub fn leaving_ui(ui: &Ui, leaving: &Leaving, out: &mut Vec<Command>) {
    let open = ("Stop and open", Command::Project(ProjectCommand::Leave));
    let heading = if leaving.again {
        "Open the project again while work is running?"
    } else {
        "Open another project while work is running?"
    };
    question_ui(ui, heading, &leaving.ends, open, out);
}

fn question_ui(ui: &Ui, heading: &str, ends: &[String], (words, goes_on): (&str, Command), out: &mut Vec<Command>) {
    let frame = Frame::window(ui.style()).inner_margin(2.0 * GAP);
    let asked = Modal::new(Id::unique("closing")).frame(frame);
    let shown = asked.show(ui.ctx(), |ui| {
        ui.set_width(420.0);
        ui.heading(heading);
        ui.add_space(GAP);
        for sentence in ends {
            ui.label(sentence);
        }
        ui.add_space(2.0 * GAP);
        ui.horizontal(|ui| {
            let keep = theme::main_button(true, "Keep working");
            let keep = ui.add(keep).clicked();
            if ui.button(words).clicked() {
                out.push(goes_on);
            }
            keep
        })
        .inner
    });
    if shown.inner || shown.should_close() {
        out.push(Command::Window(WindowCommand::KeepOpen));
    }
}
