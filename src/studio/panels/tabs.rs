//! The line of workspaces at the top of the window.

use crate::studio::command::Command;
use crate::studio::panel::Sight;
use crate::studio::state::Workspace;
use egui::{Button, Ui, vec2};

/// The panel keeps nothing.
#[derive(Default)]
pub struct TabsPanel;

impl TabsPanel {
    pub fn ui(&mut self, ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
        ui.horizontal_centered(|ui| {
            for (workspace, name, hint) in [
                (
                    Workspace::Probe,
                    "Probe",
                    "The mirror ball and the lamps that it shows. Key: Ctrl+1",
                ),
                (
                    Workspace::Gamma,
                    "Gamma",
                    "The camera's response. Key: Ctrl+2",
                ),
                (
                    Workspace::Relight,
                    "Relight",
                    "The relit picture and its light. Key: Ctrl+3",
                ),
            ] {
                let tab = Button::selectable(sight.state.workspace == workspace, name);
                if ui
                    .add(tab.min_size(vec2(84.0, 24.0)))
                    .on_hover_text(hint)
                    .clicked()
                {
                    out.push(Command::Workspace(workspace));
                }
            }
        });
    }
}
