//! The list of shortcuts, over the picture.

use super::listed;
use crate::command::{Command, WindowCommand};
use crate::layout::Pane;
use crate::theme;

/// Mouse actions in the viewport.
const GESTURES: &[(&str, &str)] = &[
    ("Drag, Ctrl+drag", "Turn the light"),
    ("Shift+right-drag", "Turn the light"),
    ("Wheel", "Zoom about the cursor"),
    ("Middle-drag", "Move the picture"),
    ("Ctrl+Shift+drag", "Average a region; a click ends it"),
    ("Double-click a number", "Reset it"),
    ("Arrows on a light's dot", "Move it; Shift: by 10°"),
    ("Delete on a key or light", "Remove it"),
    ("Double-click a lane", "Set a key there"),
    ("Ctrl+wheel on the timeline", "Zoom; wheel, middle-drag: move"),
    ("F over the timeline", "Show all frames"),
    ("Shift", "Finer drags; peek at the other picture"),
];

/// The list of shortcuts, over the picture.
pub fn overlay_ui(ui: &egui::Ui, pane: Pane, out: &mut Vec<Command>) {
    let frame = egui::Frame::window(ui.style()).inner_margin(3.0 * theme::GAP);
    let area = egui::Modal::new(egui::Id::unique("keys")).frame(frame).show(ui.ctx(), |ui| {
        ui.heading("Keys");
        ui.add_space(theme::GAP);
        ui.horizontal_top(|ui| {
            // Rows without buttons may be lower.
            ui.spacing_mut().interact_size.y = 0.0;
            let listed = listed(ui.ctx(), pane).into_iter();
            let keys: Vec<(String, &str)> = listed
                .filter(|listed| !listed.key.is_empty())
                .map(|listed| (listed.key, listed.label))
                .collect();
            for (i, column) in keys.chunks(keys.len().div_ceil(2).max(1)).enumerate() {
                list_ui(ui, &format!("keyboard {i}"), column);
                ui.add_space(theme::GAP * 3.0);
            }
            let gestures: Vec<_> =
                GESTURES.iter().map(|&(how, label)| (how.to_owned(), label)).collect();
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
    egui::Grid::new(id).num_columns(2).spacing([theme::GAP * 2.0, 4.0]).show(ui, |ui| {
        for (how, label) in rows {
            ui.label(how);
            ui.label(egui::RichText::new(*label).color(theme::QUIET));
            ui.end_row();
        }
    });
}
