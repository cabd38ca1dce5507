//! Viewing settings of the picture: exposure, gamma, tone curve and channels. Exports ignore them, and a sign says so.

use crate::command::{Command, ViewCommand};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::color_views::{color_views_ui, config_ui};
use crate::panels::light::picture::{SHOWN, TONE_CURVES, curve_name};
use crate::panels::widgets::names::{called, short};
use crate::panels::widgets::numbers::computing;
use crate::state::State;
use crate::theme::{self, GAP};
use egui::containers::menu::MenuButton;
use egui::text::LayoutJob;
use egui::{
    Align2, Button, ComboBox, DragValue, FontId, Frame, Margin, Rect, RichText, Role, Sense, Ui, WidgetInfo, vec2,
};
use scene::{Channel, EXPOSURE_STOPS, GAMMA, Inspection, ViewTransform, Viewing};

/// Width of a number in points.
const FIELD: f32 = 52.0;
/// Height of the sign at the edge of the pictures, in points.
pub const SIGN: f32 = 32.0;
/// Most height of the menu of curves and views in points.
const MENU: f32 = 480.0;

/// The controls, from right to left in one track. Returns their width in points.
pub fn viewing_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) -> f32 {
    let track = Frame::new().fill(theme::WELL).corner_radius(4);
    let shown = track.inner_margin(Margin::symmetric(6, 1)).show(ui, |ui| {
        ui.spacing_mut().item_spacing.x = 0.5 * GAP;
        channels_ui(ui, context, out);
        curve_ui(ui, context, out);
        let viewing = &context.state.display.viewing;
        let mut changed = viewing.clone();
        let gamma = computing(&mut changed.gamma).speed(0.01).range(GAMMA).fixed_decimals(2);
        let hint = "Lifts or lowers the midtones, for viewing only. Double-click or Ctrl+R resets.";
        if number_ui(ui, "γ", gamma, viewing.gamma != 1.0, hint) {
            changed.gamma = 1.0;
        }
        let stops = computing(&mut changed.exposure_stops).speed(0.02).range(EXPOSURE_STOPS).fixed_decimals(1);
        let hint = "Brighter or darker by stops, for viewing only. Keys: E and Shift+E. Double-click or Ctrl+R resets.";
        let is_set = viewing.exposure_stops != 0.0;
        if number_ui(ui, "Exp", stops, is_set, hint) {
            changed.exposure_stops = 0.0;
        }
        if changed != *viewing {
            out.push(Command::View(ViewCommand::Viewing(changed)));
        }
        let eye = RichText::new(icons::SEEN).size(16.0).color(theme::QUIET);
        ui.label(eye).on_hover_text("View settings change only the display. Exports use the settings under Light.");
    });
    shown.response.rect.width()
}

/// A number with its name to the left. Returns true if it was reset.
fn number_ui(ui: &mut Ui, name: &str, field: DragValue, is_set: bool, hint: &str) -> bool {
    let response = ui
        .scope(|ui| {
            if is_set {
                let widgets = &mut ui.visuals_mut().widgets;
                for widget in [&mut widgets.inactive, &mut widgets.hovered] {
                    widget.fg_stroke.color = theme::VIEWING;
                }
            }
            ui.add_sized(vec2(FIELD, 22.0), field)
        })
        .inner;
    let label = ui.label(RichText::new(name).size(13.0).color(theme::QUIET));
    let response = response.labelled_by(label.id);
    let is_reset = response.double_clicked();
    if is_reset {
        // The first click started editing the number as text.
        ui.memory_mut(|memory| memory.surrender_focus(response.id));
    }
    theme::hint_at_rest_ui(response, hint);
    is_reset
}

/// Choice of the viewing curve: the look's tone curve, another, or a view of the OpenColorIO configuration.
fn curve_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let viewing = &context.state.display.viewing;
    let of_look = context.state.look.effects.view;
    let configured = context.state.display.color_view.as_ref();
    let color = match (viewing.view, configured) {
        (None, None) => theme::TEXT,
        _ => theme::VIEWING,
    };
    // A view is named at once, and applied once its table is ready.
    let named = configured.and_then(|choice| choice.view.as_deref());
    let now = named.unwrap_or_else(|| curve_name(viewing.view.unwrap_or(of_look)));
    let as_exported = if context.state.export_options.ocio.is_asked() {
        // An export through a configuration does not use the curve.
        format!("The look's curve ({})", curve_name(of_look))
    } else {
        format!("As exported ({})", curve_name(of_look))
    };
    // egui keeps the height of a list, so the longer list with a configuration has an id of its own.
    let is_longer = context.readers.colors.is_configured();
    let list = ComboBox::from_id_salt(("viewing curve", is_longer))
        .selected_text(RichText::new(short(now)).color(color))
        .width(68.0)
        .height(MENU)
        .show_ui(ui, |ui| {
            let mut choose = |ui: &mut Ui, view: Option<ViewTransform>, name: &str| {
                let is_now = configured.is_none() && viewing.view == view;
                if ui.selectable_label(is_now, name).clicked() {
                    let viewing = Viewing { view, through: None, ..viewing.clone() };
                    out.push(Command::View(ViewCommand::LookThrough(None)));
                    out.push(Command::View(ViewCommand::Viewing(viewing)));
                }
            };
            choose(ui, None, &as_exported);
            for (view, name) in TONE_CURVES {
                choose(ui, Some(view), name);
            }
            if let Some(names) = config_ui(ui, context) {
                let chosen = color_views_ui(ui, names, configured, configured);
                out.extend(chosen.map(|view| Command::View(ViewCommand::LookThrough(Some(view)))));
            }
        });
    (list.response).widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, "View"));
    let hint = "A tone curve or OpenColorIO view, for viewing only. Exports use the curve under Light.";
    list.response.on_hover_text(hint);
}

/// The menu of channels.
fn channels_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let now = context.state.display.inspection;
    let looked = SHOWN.iter().find(|(one, ..)| *one == now && *one != Inspection::Picture);
    let icon = RichText::new(icons::CHANNELS).size(16.0);
    let button = match looked {
        Some((_, name, _)) => Button::new((icon, RichText::new(*name).color(theme::VIEWING))),
        None => Button::new(icon),
    };
    let menu = MenuButton::from_button(button).ui(ui, |ui| {
        for (inspection, name, key) in SHOWN {
            let entry = Button::selectable(inspection == now, name).shortcut_text(key);
            if icons::named_ui(ui, true, entry, name).clicked() && inspection != now {
                out.push(Command::View(ViewCommand::Inspect(inspection)));
            }
        }
    });
    called(menu.0.on_hover_text("Channel to show"), "Channels".to_owned());
}

/// Name of the view shown in place of the picture.
fn inspected(inspection: Inspection) -> Option<&'static str> {
    Some(match inspection {
        Inspection::Channel(Channel::Red) => "red channel",
        Inspection::Channel(Channel::Green) => "green channel",
        Inspection::Channel(Channel::Blue) => "blue channel",
        Inspection::Channel(Channel::Luminance) => "luminance",
        Inspection::Channel(Channel::Alpha) => "matte (alpha)",
        Inspection::FalseColor => "false colour",
        // A difference is labelled over the pictures.
        Inspection::Picture | Inspection::Difference { .. } => return None,
    })
}

/// Viewing settings that differ from neutral, in words; None if the display equals the export.
pub fn words(viewing: &Viewing, inspection: Inspection) -> Option<String> {
    let Viewing { exposure_stops, gamma, view, through } = viewing;
    let mut changes = Vec::new();
    changes.extend(inspected(inspection).map(str::to_owned));
    if *exposure_stops != 0.0 {
        changes.push(format!("{exposure_stops:+.1} stops"));
    }
    if *gamma != 1.0 {
        changes.push(format!("γ {gamma:.2}"));
    }
    changes.extend(match through {
        Some(table) => Some(table.name.clone()),
        None => view.map(|view| curve_name(view).to_owned()),
    });
    (!changes.is_empty()).then(|| format!("viewing {}", changes.join(", ")))
}

/// Viewing settings that exports lack: all but a view that the export uses too.
fn unexported(state: &State) -> Viewing {
    let mut viewing = state.display.viewing.clone();
    let exported = &state.export_options.ocio;
    if viewing.through.is_some() && state.display.color_view.as_ref() == Some(exported) {
        (viewing.view, viewing.through) = (None, None);
    }
    viewing
}

/// The sign over the pictures, in the middle of an edge, while the display differs from the export.
pub fn sign_ui(ui: &Ui, rect: Rect, edge: Align2, state: &State) {
    let Some(words) = words(&unexported(state), state.shown_inspection()) else { return };
    let text = format!("{} {words}: not exported", icons::SEEN);
    let painter = ui.painter().with_clip_rect(rect);
    let font = FontId::proportional(13.0);
    let room = (rect.width() - 2.0 * GAP - 12.0).max(1.0);
    let mut job = LayoutJob::simple(text, font, theme::VIEWING, room);
    (job.wrap.max_rows, job.wrap.break_anywhere) = (1, true);
    let galley = painter.layout_job(job);
    let size = galley.size() + vec2(12.0, 6.0);
    let back = edge.align_size_within_rect(size, rect.shrink(GAP));
    painter.rect_filled(back, 3.0, theme::WELL);
    painter.galley(back.min + vec2(6.0, 3.0), galley, theme::VIEWING);
    let sign = ui.interact(back, ui.scope_id().with("viewing"), Sense::hover());
    sign.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{words}: not exported")));
}

#[cfg(test)]
mod tests {
    use super::*;
    use color_config::ColorChoice;
    use imaging::DisplayTable;
    use std::sync::Arc;

    #[test]
    fn what_is_changed_for_looking_is_said_and_nothing_else() {
        let plain = Inspection::Picture;
        let neutral = Viewing::default();
        assert_eq!(words(&neutral, plain), None);
        assert_eq!(words(&neutral, Inspection::Difference { gain: 4.0 }), None);
        let viewing = Viewing { exposure_stops: -1.5, gamma: 1.2, view: Some(ViewTransform::Aces), through: None };
        let said = words(&viewing, plain).unwrap();
        assert_eq!(said, "viewing -1.5 stops, γ 1.20, ACES");
        let through = Some(Arc::new(DisplayTable::new("Film".to_owned(), |_| ())));
        let through = Viewing { through, ..viewing };
        let said = words(&through, Inspection::Channel(Channel::Red)).unwrap();
        assert_eq!(said, "viewing red channel, -1.5 stops, γ 1.20, Film");
        // The sign names every view that the menu shows in place of the picture.
        for (inspection, name, _) in SHOWN {
            let is_said = words(&neutral, inspection).is_some();
            assert_eq!(is_said, inspection != plain, "{name}");
        }
    }

    #[test]
    fn a_view_that_exports_go_through_too_is_no_difference() {
        let mut state = State::new(1, 24.0);
        let film = ColorChoice {
            display: Some("Monitor".to_owned()),
            view: Some("Film".to_owned()),
            ..ColorChoice::default()
        };
        let table = DisplayTable::new("Film".to_owned(), |_| ());
        state.display.viewing.through = Some(Arc::new(table));
        state.display.viewing.exposure_stops = 1.0;
        state.display.color_view = Some(film.clone());
        let said = |state: &State| words(&unexported(state), Inspection::Picture).unwrap();
        assert_eq!(said(&state), "viewing +1.0 stops, Film");
        state.export_options.ocio = film;
        assert_eq!(said(&state), "viewing +1.0 stops");
    }
}
