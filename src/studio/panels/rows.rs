//! Rows of a panel's grid: a number among some settings, and one of a few.

use super::number_ui;
use crate::command::Command;
use egui::{DragValue, Response, Ui};
use std::ops::RangeInclusive;

/// Width of a row's field in points.
pub const FIELD: f32 = 100.0;

/// One number among settings `T`.
pub struct Row<T> {
    pub name: &'static str,
    pub of: fn(&mut T) -> &mut f32,
    pub range: RangeInclusive<f32>,
    /// What a point of a drag adds.
    pub speed: f32,
    pub decimals: usize,
    pub suffix: &'static str,
    /// What it does, where the name does not say it.
    pub hint: &'static str,
}

impl<T: Clone + Default + PartialEq> Row<T> {
    /// The row, and its field's response; a change becomes a command that has all the settings. A double-click
    /// brings the default.
    pub fn ui(
        &self,
        ui: &mut Ui,
        settings: &T,
        out: &mut Vec<Command>,
        command: impl Fn(T) -> Command,
    ) -> Response {
        let mut wanted = settings.clone();
        let field = DragValue::new((self.of)(&mut wanted))
            .speed(self.speed)
            .range(self.range.clone())
            .fixed_decimals(self.decimals)
            .suffix(self.suffix);
        let reset = || {
            let mut plain = settings.clone();
            *(self.of)(&mut plain) = *(self.of)(&mut T::default());
            command(plain)
        };
        let response = number_ui(ui, self.name, field, FIELD, out, reset);
        if wanted != *settings {
            out.push(command(wanted));
        }
        if self.hint.is_empty() {
            response
        } else {
            response.on_hover_text(self.hint)
        }
    }
}

/// One of a few.
pub fn choice_ui<T: PartialEq + Copy>(
    ui: &mut Ui,
    name: &str,
    all: &[(T, &str)],
    value: &mut T,
) -> Response {
    let label = ui.label(name);
    let now = all.iter().find(|(one, _)| one == value);
    let list = egui::ComboBox::from_id_salt(name)
        .selected_text(now.map_or("", |(_, name)| name))
        .width(FIELD)
        .truncate()
        // All of them at once.
        .height(400.0)
        .show_ui(ui, |ui| {
            for (one, name) in all {
                ui.selectable_value(value, *one, *name);
            }
        });
    list.response.labelled_by(label.id)
}
