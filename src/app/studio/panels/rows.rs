//! Rows of a panel's grid: a number, and a list of choices.

use super::bar_ui;
use super::numbers::{computing, turning};
use crate::command::Command;
use crate::look::within_a_turn;
use crate::theme::{self, GAP};
use egui::{Frame, Grid, Response, Ui};
use scene::Unit;
use std::ops::RangeInclusive;

/// Width of a row's name, and of its field, in points.
const NAME: f32 = 108.0;
/// Most letters of a name that is never cut, and most points of a longer one.
pub const MOST_LETTERS: usize = 20;
pub const MOST_NAME: f32 = 140.0;
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

/// One number of the settings `T`.
pub struct Row<T> {
    pub name: &'static str,
    pub of: fn(&mut T) -> &mut f32,
    /// Range of the number and of its bar.
    pub range: RangeInclusive<f32>,
    pub unit: Unit,
    /// Tooltip; empty if the name is enough.
    pub hint: &'static str,
}

impl<T> Row<T> {
    /// An angle in degrees.
    pub const fn degrees(
        name: &'static str,
        of: fn(&mut T) -> &mut f32,
        range: RangeInclusive<f32>,
        hint: &'static str,
    ) -> Self {
        Self { name, of, range, unit: Unit::Degrees, hint }
    }
}

impl<T: Clone + Default + PartialEq> Row<T> {
    /// Draws the row and returns the field's response. A change becomes a command with all settings; a
    /// double-click restores the default.
    pub fn ui(
        &self,
        ui: &mut Ui,
        settings: &T,
        out: &mut Vec<Command>,
        command: impl Fn(T) -> Command,
    ) -> Response {
        let mut changed = settings.clone();
        let value = *(self.of)(&mut changed);
        // A full circle has no ends: keys may turn the angle several times, and the bar shows it within a turn.
        let turns = self.range == (-180.0..=180.0);
        let in_unit = |value: f32| self.unit.shown(f64::from(value)) as f32;
        let before = in_unit(value);
        let mut shown = before;
        let (field, value) = if turns {
            (turning(&mut shown), within_a_turn(value))
        } else {
            let [least, most] = [self.range.start(), self.range.end()].map(|end| in_unit(*end));
            // A drag of 200 points covers a short range.
            let speed = self.unit.speed().min(f64::from(most - least) / 200.0);
            let field = computing(&mut shown)
                .range(least..=most)
                .clamp_existing_to_range(false)
                .fixed_decimals(self.unit.decimals())
                .suffix(self.unit.suffix());
            (field.speed(speed), value)
        };
        let reset = || {
            let mut restored = settings.clone();
            *(self.of)(&mut restored) = *(self.of)(&mut T::default());
            command(restored)
        };
        let field = (field, value, &self.range);
        let response = bar_ui(ui, self.name, field, BESIDE, out, reset);
        if shown != before {
            *(self.of)(&mut changed) = self.unit.of_shown(f64::from(shown)) as f32;
            out.push(command(changed));
        }
        if self.hint.is_empty() { response } else { response.on_hover_text(self.hint) }
    }
}

/// A list to choose one value from.
pub fn choice_ui<T: PartialEq + Clone>(
    ui: &mut Ui,
    name: &str,
    all: &[(T, &str)],
    value: &mut T,
) -> Response {
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
