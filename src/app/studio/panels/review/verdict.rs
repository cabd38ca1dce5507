//! Appearance of verdicts: a colour, a word and the key beside it.

use crate::panels::job::capitalized;
use crate::theme;
use egui::{Button, Color32, Response, RichText, Role, Stroke, Ui, WidgetInfo};
use evaluation::review::Mark;

/// The colour of a verdict.
pub fn color(mark: Mark) -> Color32 {
    match mark {
        Mark::Good => theme::GOOD,
        Mark::Doubtful => theme::DOUBTFUL,
        Mark::Bad => theme::WARNING,
    }
}

/// The verdict buttons; each key is the button's position. Returns the clicked verdict.
pub fn verdicts_ui(ui: &mut Ui, given: Option<Mark>) -> Option<Mark> {
    let mut clicked = None;
    for (place, mark) in Mark::ALL.into_iter().enumerate() {
        let chosen = given == Some(mark);
        if button_ui(ui, place + 1, mark, chosen).clicked() {
            clicked = Some(mark);
        }
    }
    clicked
}

fn button_ui(ui: &mut Ui, key: usize, mark: Mark, chosen: bool) -> Response {
    let (color, name) = (color(mark), capitalized(mark.name()));
    let (text, fill) = if chosen { (theme::WELL, color) } else { (color, theme::WELL) };
    let text = RichText::new(format!("{key} {name}")).color(text);
    let button = Button::new(text).fill(fill).stroke(Stroke::new(1.0, color));
    let response = ui.add(button);
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, chosen, &name));
    let hint = if chosen { format!("Click or press {key} again to remove it") } else { format!("Key: {key}") };
    response.on_hover_text(hint)
}
