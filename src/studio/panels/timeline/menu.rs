//! The menu of the selected keys: how they go on, and what is done with them.

use super::TimelinePanel;
use super::lanes::push_changed;
use crate::command::Command;
use crate::panel_context::PanelContext;
use egui::{Button, Ui};
use light::keyframes::Interpolation;

impl TimelinePanel {
    pub(super) fn menu_ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let animation = &context.state.look.animation;
        let now = self.selection.kind(animation);
        for (kind, name) in Interpolation::ALL {
            if ui.radio(now == Some(kind), name).clicked() {
                let lanes = self.selection.interpolated(animation, kind);
                push_changed(lanes, animation, out);
                ui.close();
            }
        }
        if self.selection.has_own_tangents(animation) && ui.button("Automatic tangents").clicked() {
            let lanes = self.selection.with_automatic_tangents(animation);
            push_changed(lanes, animation, out);
            ui.close();
        }
        ui.separator();
        let (copy, remove) = match self.selection.len() {
            1 => ("Copy key".to_owned(), "Remove key".to_owned()),
            keys => (format!("Copy {keys} keys"), format!("Remove {keys} keys")),
        };
        if ui.add(Button::new(copy).shortcut_text("Ctrl+C")).clicked() {
            ui.copy_text(self.selection.copied(animation));
            ui.close();
        }
        if ui
            .add(Button::new(remove).shortcut_text("Delete"))
            .clicked()
        {
            push_changed(self.selection.removed(animation), animation, out);
            ui.close();
        }
    }
}
