//! A choice among a few options.

use egui::{Button, Role, Ui, WidgetInfo};

/// Width of a list in points.
pub const LIST: f32 = 128.0;

/// One option of `group`, a name for screen readers. Returns true if it was clicked.
pub fn option_ui(ui: &mut Ui, group: &str, name: &str, hint: &str, chosen: bool) -> bool {
    let response = ui.add(Button::selectable(chosen, name));
    response.widget_info(|| WidgetInfo::selected(Role::RadioButton, true, chosen, format!("{group} {name}")));
    response.on_hover_text(hint).on_disabled_hover_text(hint).clicked()
}
