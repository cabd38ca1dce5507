//! Names of buttons and menus.

use egui::{Response, Role, WidgetInfo};

/// Most letters of a compared picture's name.
const LETTERS: usize = 22;

/// A name, cut short for a button.
pub fn short(name: &str) -> String {
    if name.chars().count() > LETTERS {
        name.chars().take(LETTERS - 1).chain(['…']).collect()
    } else {
        name.to_owned()
    }
}

/// Sets the accessible name of a menu's button.
pub fn called(response: Response, name: String) {
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
}
