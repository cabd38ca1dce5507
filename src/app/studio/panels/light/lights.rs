//! The lights placed by hand: one line each, by group, and the settings of the chosen light.

use crate::command::{AimCommand, Command, LightsCommand, LookCommand, ViewCommand};
use crate::icons;
use crate::layout::Pane;
use crate::look::MOST_LETTERS;
use crate::panel_context::PanelContext;
use crate::panels::widgets::diamond;
use crate::panels::widgets::rows::{Number, choice_ui, grid, setting_ui};
use crate::theme::{self, GAP};
use egui::{
    Align, Button, Event, Id, Key, Label, Layout, Modifiers, Rect, Response, RichText, Role, TextEdit, Ui, WidgetInfo,
    pos2, vec2,
};
use light::{LightGroup, Lighting, PlacedLight, placed, white};
use scene::{LightSetting, Setting};

/// Space in points after a light's name: for its colour, and the duplicate and remove buttons.
const BEHIND_NAME: f32 = 112.0;
/// Width in points of a light's colour button.
const SWATCH: f32 = 30.0;
/// Space in points after a group's name: for the remove button.
const BEHIND_GROUP: f32 = 38.0;

/// Changes made while the lights are drawn.
struct Edit {
    lighting: Lighting,
    chosen: Option<usize>,
    removed: Option<usize>,
}

/// The buttons that add a light, and that light by the face.
pub fn add_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let hint = "Adds a softbox. It stays in place when the environment is turned.";
    if icons::worded_ui(ui, icons::ADD, "Add light").on_hover_text(hint).clicked() {
        out.push(Command::Lights(LightsCommand::Add));
    }
    let aims = context.state.viewport.aims;
    let hint = "Light by the face: click where a light should fall, and drag to move it. Key: H";
    if toggle_ui(ui, aims, icons::AIM, "Light by the face", hint).clicked() {
        out.push(Command::Aim(AimCommand::Toggle));
    }
    // Beside the buttons, where it moves nothing.
    if let Some(names) = solo_names(&context.state.look.lighting) {
        let text = RichText::new(format!("Solo: {names}")).color(theme::ACCENT);
        ui.add(Label::new(text).truncate());
    }
}

/// All lights: those without a group, then each group with its own.
pub fn lights_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let lighting = &context.state.look.lighting;
    let mut edit = Edit { lighting: lighting.clone(), chosen: context.state.chosen_light(), removed: None };
    // Commands that name a group or act on one light; applied after the changes in `edit`.
    let mut after = Vec::new();
    let of_group = |lighting: &Lighting, group: Option<&str>| -> Vec<usize> {
        let lights = lighting.placed.iter().enumerate();
        let inside = lights.filter(|(_, light)| lighting.group_of(light).map(|group| &*group.name) == group);
        inside.map(|(i, _)| i).collect()
    };
    for i in of_group(lighting, None) {
        light_ui(ui, context, i, &mut edit, (out, &mut after));
    }
    for (g, group) in lighting.groups.iter().enumerate() {
        if group_ui(ui, context, g, &mut edit, (out, &mut after)) {
            continue;
        }
        ui.indent(("lights of group", g), |ui| {
            for i in of_group(lighting, Some(&group.name)) {
                light_ui(ui, context, i, &mut edit, (out, &mut after));
            }
        });
    }
    if let Some(removed) = edit.removed {
        edit.lighting.placed.remove(removed);
        edit.chosen = match edit.chosen {
            Some(chosen) if chosen > removed => Some(chosen - 1),
            Some(chosen) if chosen == removed => None,
            other => other,
        };
    }
    if edit.lighting != *lighting {
        out.push(relit(edit.lighting));
    }
    if edit.chosen != context.state.chosen_light() {
        out.push(Command::View(ViewCommand::ChooseLight(edit.chosen)));
    }
    out.append(&mut after);
    press_ui(ui, context, context.state.panes.active == Pane::Light, out);
}

/// Copies, pastes and removes the chosen light if the keyboard `is_ours`.
pub fn press_ui(ui: &Ui, context: &PanelContext, is_ours: bool, out: &mut Vec<Command>) {
    if !is_ours || context.state.covers.takes_keys() || ui.ctx().text_edit_focused() {
        return;
    }
    let has_chosen = context.state.chosen_light().is_some();
    let mut add = |does| out.push(Command::Lights(does));
    ui.input_mut(|input| {
        input.events.retain(|event| {
            match event {
                Event::Copy if has_chosen => add(LightsCommand::Copy),
                Event::Cut if has_chosen => {
                    add(LightsCommand::Copy);
                    add(LightsCommand::Remove);
                }
                Event::Paste(text) => add(LightsCommand::Paste(text.clone())),
                _ => return true,
            }
            false
        });
        let mut pressed = |key| input.consume_key(Modifiers::NONE, key);
        if has_chosen && (pressed(Key::Delete) || pressed(Key::Backspace)) {
            add(LightsCommand::Remove);
        }
    });
}

/// The command that sets the light's settings.
pub fn relit(lighting: Lighting) -> Command {
    Command::Look(LookCommand::Lighting(Box::new(lighting)))
}

/// Names of the solo lights; None without one.
pub fn solo_names(lighting: &Lighting) -> Option<String> {
    let names = lighting.solo_titles();
    let (last, others) = names.split_last()?;
    Some(match others {
        [] => last.clone(),
        _ => format!("{} and {last}", others.join(", ")),
    })
}

/// An icon button that stays down while `on`.
fn toggle_ui(ui: &mut Ui, on: bool, icon: &str, name: &str, hint: &str) -> Response {
    let color = if on { theme::ACCENT } else { theme::TEXT };
    let icon = RichText::new(icon).size(15.0).color(color);
    let button = Button::selectable(on, icon).frame_when_inactive(true);
    let response = ui.add(button.min_size(vec2(26.0, 22.0)));
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, on, name));
    response.on_hover_text(hint)
}

/// The mute and solo icons; they change `muted` and `solo`.
fn mute_and_solo_ui(ui: &mut Ui, title: &str, what: &str, muted: &mut bool, solo: &mut bool) {
    let (icon, hint) =
        if *muted { (icons::HIDDEN, format!("Turns {what} on")) } else { (icons::SEEN, format!("Mutes {what}")) };
    if toggle_ui(ui, *muted, icon, &format!("Mute {title}"), &hint).clicked() {
        *muted = !*muted;
    }
    let hint = "Only solo lights shine, in exports too";
    if toggle_ui(ui, *solo, icons::SOLO, &format!("Solo {title}"), hint).clicked() {
        *solo = !*solo;
    }
}

/// The arrow that shows or hides the content under a line.
fn arrow_ui(ui: &mut Ui, is_open: bool, name: &str, what: &str) -> Response {
    let (arrow, hint) =
        if is_open { (icons::DOWN, format!("Hide {what}")) } else { (icons::NEXT, format!("Show {what}")) };
    let arrow = Button::new(RichText::new(arrow).size(12.0).color(theme::QUIET));
    let arrow = arrow.frame_when_inactive(false).min_size(vec2(18.0, 22.0));
    let response = ui.add(arrow);
    response.widget_info(|| WidgetInfo::selected(Role::DisclosureTriangle, true, is_open, name));
    response.on_hover_text(hint)
}

/// A small icon button.
fn icon_ui(ui: &mut Ui, icon: &str, name: &str) -> Response {
    let button = Button::new(RichText::new(icon).size(14.0)).min_size(vec2(26.0, 22.0));
    icons::named_ui(ui, true, button, name).on_hover_text(name)
}

/// A field for a name, with `behind` points free after it. Returns the typed name once the field loses the focus.
fn name_ui(ui: &mut Ui, (id, behind): (Id, f32), now: &str, hint: &str, name: &str) -> (Response, Option<String>) {
    let typed: Option<String> = ui.data(|data| data.get_temp(id));
    let mut text = typed.clone().unwrap_or_else(|| now.to_owned());
    let field = TextEdit::singleline(&mut text)
        .id(id)
        .hint_text(RichText::new(hint).color(theme::TEXT))
        .char_limit(MOST_LETTERS)
        .desired_width((ui.available_width() - behind).max(40.0));
    let response = ui.add(field);
    response.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, name));
    if response.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, text));
        (response, None)
    } else {
        ui.data_mut(|data| data.remove::<String>(id));
        (response, typed.map(|_| text.trim().to_owned()))
    }
}

/// One light: its line and, if it is chosen, its settings.
fn light_ui(
    ui: &mut Ui,
    context: &PanelContext,
    index: usize,
    edit: &mut Edit,
    (out, after): (&mut Vec<Command>, &mut Vec<Command>),
) {
    let is_chosen = edit.chosen == Some(index);
    let top = ui.cursor().top();
    ui.push_id(("light", index), |ui| {
        line_ui(ui, index, is_chosen, edit, after);
        if is_chosen {
            settings_ui(ui, context, index, edit, (out, after));
        }
    });
    if is_chosen {
        let left = ui.min_rect().left() - GAP;
        let bottom = ui.cursor().top() - ui.spacing().item_spacing.y;
        let bar = Rect::from_min_max(pos2(left, top), pos2(left + 3.0, bottom));
        ui.painter().rect_filled(bar, 0.0, theme::ACCENT);
    }
}

fn line_ui(ui: &mut Ui, index: usize, is_chosen: bool, edit: &mut Edit, after: &mut Vec<Command>) {
    let light = &mut edit.lighting.placed[index];
    let title = light.title(index);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let name = format!("Settings of {title}");
        if arrow_ui(ui, is_chosen, &name, "its settings").clicked() {
            edit.chosen = (!is_chosen).then_some(index);
        }
        let mut muted = !light.enabled;
        mute_and_solo_ui(ui, &title, "the light", &mut muted, &mut light.solo);
        light.enabled = !muted;
        let id = Id::unique(("light name", index));
        let (hint, name) = (format!("Light {}", index + 1), format!("Name of {title}"));
        let (field, typed) = name_ui(ui, (id, BEHIND_NAME), &light.name, &hint, &name);
        if field.gained_focus() {
            edit.chosen = Some(index);
        }
        if let Some(typed) = typed {
            light.name = typed;
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if icon_ui(ui, icons::REMOVE, &format!("Remove light {}", index + 1)).clicked() {
                edit.removed = Some(index);
            }
            if icon_ui(ui, icons::COPY, &format!("Duplicate light {}", index + 1)).clicked() {
                after.push(Command::View(ViewCommand::ChooseLight(Some(index))));
                after.push(Command::Lights(LightsCommand::Duplicate));
            }
            ui.spacing_mut().interact_size.x = SWATCH;
            // egui's button rounds the colour, so it edits a copy.
            let mut color = light.color;
            let swatch = ui.color_edit_button_rgb(&mut color);
            let name = format!("Colour of {title}");
            swatch.widget_info(|| WidgetInfo::labeled(Role::ColorWell, true, &name));
            if swatch.changed() {
                (light.color, light.temperature_k) = (color, None);
            }
        });
    });
}

/// The settings of the chosen light.
fn settings_ui(
    ui: &mut Ui,
    context: &PanelContext,
    index: usize,
    edit: &mut Edit,
    (out, after): (&mut Vec<Command>, &mut Vec<Command>),
) {
    let light = &edit.lighting.placed[index];
    let (id, title) = (light.id, light.title(index));
    let mut row_ui = |ui: &mut Ui, setting| {
        let setting = Setting::Light(id, setting);
        setting_ui(ui, context, (setting, setting.label()), after);
    };
    grid("light settings").show(ui, |ui| {
        let kinds = [(placed::Kind::Area, "Box"), (placed::Kind::Disc, "Disc"), (placed::Kind::Point, "Point")];
        choice_ui(ui, "Kind", &kinds, &mut edit.lighting.placed[index].kind);
        ui.end_row();
        group_choice_ui(ui, index, &mut edit.lighting);
        ui.end_row();
        row_ui(ui, LightSetting::Intensity);
        let light = &mut edit.lighting.placed[index];
        // Keys may have changed the colour since it was set by temperature.
        let is_white = |kelvin: &f32| {
            let gains = white::gains(*kelvin, 0.0);
            (gains.iter().zip(light.color)).all(|(a, b)| (a - b).abs() < 1e-3)
        };
        let kelvin = light.temperature_k.filter(is_white);
        let kelvin = kelvin.unwrap_or(white::NEUTRAL_K);
        let reset = || {
            let mut lighting = context.state.look.lighting.clone();
            let PlacedLight { color, temperature_k, .. } = PlacedLight::default();
            let light = &mut lighting.placed[index];
            (light.color, light.temperature_k) = (color, temperature_k);
            relit(lighting)
        };
        let number = Number::from_setting(Setting::Temperature);
        let (field, kelvin) = number.ui(ui, kelvin, out, reset);
        if let Some(kelvin) = kelvin {
            light.set_temperature(kelvin);
        }
        let channels = [LightSetting::Red, LightSetting::Green, LightSetting::Blue];
        let channels = channels.map(|channel| Setting::Light(id, channel));
        let place = diamond::beside(field);
        let called = format!("{title} colour");
        diamond::within_ui(ui, context, (&channels, &called), place, out);
        ui.end_row();
        for setting in [LightSetting::Yaw, LightSetting::Pitch, LightSetting::Radius] {
            row_ui(ui, setting);
        }
    });
}

/// The group of a light: an existing one, none, or a new one.
fn group_choice_ui(ui: &mut Ui, index: usize, lighting: &mut Lighting) {
    let new = lighting.groups.len();
    let names: Vec<String> = lighting.groups.iter().map(|group| group.name.clone()).collect();
    let light = &mut lighting.placed[index];
    let now = names.iter().position(|name| *name == light.group);
    let mut all = vec![(None, "None")];
    all.extend(names.iter().enumerate().map(|(g, name)| (Some(g), &**name)));
    all.push((Some(new), "New group"));
    let mut wanted = now;
    choice_ui(ui, "Group", &all, &mut wanted).on_hover_text("Mute, solo and intensity act on the whole group");
    match wanted {
        _ if wanted == now => {}
        None => light.group = String::new(),
        Some(group) => {
            light.group = names.get(group).cloned().unwrap_or_else(|| {
                let name = free_name(&names);
                lighting.groups.push(LightGroup { name: name.clone(), ..LightGroup::default() });
                name
            });
        }
    }
}

/// A group name that is not in use.
fn free_name(names: &[String]) -> String {
    let all = (1..).map(|number| format!("Group {number}"));
    let mut free = all.filter(|name| !names.contains(name));
    free.next().unwrap_or_default()
}

/// A group's line: name, mute, solo and intensity. Returns true if it is folded.
fn group_ui(
    ui: &mut Ui,
    context: &PanelContext,
    index: usize,
    edit: &mut Edit,
    (out, after): (&mut Vec<Command>, &mut Vec<Command>),
) -> bool {
    let group = &mut edit.lighting.groups[index];
    let title = &group.name.clone();
    let folded = context.state.is_folded(group.id);
    ui.push_id(("group", index), |ui| {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let (name, what) = (format!("{title} group"), "the lights of the group");
            if arrow_ui(ui, !folded, &name, what).clicked() {
                let fold = ViewCommand::FoldLights(group.id, !folded);
                out.push(Command::View(fold));
            }
            ui.label(RichText::new(icons::FOLDER).color(theme::QUIET));
            let what = "all lights of the group";
            mute_and_solo_ui(ui, title, what, &mut group.muted, &mut group.solo);
            let id = Id::unique(("group name", index));
            let name = format!("Name of {title}");
            let renamed = name_ui(ui, (id, BEHIND_GROUP), title, "", &name).1;
            if let Some(name) = renamed.filter(|name| !name.is_empty() && name != title) {
                after.push(Command::Lights(LightsCommand::RenameGroup(index, name)));
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let name = format!("Remove {title}; its lights stay");
                if icon_ui(ui, icons::REMOVE, &name).clicked() {
                    after.push(Command::Lights(LightsCommand::RemoveGroup(index)));
                }
            });
        });
        if folded {
            return;
        }
        grid("group").show(ui, |ui| {
            let setting = Setting::Group(group.id);
            let name = format!("{} of {title}", setting.label());
            setting_ui(ui, context, (setting, &name), after);
        });
    });
    folded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_group_has_a_name_of_its_own() {
        let names = ["Group 1", "Left", "Group 2"].map(str::to_owned);
        assert_eq!(free_name(&names), "Group 3");
    }
}
