//! The colours of the files: a built-in colour space, or a choice from an OpenColorIO configuration.

use super::choice::LIST;
use crate::export_options::ExportOptions;
use crate::panel_context::PanelContext;
use crate::panels::color_views::{color_views_ui, config_ui, heading_ui};
use crate::panels::widgets::names::short;
use crate::theme;
use color_config::{ColorChoice, ConfigNames, SpaceName};
use egui::{Checkbox, Color32, ComboBox, Label, RichText, Role, TextEdit, Ui, WidgetInfo};
use export::{Format, OutputSpace};

/// Most height in points of a list with a configuration.
const MENU: f32 = 480.0;
/// OpenColorIO role of the working space.
const WORKING: &str = "scene_linear";

pub fn ui(ui: &mut Ui, context: &PanelContext, options: &mut ExportOptions) {
    let is_linear = options.format == Format::Exr;
    if options.space == Some(OutputSpace::Acescg) && !is_linear {
        options.space = None;
    }
    let names = (context.readers.colors.names()).and_then(|names| names.as_ref().ok());
    if is_linear && !is_light(&options.ocio, names.map(AsRef::as_ref)) {
        options.ocio = ColorChoice::default();
    }
    ui.label("Colours");
    ui.horizontal(|ui| list_ui(ui, context, options));
    ui.end_row();
    if !is_linear && !options.ocio.is_asked() {
        table_ui(ui, options);
    }
}

/// Describes the colours of the files, if a configuration sets them.
pub fn sentence_ui(ui: &mut Ui, context: &PanelContext, options: &ExportOptions) {
    let Some(sentence) = options.ocio_sentence() else { return };
    let mut say = |sentence: &str, color: Color32| {
        let sentence = RichText::new(sentence).size(13.0).color(color);
        ui.add(Label::new(sentence).wrap());
    };
    say(&sentence, theme::QUIET);
    if let Some(Err(why)) = context.readers.colors.names() {
        say(why, theme::WARNING);
    }
}

/// The list of built-in colour spaces, and below them the choices of a configuration.
fn list_ui(ui: &mut Ui, context: &PanelContext, options: &mut ExportOptions) {
    let is_linear = options.format == Format::Exr;
    let plain = if is_linear { "Linear Rec. 709" } else { "sRGB" };
    let own = options.space.map_or(plain, |space| name(space, is_linear));
    let configured = options.ocio.space.as_deref().or(options.ocio.view.as_deref());
    let shown = configured.unwrap_or(own);
    let text = format!("Colours: {shown}");
    // egui keeps the height of a list, so the longer list with a configuration has an id of its own.
    let is_longer = context.readers.colors.is_configured();
    let mut list = ComboBox::from_id_salt(("Colours", is_longer)).width(LIST).selected_text(short(shown));
    if is_longer {
        list = list.height(MENU);
    }
    let list = list.show_ui(ui, |ui| {
        for (space, name, hint) in own_spaces(plain, is_linear) {
            let is_now = !options.ocio.is_asked() && options.space == space;
            let entry = ui.selectable_label(is_now, name).on_hover_text(hint);
            if entry.clicked() {
                (options.space, options.ocio) = (space, ColorChoice::default());
            }
        }
        if let Some(names) = config_ui(ui, context)
            && let Some(chosen) = offers_ui(ui, context, names, options)
        {
            options.ocio = chosen;
        }
    });
    (list.response).widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, &text));
}

/// Choices that a configuration offers for such files. Returns the clicked one.
fn offers_ui(ui: &mut Ui, context: &PanelContext, names: &ConfigNames, options: &ExportOptions) -> Option<ColorChoice> {
    let (now, is_linear) = (&options.ocio, options.format == Format::Exr);
    let mut chosen = None;
    if !is_linear {
        // The list starts at the display used for viewing, which does not choose it.
        let looked_at = context.state.display.color_view.as_ref();
        let begin = Some(now).filter(|now| now.is_view()).or(looked_at);
        chosen = color_views_ui(ui, names, Some(now), begin);
    }
    heading_ui(ui, if is_linear { "Linear colour space" } else { "Colour space" });
    for space in spaces(names, is_linear) {
        let text = if is_working(names, space) { format!("{} ({WORKING})", space.name) } else { space.name.clone() };
        let is_now = now.space.as_ref() == Some(&space.name);
        if ui.selectable_label(is_now, text).clicked() {
            chosen = Some(ColorChoice { space: Some(space.name.clone()), ..ColorChoice::default() });
        }
    }
    chosen
}

/// The colour spaces that files can hold, in linear light or not: the working space first, then the configuration's
/// order.
fn spaces(names: &ConfigNames, is_linear: bool) -> Vec<&SpaceName> {
    let can_be =
        |space: &&SpaceName| !space.is_data && (!is_linear || space.is_scene_linear || is_working(names, space));
    let mut all: Vec<&SpaceName> = names.spaces.iter().filter(can_be).collect();
    all.sort_by_key(|space| !is_working(names, space));
    all
}

fn is_working(names: &ConfigNames, space: &SpaceName) -> bool {
    let mut roles = names.roles.iter();
    roles.any(|role| role.role == WORKING && role.space == space.name)
}

/// True if a file in linear light can hold the choice. Also true for a space until the configuration is read.
fn is_light(choice: &ColorChoice, names: Option<&ConfigNames>) -> bool {
    match (&choice.space, names) {
        (None, _) => !choice.is_view(),
        (Some(_), None) => true,
        (Some(space), Some(names)) => {
            let mut held = spaces(names, true).into_iter();
            held.any(|held| held.name == *space)
        }
    }
}

fn table_ui(ui: &mut Ui, options: &mut ExportOptions) {
    let label = ui.label("LUT");
    ui.horizontal(|ui| {
        let field = TextEdit::singleline(&mut options.table).hint_text("None, or a .cube file").desired_width(130.0);
        ui.add(field).labelled_by(label.id).on_hover_text(
            "An sRGB-to-sRGB LUT, baked into the files. A path in the project's folder, or an absolute one.",
        );
        let named = !options.table.trim().is_empty();
        ui.add_enabled(named, Checkbox::new(&mut options.show_table, "Show it"))
            .on_hover_text("Shows the picture through the LUT in every workspace");
    });
    ui.end_row();
}

/// The built-in colour spaces for such files, with names and descriptions.
fn own_spaces(
    plain: &'static str,
    is_linear: bool,
) -> impl Iterator<Item = (Option<OutputSpace>, &'static str, &'static str)> {
    let own = (None, plain, "The working space; a movie is tagged Rec. 709, as players expect");
    let other = OutputSpace::ALL.into_iter().filter(move |&space| {
        let same = matches!(space, OutputSpace::Srgb | OutputSpace::Rec709);
        if is_linear { !same } else { space != OutputSpace::Acescg }
    });
    let other = other.map(move |space| (Some(space), name(space, is_linear), about(space, is_linear)));
    std::iter::once(own).chain(other)
}

fn name(space: OutputSpace, is_linear: bool) -> &'static str {
    match (space, is_linear) {
        (OutputSpace::Srgb, false) => "sRGB, tagged sRGB",
        (OutputSpace::Srgb | OutputSpace::Rec709, true) => "Linear Rec. 709",
        (OutputSpace::P3, true) => "Linear P3",
        (OutputSpace::Rec2020, true) => "Linear Rec. 2020",
        (space, _) => space.name(),
    }
}

fn about(space: OutputSpace, is_linear: bool) -> &'static str {
    match (space, is_linear) {
        (_, true) => "Linear light; the header has the primaries",
        (OutputSpace::Srgb, _) => "The same codes, tagged with the sRGB curve if the file format allows it",
        (OutputSpace::P3, _) => "Display P3: D65 and the curve of sRGB",
        _ => "For a reference monitor: BT.1886, a power of 2.4",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use color_config::Role as ConfigRole;

    #[test]
    fn an_exr_is_offered_linear_spaces_alone_and_no_file_numbers_that_are_no_colours() {
        let space = |name: &str, is_scene_linear, is_data| SpaceName {
            name: name.to_owned(),
            family: String::new(),
            is_scene_linear,
            is_data,
        };
        let names = ConfigNames {
            // Older configurations do not mark linear spaces; the role does.
            spaces: vec![
                space("light", true, false),
                space("log", false, false),
                space("numbers", false, true),
                space("show", false, false),
            ],
            roles: vec![ConfigRole { role: WORKING.to_owned(), space: "show".to_owned() }],
            ..ConfigNames::default()
        };
        let offered = |is_linear| -> Vec<&str> {
            let all = spaces(&names, is_linear).into_iter();
            all.map(|space| &*space.name).collect()
        };
        assert_eq!(offered(true), ["show", "light"]);
        assert_eq!(offered(false), ["show", "light", "log"]);
        let of_space = |space: &str| ColorChoice { space: Some(space.to_owned()), ..ColorChoice::default() };
        let view = ColorChoice { view: Some("Film".to_owned()), ..ColorChoice::default() };
        assert!(is_light(&ColorChoice::default(), Some(&names)));
        assert!(is_light(&of_space("show"), Some(&names)) && is_light(&of_space("log"), None));
        assert!(!is_light(&of_space("log"), Some(&names)) && !is_light(&view, None));
    }
}
