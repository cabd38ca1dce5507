//! The menu of the keys: interpolation, tangents and clipboard.

use super::TimelinePanel;
use super::drag::push_changed;
use super::key_selection::Onto;
use crate::command::Command;
use crate::panel_context::PanelContext;
use egui::{Button, Ui, ViewportCommand};
use light::keyframes::Interpolation;

impl TimelinePanel {
    pub(super) fn menu_ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        if !self.selection.is_empty() {
            self.selected_ui(ui, context, out);
        }
        let paste = ui.add(Button::new("Paste").shortcut_text("Ctrl+V"));
        if paste.clicked() {
            self.ask_to_paste(ui, Onto::Lane(self.chosen));
        }
        let lights = &context.state.look.lighting.placed;
        if !lights.is_empty() {
            ui.menu_button("Paste onto", |ui| {
                for (i, light) in lights.iter().enumerate() {
                    if ui.button(light.title(i)).clicked() {
                        self.ask_to_paste(ui, Onto::Light(light.id));
                    }
                }
            });
        }
        let all = Button::new("Select all keys").shortcut_text("Ctrl+A");
        if ui.add(all).clicked() {
            self.select_all(&context.state.look.animation);
            ui.close();
        }
    }

    /// Requests the clipboard's contents from the system.
    fn ask_to_paste(&mut self, ui: &Ui, onto: Onto) {
        self.awaited = Some(onto);
        ui.ctx().send_viewport_cmd(ViewportCommand::RequestPaste);
        ui.close();
    }

    fn selected_ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
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
        let keys = match self.selection.len() {
            1 => "key".to_owned(),
            keys => format!("{keys} keys"),
        };
        let [cut, copy, remove] = ["Cut", "Copy", "Remove"].map(|act| format!("{act} {keys}"));
        if ui.add(Button::new(cut).shortcut_text("Ctrl+X")).clicked() {
            ui.copy_text(self.selection.copied(animation));
            push_changed(self.selection.removed(animation), animation, out);
            ui.close();
        }
        if ui.add(Button::new(copy).shortcut_text("Ctrl+C")).clicked() {
            ui.copy_text(self.selection.copied(animation));
            ui.close();
        }
        if ui.add(Button::new(remove).shortcut_text("Delete")).clicked() {
            push_changed(self.selection.removed(animation), animation, out);
            ui.close();
        }
    }
}
