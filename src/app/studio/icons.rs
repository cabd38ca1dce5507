//! Icons: a subset of the Phosphor regular font, named here.

use egui::{Button, FontData, FontDefinitions, FontFamily, Response, RichText, Role, Ui, WidgetInfo, vec2};
use std::sync::Arc;

pub const ADD: &str = "\u{E3D4}";
pub const AIM: &str = "\u{E6FC}";
pub const CALIBRATE: &str = "\u{E1D6}";
pub const CHANNELS: &str = "\u{E192}";
pub const COMPARE: &str = "\u{E870}";
pub const COPY: &str = "\u{E1CA}";
pub const DONE: &str = "\u{E182}";
pub const DOWN: &str = "\u{E136}";
pub const ENLARGE: &str = "\u{E0A6}";
pub const EXPORT: &str = "\u{EAF0}";
pub const FIT: &str = "\u{E1D0}";
pub const FOLDER: &str = "\u{E256}";
pub const FRONT: &str = "\u{E1C8}";
pub const FOUR: &str = "\u{E464}";
pub const HIDDEN: &str = "\u{E224}";
pub const LOCK: &str = "\u{E2FA}";
pub const LOOP: &str = "\u{E3F6}";
pub const MORE: &str = "\u{E1FE}";
pub const NEXT: &str = "\u{E13A}";
pub const OVER: &str = "\u{E038}";
pub const PANELS: &str = "\u{E6D6}";
pub const PAUSE: &str = "\u{E39E}";
pub const PLAY: &str = "\u{E3D0}";
pub const PREVIOUS: &str = "\u{E138}";
pub const QUEUE: &str = "\u{E6AC}";
pub const REDUCE: &str = "\u{E09E}";
pub const REDO: &str = "\u{E08C}";
pub const RELIGHT: &str = "\u{E2DC}";
pub const REMOVE: &str = "\u{E4F6}";
pub const REVIEW: &str = "\u{E150}";
pub const SEARCH: &str = "\u{E30C}";
pub const SEEN: &str = "\u{E220}";
pub const SOLO: &str = "\u{E47C}";
pub const STAR: &str = "\u{E46A}";
pub const STOP: &str = "\u{E46C}";
pub const TRAIN: &str = "\u{E62C}";
pub const UNDO: &str = "\u{E08A}";
pub const WARNING: &str = "\u{E4E0}";

/// Size in points of a stand-alone icon.
const SIZE: f32 = 16.0;

/// Adds the icon font after the text font: its small letters are blank.
pub fn add_to(fonts: &mut FontDefinitions) {
    let font = FontData::from_static(include_bytes!("../../../assets/phosphor/Phosphor.ttf"));
    fonts.font_data.insert("icons".to_owned(), Arc::new(font));
    let text = fonts.families.entry(FontFamily::Proportional).or_default();
    text.insert(text.len().min(1), "icons".to_owned());
}

/// A button with an icon only.
pub fn alone(icon: &str) -> Button<'_> {
    Button::new(RichText::new(icon).size(SIZE)).min_size(vec2(28.0, 24.0))
}

/// Adds a button with this accessible name, independent of its contents.
pub fn named_ui(ui: &mut Ui, enabled: bool, button: Button, name: &str) -> Response {
    let response = ui.add_enabled(enabled, button);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, name));
    response
}

/// Adds a button with an icon before its words. The words are its accessible name.
pub fn worded_ui(ui: &mut Ui, icon: &str, words: &str) -> Response {
    named_ui(ui, true, Button::new((icon, words)), words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_has_every_icon_and_leaves_letters_to_the_text() {
        let ctx = egui::Context::default();
        super::super::theme::apply(&ctx);
        let mut ran = false;
        let _ = ctx.run_ui(egui::RawInput::default(), |ui| {
            ui.ctx().fonts_mut(|fonts| {
                let body = egui::FontId::proportional(14.0);
                for icon in [
                    ADD,
                    AIM,
                    CALIBRATE,
                    CHANNELS,
                    COMPARE,
                    COPY,
                    DONE,
                    DOWN,
                    ENLARGE,
                    EXPORT,
                    FIT,
                    FOLDER,
                    FOUR,
                    FRONT,
                    HIDDEN,
                    LOCK,
                    LOOP,
                    MORE,
                    NEXT,
                    OVER,
                    PANELS,
                    PAUSE,
                    PLAY,
                    PREVIOUS,
                    QUEUE,
                    REDO,
                    REDUCE,
                    RELIGHT,
                    REMOVE,
                    REVIEW,
                    SEARCH,
                    SEEN,
                    SOLO,
                    STAR,
                    STOP,
                    TRAIN,
                    UNDO,
                    WARNING,
                    // Used by egui's colour picker for copying; here the same as COPY.
                    "\u{1F4CB}",
                ] {
                    assert!(fonts.has_glyphs(&body, icon), "{icon:?}");
                    assert!(fonts.glyph_width(&body, icon.chars().next().unwrap()) > 8.0);
                }
                // Letters have no width in the icon font.
                assert!(fonts.glyph_width(&body, 'm') > 4.0);
            });
            ran = true;
        });
        assert!(ran);
    }
}
