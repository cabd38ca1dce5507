//! Rows of a panel's grid: a setting, another number, and a list of choices.

use super::diamond::beside_ui;
use super::numbers::{computing, is_reset, over_bar, turning};
use crate::command::{Command, LookCommand};
use crate::look::{Group, within_a_turn};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use base::numbers::ANGLES;
use egui::{DragValue, Frame, Grid, Rect, Response, Ui, vec2};
use light::Lighting;
use scene::{Setting, Unit};
use std::ops::RangeInclusive;

/// Width of a row's name, and of its field, in points.
const NAME: f32 = 108.0;
/// Most letters of a name that is never cut, and most points of a longer one.
const MOST_LETTERS: usize = 20;
const MOST_NAME: f32 = 140.0;
pub const FIELD: f32 = 100.0;
/// Space left free beside a bar: for the diamond that sets a key.
pub const BESIDE: f32 = 30.0;

/// A grid of rows.
pub fn grid(name: &str) -> Grid {
    Grid::new(name).num_columns(2).min_col_width(NAME).spacing([GAP, 4.0])
}

/// Choices side by side, as buttons in one track.
pub fn segments_ui<R>(ui: &mut Ui, choices: impl FnOnce(&mut Ui) -> R) -> R {
    let track = Frame::new().fill(theme::WELL).corner_radius(4);
    let shown = track.inner_margin(1).show(ui, |ui| {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 1.0;
            choices(ui)
        })
    });
    shown.inner.inner
}

/// A number with a range.
pub struct Number<'a> {
    pub name: &'a str,
    pub unit: Unit,
    /// Range of the number and of its bar.
    pub range: RangeInclusive<f32>,
    /// Tooltip; empty if the name is enough.
    pub hint: &'a str,
}

impl Number<'_> {
    /// The number of a setting.
    pub fn from_setting(setting: Setting) -> Self {
        Self { name: setting.label(), unit: setting.unit(), range: setting.range(), hint: setting.hint() }
    }

    /// Draws the number over its bar. Returns its rectangle, and the number if it was changed. A double-click sends
    /// the command `reset`.
    pub fn ui(
        &self,
        ui: &mut Ui,
        value: f32,
        out: &mut Vec<Command>,
        reset: impl FnOnce() -> Command,
    ) -> (Rect, Option<f32>) {
        let in_unit = |value: f32| self.unit.shown(f64::from(value)) as f32;
        let before = in_unit(value);
        let mut shown = before;
        let (field, value, range) = if self.range == ANGLES {
            // A full circle has no ends: keys may turn the angle several times, and the bar shows it within a turn.
            (turning(&mut shown), within_a_turn(value), -180.0..=180.0)
        } else {
            let range = match self.unit {
                // Lights of a file may be brighter.
                Unit::Energy => Lighting::STOPS,
                _ => in_unit(*self.range.start())..=in_unit(*self.range.end()),
            };
            // A drag of 200 points covers a short range.
            let speed = self.unit.speed().min(f64::from(range.end() - range.start()) / 200.0);
            let field = computing(&mut shown)
                .speed(speed)
                .range(range.clone())
                .clamp_existing_to_range(false)
                .fixed_decimals(self.unit.decimals())
                .suffix(self.unit.suffix());
            (field, before, range)
        };
        let mut response = bar_ui(ui, self.name, (field, value, &range), BESIDE, out, reset);
        if !self.hint.is_empty() {
            response = response.on_hover_text(self.hint);
        }
        let changed = (shown != before).then(|| self.unit.of_shown(f64::from(shown)) as f32);
        (response.rect, changed)
    }
}

/// The row of a setting: its number, and the diamond for its keys.
pub fn setting_ui(ui: &mut Ui, context: &PanelContext, (setting, name): (Setting, &str), out: &mut Vec<Command>) {
    let set = |value| Command::Look(LookCommand::Set(setting, value));
    let number = Number { name, ..Number::from_setting(setting) };
    let value = context.state.look.value(setting).unwrap_or_default();
    let (field, changed) = number.ui(ui, value, out, || set(setting.default_value()));
    out.extend(changed.map(set));
    beside_ui(ui, context, setting, field, out);
    ui.end_row();
}

/// The rows of the settings in a group.
pub fn settings_ui(ui: &mut Ui, context: &PanelContext, group: Group, out: &mut Vec<Command>) {
    let mut settings = Setting::all(&context.state.look.lighting);
    settings.retain(|setting| Group::from_setting(*setting) == group);
    for setting in settings {
        setting_ui(ui, context, (setting, setting.label()), out);
    }
}

/// A list to choose one value from.
pub fn choice_ui<T: PartialEq + Clone>(ui: &mut Ui, name: &str, all: &[(T, &str)], value: &mut T) -> Response {
    let label = ui.label(name);
    let now = all.iter().find(|(one, _)| one == value);
    let width = (ui.available_width() - BESIDE).max(FIELD);
    let list = egui::ComboBox::from_id_salt(name)
        .selected_text(now.map_or("", |(_, name)| name))
        .width(width)
        .truncate()
        // High enough to show all choices without scrolling.
        .height(400.0)
        .show_ui(ui, |ui| {
            for (one, name) in all {
                ui.selectable_value(value, one.clone(), *name);
            }
        });
    list.response.labelled_by(label.id)
}

/// A number to drag or type; a double-click resets it.
pub fn number_ui(
    ui: &mut Ui,
    name: &str,
    field: DragValue,
    width: f32,
    out: &mut Vec<Command>,
    reset: impl FnOnce() -> Command,
) -> Response {
    let label = ui.label(name);
    let response = ui.add_sized(vec2(width, 24.0), field).labelled_by(label.id);
    resettable_ui(ui, response, out, reset)
}

/// A number's row. Returns true if a double-click resets the number.
pub fn field_ui(ui: &mut Ui, name: &str, field: DragValue) -> bool {
    let label = ui.label(name);
    let field = ui.add_sized(vec2(84.0, 24.0), field).labelled_by(label.id);
    ui.end_row();
    is_reset(ui, &field)
}

/// As [`number_ui`], with a bar behind it that shows `value` within `range`. Leaves `beside` points of the width free.
fn bar_ui(
    ui: &mut Ui,
    name: &str,
    (field, value, range): (DragValue, f32, &RangeInclusive<f32>),
    beside: f32,
    out: &mut Vec<Command>,
    reset: impl FnOnce() -> Command,
) -> Response {
    let label = if name.chars().count() > MOST_LETTERS {
        // A name given by a person: cut to the room.
        let text = egui::Label::new(name).truncate();
        let narrow = |ui: &mut Ui| {
            ui.set_max_width(MOST_NAME);
            ui.add(text)
        };
        ui.scope(narrow).inner
    } else {
        ui.label(name)
    };
    let width = (ui.available_width() - beside).max(FIELD);
    let response = over_bar(ui, range, value, |ui| ui.add_sized(vec2(width, 22.0), field).labelled_by(label.id));
    resettable_ui(ui, response, out, reset)
}

fn resettable_ui(ui: &Ui, response: Response, out: &mut Vec<Command>, reset: impl FnOnce() -> Command) -> Response {
    if is_reset(ui, &response) {
        out.push(reset());
    }
    theme::hint_at_rest_ui(
        response,
        "Drag, or click to type: 10, +10 or /2. Hold Shift for fine steps; double-click to reset.",
    )
}
