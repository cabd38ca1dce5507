//! Sentences: in place of a picture, over the picture, and between controls.

use super::fit::covering;
use crate::command::{Command, WindowCommand};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{Align, Color32, Layout, Rect, RichText, ScrollArea, Ui, vec2};

/// Maximum width in points of text over the picture.
pub const TEXT_WIDTH: f32 = 520.0;

/// A notice in place of a picture. It scrolls where it does not fit.
pub fn notice_ui(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    let rect = ui.available_rect_before_wrap();
    let width = (TEXT_WIDTH + 6.0 * GAP).min(rect.width() - 4.0 * GAP);
    // The box starts above the centre, where people look first.
    let size = vec2(width, rect.height() * 0.75);
    let area = Rect::from_center_size(rect.center() + vec2(0.0, rect.height() * 0.1), size);
    ui.scope_builder(egui::UiBuilder::new().max_rect(area), |ui| {
        egui::Frame::new().fill(theme::PANEL).corner_radius(6).inner_margin(3.0 * GAP).show(ui, |ui| {
            ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| {
                ui.vertical_centered(contents);
            });
        });
    });
}

/// The interview frame, dimmed, behind a pane without content. Draws nothing until the frame is read.
pub fn backdrop_ui(ui: &Ui, context: &PanelContext) {
    let Some(Ok(frame)) = context.readers.footage.picture() else { return };
    let rect = ui.available_rect_before_wrap();
    let uv = covering(frame.texture.size_vec2(), rect.size());
    let painter = ui.painter().with_clip_rect(rect);
    painter.image(frame.texture.id(), rect, uv, Color32::from_gray(120));
}

/// Reason for a refusal, and the button that dismisses the message.
pub fn refusal_ui(ui: &mut Ui, sentence: &str, out: &mut Vec<Command>) {
    ui.horizontal_top(|ui| {
        ui.label(RichText::new(icons::WARNING).size(16.0).color(theme::WARNING));
        let button = 28.0 + GAP;
        let down = Layout::top_down(Align::Min);
        let room = vec2(ui.available_width() - button, 0.0);
        ui.allocate_ui_with_layout(room, down, |ui| {
            ui.set_width(room.x);
            ui.colored_label(theme::WARNING, sentence);
        });
        dismiss_ui(ui, out);
    });
}

/// The button that dismisses a refusal.
pub fn dismiss_ui(ui: &mut Ui, out: &mut Vec<Command>) {
    let name = "Dismiss message";
    if icons::named_ui(ui, true, icons::alone(icons::REMOVE).frame(false), name)
        .on_hover_text("Hides the message; the log keeps it. Key: Esc")
        .clicked()
    {
        out.push(Command::Window(WindowCommand::DismissRefusal));
    }
}

/// A quiet sentence.
pub fn quiet_ui(ui: &mut Ui, sentence: &str) {
    ui.label(RichText::new(sentence).color(theme::QUIET));
}
