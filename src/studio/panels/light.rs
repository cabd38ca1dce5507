//! The light: the environment's rotation and grade, its brightest areas, and the lights placed by hand.

use super::bar_ui;
use super::diamond::{self, animated_ui, beside_ui};
use super::front;
use super::group::Heading;
use super::numbers::computing;
use super::panorama::Preview;
use super::rows::{BESIDE, Row, choice_ui, grid};
use crate::command::{Command, LookCommand, ViewCommand};
use crate::environment_library::EnvironmentEntry;
use crate::environment_list::ListedEnvironment;
use crate::icons;
use crate::look::Group;
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{
    Align, Button, DragValue, Grid, Id, Layout, Rect, RichText, Role, TextEdit, Ui, WidgetInfo,
    pos2, vec2,
};
use light::conventions::Tool;
use light::weights::Weighting;
use light::{Lighting, PlacedLight, placed, white};
use scene::{LightSetting, Setting};
use std::ops::RangeInclusive;
use worker::Origin;

/// Letters of a light's name, at the most.
const MOST_LETTERS: usize = 40;

/// The panorama's picture, and the environment whose front the person wants to pick again.
#[derive(Default)]
pub struct LightPanel {
    preview: Preview,
    asked: Option<Origin>,
}

impl LightPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let listed = context.environment().map(|entry| &entry.listed);
        let again = listed.is_some_and(|listed| self.asked.as_ref() == Some(&listed.origin));
        let asked = again || listed.is_some_and(ListedEnvironment::asks);
        let before = out.len();
        self.preview.ui(ui, context, asked, out);
        if asked {
            front::question_ui(ui, context, out);
        }
        ui.add_space(GAP);
        let mut picks = false;
        Heading::of(Group::Environment, context).ui(
            ui,
            out,
            |_, _| {},
            |ui, out| {
                picks = turn_ui(ui, context, out);
            },
        );
        if picks {
            self.asked = listed.map(|listed| listed.origin.clone());
        }
        Heading::of(Group::Grade, context).ui(
            ui,
            out,
            |_, _| {},
            |ui, out| grade_ui(ui, context, out),
        );
        if out[before..]
            .iter()
            .any(|c| matches!(c, Command::Look(LookCommand::Front(..))))
        {
            self.asked = None;
        }
        Heading::of(Group::Lights, context).ui(
            ui,
            out,
            |_, _| {},
            |ui, out| {
                placed_ui(ui, context, out);
                animated_ui(ui, context, Group::Lights);
            },
        );
    }
}

const TURNS: [Row<Lighting>; 3] = [
    Row {
        name: "Pitch",
        of: |lighting| &mut lighting.pitch_deg,
        speed: 0.5,
        range: -180.0..=180.0,
        decimals: 1,
        suffix: "°",
        hint: "",
    },
    Row {
        name: "Roll",
        of: |lighting| &mut lighting.roll_deg,
        speed: 0.5,
        range: -180.0..=180.0,
        decimals: 1,
        suffix: "°",
        hint: "",
    },
    Row {
        name: "Background yaw",
        of: |lighting| &mut lighting.background_yaw_deg,
        speed: 0.5,
        range: -180.0..=180.0,
        decimals: 1,
        suffix: "°",
        hint: "",
    },
];

const GRADES: [Row<Lighting>; 3] = [
    Row {
        name: "Intensity",
        of: |lighting| &mut lighting.intensity_stops,
        speed: 0.02,
        range: Lighting::STOPS,
        decimals: 2,
        suffix: " stops",
        hint: "",
    },
    Row {
        name: "Temperature",
        of: |lighting| &mut lighting.temperature_k,
        speed: 20.0,
        range: white::RANGE_K,
        decimals: 0,
        suffix: " K",
        hint: "",
    },
    Row {
        name: "Tint",
        of: |lighting| &mut lighting.tint,
        speed: 0.5,
        range: -150.0..=150.0,
        decimals: 0,
        suffix: "",
        hint: "",
    },
];

/// The command that sets the light's settings.
fn relit(lighting: Lighting) -> Command {
    Command::Look(LookCommand::Lighting(Box::new(lighting)))
}

/// How the environment is turned and split among the lamps. Returns whether the person wants to pick the front again.
fn turn_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) -> bool {
    let look = &context.state.look;
    let mut asks = false;
    grid("light").show(ui, |ui| {
        let is_file = |entry: &EnvironmentEntry| matches!(entry.listed.origin, Origin::File(_));
        if context.environment().is_some_and(is_file) {
            asks = front::answer_ui(ui, context, out);
            ui.end_row();
        }
        let mut yaw = look.yaw_deg;
        let field = computing(&mut yaw)
            .speed(0.5)
            .fixed_decimals(1)
            .suffix("°");
        // With keys it may go around several times; the bar then shows where it stands.
        let around = 180.0 - (180.0 - look.yaw_deg).rem_euclid(360.0);
        let field = (field, around, &(-180.0..=180.0));
        let field = bar_ui(ui, "Yaw", field, BESIDE, out, || {
            Command::Look(LookCommand::Yaw(0.0))
        });
        if yaw != look.yaw_deg {
            out.push(Command::Look(LookCommand::Yaw(yaw)));
        }
        beside_ui(ui, context, Setting::Yaw, field.rect, out);
        ui.end_row();
        let settings = [Setting::Pitch, Setting::Roll, Setting::BackgroundYaw];
        for (row, setting) in TURNS.iter().zip(settings) {
            let field = row.ui(ui, &look.lighting, out, relit);
            beside_ui(ui, context, setting, field.rect, out);
            ui.end_row();
        }
        let kinds = [
            (Weighting::Fit, "best fit"),
            (Weighting::Smooth, "smooth"),
            (Weighting::Cells, "cells"),
        ];
        let mut weighting = look.lighting.weighting;
        choice_ui(ui, "Lamp weights", &kinds, &mut weighting).on_hover_text(
            "How the environment is split among the lamps. Best fit looks most like the environment, in dim light too; under a small sun, cells can come closer, but they jump as it turns.",
        );
        if weighting != look.lighting.weighting {
            out.push(relit(Lighting {
                weighting,
                ..look.lighting.clone()
            }));
        }
        ui.end_row();
    });
    animated_ui(ui, context, Group::Environment);
    tools_ui(ui, look.front().turned(look.yaw_deg));
    asks
}

/// The environment's intensity and colour.
fn grade_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    grid("grade").show(ui, |ui| {
        let settings = [Setting::Intensity, Setting::Temperature, Setting::Tint];
        for (row, setting) in GRADES.iter().zip(settings) {
            let field = row.ui(ui, &context.state.look.lighting, out, relit);
            beside_ui(ui, context, setting, field.rect, out);
            ui.end_row();
        }
    });
    animated_ui(ui, context, Group::Grade);
}

/// The rotation as other tools write it.
fn tools_ui(ui: &mut Ui, yaw_deg: f32) {
    egui::CollapsingHeader::new("Rotation in other apps")
        .id_salt("tools")
        .show(ui, |ui| {
            Grid::new("tools").num_columns(2).show(ui, |ui| {
                for tool in Tool::ALL {
                    ui.label(tool.title()).on_hover_text(tool.setting());
                    let value = format!("{:.1}°", tool.value_of_yaw(yaw_deg));
                    ui.label(RichText::new(value).color(theme::QUIET))
                        .on_hover_text(tool.setting());
                    ui.end_row();
                }
            });
        });
}

/// The lights placed by hand, and the button that adds one.
fn placed_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let lighting = &context.state.look.lighting;
    let chosen = context.state.chosen_light();
    let mut changed = lighting.clone();
    let mut chooses = chosen;
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let hint =
                "Adds a softbox to the environment. It stays in place when the environment is turned.";
            if icons::worded_ui(ui, icons::ADD, "Add light")
                .on_hover_text(hint)
                .clicked()
            {
                chooses = Some(changed.placed.len());
                changed.placed.push(changed.another_light());
            }
        });
    });
    if let Some(sentence) = solo_sentence(lighting) {
        ui.label(RichText::new(sentence).color(theme::ACCENT));
    }
    let mut removed = None;
    for (i, light) in changed.placed.iter_mut().enumerate() {
        let top = ui.cursor().top();
        ui.push_id(i, |ui| {
            if light_ui(ui, context, i, light, out) {
                removed = Some(i);
            }
        });
        if chosen == Some(i) {
            let left = ui.min_rect().left() - GAP;
            let bottom = ui.cursor().top() - ui.spacing().item_spacing.y;
            let bar = Rect::from_min_max(pos2(left, top), pos2(left + 3.0, bottom));
            ui.painter().rect_filled(bar, 0.0, theme::ACCENT);
        }
    }
    if let Some(removed) = removed {
        changed.placed.remove(removed);
        chooses = match chosen {
            Some(chosen) if chosen > removed => Some(chosen - 1),
            Some(chosen) if chosen == removed => None,
            other => other,
        };
    }
    if changed != *lighting {
        out.push(Command::Look(LookCommand::Lighting(Box::new(changed))));
    }
    if chooses != chosen {
        out.push(Command::View(ViewCommand::ChooseLight(chooses)));
    }
}

/// Which lights light the subject alone, if some do.
fn solo_sentence(lighting: &Lighting) -> Option<String> {
    let names = lighting.solo_titles();
    let (last, others) = names.split_last()?;
    Some(match others {
        [] => format!("Solo: only {last} lights the subject"),
        _ => format!(
            "Solo: only {} and {last} light the subject",
            others.join(", ")
        ),
    })
}

/// The field for a light's name, which is taken over when the field is left.
fn name_ui(ui: &mut Ui, index: usize, light: &mut PlacedLight, width: f32) {
    let id = Id::unique(("light name", index));
    let typed: Option<String> = ui.data(|data| data.get_temp(id));
    let mut text = typed.clone().unwrap_or_else(|| light.name.clone());
    let number = format!("Light {}", index + 1);
    let field = TextEdit::singleline(&mut text)
        .id(id)
        .hint_text(RichText::new(&number).color(theme::TEXT))
        .char_limit(MOST_LETTERS)
        .desired_width(width);
    let response = ui.add(field);
    let name = format!("Name of {}", light.title(index));
    response.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, &name));
    if response.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, text));
    } else if typed.is_some() {
        text.trim().clone_into(&mut light.name);
        ui.data_mut(|data| data.remove::<String>(id));
    }
}

/// One placed light, edited in place; returns whether it is to be removed.
fn light_ui(
    ui: &mut Ui,
    context: &PanelContext,
    index: usize,
    light: &mut PlacedLight,
    out: &mut Vec<Command>,
) -> bool {
    let mut removed = false;
    let id = light.id;
    let of = |setting| Setting::Light(id, setting);
    let title = light.title(index);
    ui.horizontal(|ui| {
        let on = ui.checkbox(&mut light.enabled, "");
        let is_on = light.enabled;
        on.widget_info(|| WidgetInfo::selected(Role::CheckBox, true, is_on, &title));
        on.on_hover_text("Turns the light on or off");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let name = format!("Remove light {}", index + 1);
            removed = icons::named_ui(ui, true, icons::alone(icons::REMOVE), &name)
                .on_hover_text(&name)
                .clicked();
            let color = if light.solo {
                theme::ACCENT
            } else {
                theme::TEXT
            };
            let solo = Button::selectable(light.solo, RichText::new("Solo").color(color));
            let solo = ui.add(solo.frame_when_inactive(true));
            let (name, is_solo) = (format!("Solo {title}"), light.solo);
            solo.widget_info(|| WidgetInfo::selected(Role::Button, true, is_solo, &name));
            let hint =
                "Only solo lights light the subject, without the environment; in exports too";
            if solo.on_hover_text(hint).clicked() {
                light.solo = !light.solo;
            }
            let width = ui.available_width() - GAP;
            name_ui(ui, index, light, width);
        });
    });
    ui.horizontal(|ui| {
        let kinds = [
            (placed::Kind::Area, "box"),
            (placed::Kind::Disc, "disc"),
            (placed::Kind::Point, "point"),
        ];
        let now = kinds.iter().find(|(kind, _)| *kind == light.kind);
        let list = egui::ComboBox::from_id_salt("kind")
            .selected_text(now.map_or("", |(_, name)| name))
            .width(0.5 * (ui.available_width() - ui.spacing().item_spacing.x))
            .show_ui(ui, |ui| {
                for (kind, name) in kinds {
                    ui.selectable_value(&mut light.kind, kind, name);
                }
            });
        let name = format!("Kind of {title}");
        (list.response).widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, &name));
        ui.color_edit_button_rgb(&mut light.color);
        let channels = [LightSetting::Red, LightSetting::Green, LightSetting::Blue];
        let color = format!("{title} colour");
        diamond::after_ui(ui, context, (&channels.map(of), &color), out);
    });
    let field = |value, speed: f32, range: RangeInclusive<f32>, prefix: &str| {
        DragValue::new(value)
            .speed(speed)
            .range(range)
            // Keys may lead an azimuth around several times.
            .clamp_existing_to_range(false)
            .prefix(prefix)
            .max_decimals(1)
    };
    let rows = [
        [
            (
                LightSetting::Yaw,
                field(&mut light.yaw_deg, 0.5, -180.0..=180.0, "azimuth "),
                "Azimuth in degrees: 0 is behind the subject, −90 camera left, 180 at the camera",
            ),
            (
                LightSetting::Pitch,
                field(&mut light.pitch_deg, 0.5, -90.0..=90.0, "elevation "),
                "Elevation in degrees",
            ),
        ],
        [
            (
                LightSetting::Radius,
                field(&mut light.radius_deg, 0.2, 0.0..=85.0, "radius "),
                "Radius in degrees, as seen from the subject",
            ),
            (
                LightSetting::Intensity,
                field(&mut light.intensity, 0.05, 0.0..=1e4, "intensity "),
                "At 3.14, a white surface that faces the light is rendered white",
            ),
        ],
    ];
    for row in rows {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0;
            let width = 0.5 * (ui.available_width() - 3.0 * 2.0) - diamond::WIDTH;
            for (setting, number, hint) in row {
                ui.add_sized(vec2(width, 22.0), number).on_hover_text(hint);
                let called = of(setting).title(&context.state.look.lighting);
                diamond::after_ui(ui, context, (&[of(setting)], &called), out);
            }
        });
    }
    removed
}
