//! The list of keys, over the picture.

use super::{known, name};
use crate::command::{Command, WindowCommand};
use crate::layout::Pane;
use crate::theme;

/// What the mouse does in the viewport.
const GESTURES: &[(&str, &str)] = &[
    ("Drag, Ctrl+drag", "turn the light"),
    ("Shift+right-drag", "turn the light"),
    ("Wheel", "zoom about the cursor"),
    ("Middle-drag", "move the picture"),
    ("Double-click a number", "reset it"),
    ("Arrows on a light's dot", "move it, with Shift by 10°"),
    ("Delete on a key", "take it away"),
    ("Shift", "finer drags; peek at the other picture"),
];

/// The list of keys, over the picture.
pub fn overlay_ui(ui: &egui::Ui, pane: Pane, out: &mut Vec<Command>) {
    let frame = egui::Frame::window(ui.style()).inner_margin(3.0 * theme::GAP);
    let area = egui::Modal::new(egui::Id::unique("keys"))
        .frame(frame)
        .show(ui.ctx(), |ui| {
            ui.heading("Keys");
            ui.add_space(theme::GAP);
            ui.horizontal_top(|ui| {
                // Rows of text alone need no room for buttons.
                ui.spacing_mut().interact_size.y = 0.0;
                // A key that a pane uses for something of its own means only that there.
                let mut keys: Vec<(String, &str)> = Vec::new();
                for binding in known(pane) {
                    let name = name(ui.ctx(), binding);
                    if keys.iter().all(|(known, _)| *known != name) {
                        keys.push((name, binding.says));
                    }
                }
                for (i, column) in keys.chunks(keys.len().div_ceil(2).max(1)).enumerate() {
                    list_ui(ui, &format!("keyboard {i}"), column);
                    ui.add_space(theme::GAP * 3.0);
                }
                let gestures: Vec<_> = GESTURES
                    .iter()
                    .map(|&(how, says)| (how.to_owned(), says))
                    .collect();
                list_ui(ui, "mouse", &gestures);
            });
            ui.add_space(theme::GAP);
            ui.button("Close").clicked()
        });
    if area.inner || area.should_close() {
        out.push(Command::Window(WindowCommand::ToggleKeys));
    }
}

fn list_ui(ui: &mut egui::Ui, id: &str, rows: &[(String, &str)]) {
    egui::Grid::new(id)
        .num_columns(2)
        .spacing([theme::GAP * 2.0, 4.0])
        .show(ui, |ui| {
            for (how, says) in rows {
                ui.label(how);
                ui.label(egui::RichText::new(*says).color(theme::QUIET));
                ui.end_row();
            }
        });
}
