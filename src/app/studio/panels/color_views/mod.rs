//! Menu entries from an OpenColorIO configuration: views, displays and looks.

pub mod query;

use crate::panel_context::PanelContext;
use crate::theme;
use color_config::{ColorChoice, ConfigNames, DisplayNames};
use egui::{Label, RichText, Ui};

/// Height in points reserved for a configuration while it is read.
const UNREAD: f32 = 400.0;
/// Width of an error message in points.
const SENTENCE: f32 = 300.0;

/// Starts the configuration's part of a menu, below the program's own choices. Returns the names in the configuration:
/// None without a configuration, while it is read, and after an error, which is shown.
pub fn config_ui<'a>(ui: &mut Ui, context: &PanelContext<'a>) -> Option<&'a ConfigNames> {
    if !context.readers.colors.is_configured() {
        return None;
    }
    ui.separator();
    let Some(names) = context.readers.colors.names() else {
        ui.spinner();
        // Reserves the full height, because an open list does not grow.
        ui.add_space(UNREAD);
        return None;
    };
    match names {
        Ok(names) => Some(names.as_ref()),
        Err(sentence) => {
            ui.set_max_width(SENTENCE);
            let sentence = RichText::new(sentence).color(theme::WARNING);
            ui.add(Label::new(sentence).wrap());
            None
        }
    }
}

/// The views of the display of `begin`, or of the first display; then other displays and looks. `now` is marked.
/// Returns the clicked choice.
pub fn color_views_ui(
    ui: &mut Ui,
    names: &ConfigNames,
    now: Option<&ColorChoice>,
    begin: Option<&ColorChoice>,
) -> Option<ColorChoice> {
    let Some(begin) = begin.cloned().or_else(|| first(names)) else {
        let none = "The OpenColorIO configuration has no displays";
        ui.label(RichText::new(none).color(theme::QUIET));
        return None;
    };
    let mut chosen = None;
    let mut choose = |ui: &mut Ui, name: &str, choice: ColorChoice| {
        if ui.selectable_label(now == Some(&choice), name).clicked() {
            chosen = Some(choice);
        }
    };
    let is_shown = |display: &&DisplayNames| begin.display.as_ref() == Some(&display.name);
    if let Some(display) = names.displays.iter().find(is_shown) {
        heading_ui(ui, &display.name);
        for view in &display.views {
            let view = Some(view.clone());
            let choice = ColorChoice { view, ..begin.clone() };
            choose(ui, choice.view.clone().as_deref().unwrap_or_default(), choice);
        }
    }
    if names.displays.len() > 1 {
        heading_ui(ui, "Display");
        for display in &names.displays {
            choose(ui, &display.name, on(display, &begin));
        }
    }
    if !names.looks.is_empty() {
        heading_ui(ui, "Look");
        let with = |look: Option<&String>| ColorChoice { look: look.cloned(), ..begin.clone() };
        choose(ui, "Look of the view", with(None));
        for look in &names.looks {
            choose(ui, look, with(Some(look)));
        }
    }
    chosen
}

/// Heading of the entries below.
pub fn heading_ui(ui: &mut Ui, text: &str) {
    ui.label(RichText::new(text).size(12.0).color(theme::QUIET));
}

/// Default view: the first view of the first display.
fn first(names: &ConfigNames) -> Option<ColorChoice> {
    let display = names.displays.first()?;
    Some(ColorChoice {
        display: Some(display.name.clone()),
        view: Some(display.views.first()?.clone()),
        ..ColorChoice::default()
    })
}

/// The same view on another display, or its first if it has no such view.
fn on(display: &DisplayNames, now: &ColorChoice) -> ColorChoice {
    let same = (display.views.iter()).find(|view| now.view.as_ref() == Some(view));
    ColorChoice {
        display: Some(display.name.clone()),
        view: same.or_else(|| display.views.first()).cloned(),
        ..now.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_display_keeps_the_view_that_it_has_and_the_look() {
        let display = |name: &str, views: &[&str]| DisplayNames {
            name: name.to_owned(),
            views: views.iter().map(|&view| view.to_owned()).collect(),
        };
        let displays = vec![display("Monitor", &["Film", "Raw"]), display("Hall", &["Print", "Raw"])];
        let names = ConfigNames { displays: displays.clone(), ..ConfigNames::default() };
        let film = first(&names).unwrap();
        assert_eq!((film.display.as_deref(), film.view.as_deref()), (Some("Monitor"), Some("Film")));
        let look = Some("warm".to_owned());
        let warm = ColorChoice { look: look.clone(), ..film };
        assert_eq!(on(&displays[1], &warm).view.as_deref(), Some("Print"));
        let raw = ColorChoice { view: Some("Raw".to_owned()), ..warm };
        let moved = on(&displays[1], &raw);
        assert_eq!((moved.view.as_deref(), moved.look), (Some("Raw"), look));
        assert_eq!(first(&ConfigNames::default()), None);
    }
}
