//! Frames around the contents of a pane.

use crate::layout::MARGIN;
use crate::theme::{self, GAP};
use egui::{Frame, Margin, Panel, ScrollArea, Ui};

/// No frame: the contents fill the pane.
pub fn bare(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    contents(ui);
}

/// A margin.
pub fn padded(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    Frame::new().inner_margin(Margin::symmetric(MARGIN as i8, 4)).show(ui, contents);
}

/// A margin, and a scroll bar where the contents do not fit.
pub fn scrolled(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    padded(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.add_space(GAP);
            contents(ui);
            ui.add_space(GAP);
        });
    });
}

/// A column of this width in points at the right of the pane.
pub fn column(ui: &mut Ui, name: &'static str, width: f32, contents: impl FnOnce(&mut Ui)) {
    let frame = Frame::new().fill(theme::PANEL).inner_margin(Margin::symmetric(12, 0));
    Panel::right(name).exact_size(width).frame(frame).show(ui, contents);
}
