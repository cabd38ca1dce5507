//! A row of a number.

use crate::panels::widgets::numbers::is_reset;
use egui::{DragValue, Ui, vec2};

/// A number's row; returns whether a double-click resets the number.
pub fn field_ui(ui: &mut Ui, name: &str, field: DragValue) -> bool {
    let label = ui.label(name);
    let field = ui.add_sized(vec2(84.0, 24.0), field).labelled_by(label.id);
    ui.end_row();
    is_reset(ui, &field)
}
