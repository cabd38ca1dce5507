//! The picture: exposure, what is behind the subject, the view transform, and the effects.

use crate::scene::{Background, Channel, Effects, Inspection, ViewTransform};
use crate::studio::command::Command;
use crate::studio::panel::Sight;
use crate::studio::panels::number_ui;
use crate::studio::state::EXPOSURE_STOPS;
use crate::studio::theme::GAP;
use egui::{DragValue, Grid, Ui};

/// Width of a number's field in points.
const FIELD: f32 = 100.0;

/// The panel keeps nothing.
#[derive(Default)]
pub struct PicturePanel;

impl PicturePanel {
    pub fn ui(&mut self, ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
        ui.add_space(GAP);
        ui.horizontal(|ui| {
            ui.strong("Picture");
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                for (text, can, command) in [
                    ("Redo", sight.state.can_redo(), Command::Redo),
                    ("Undo", sight.state.can_undo(), Command::Undo),
                ] {
                    if ui.add_enabled(can, egui::Button::new(text)).clicked() {
                        out.push(command);
                    }
                }
            });
        });
        Grid::new("picture")
            .num_columns(2)
            .min_col_width(96.0)
            .show(ui, |ui| {
                exposure_ui(ui, sight, out);
                effects_ui(ui, sight, out);
            });
    }
}

fn exposure_ui(ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
    let look = &sight.state.look;
    let mut stops = look.exposure_stops;
    let field = DragValue::new(&mut stops)
        .speed(0.02)
        .range(EXPOSURE_STOPS)
        .fixed_decimals(2)
        .suffix(" stops");
    number_ui(ui, "Exposure", field, FIELD, out, || Command::Exposure(0.0));
    if stops != look.exposure_stops {
        out.push(Command::Exposure(stops));
    }
    ui.end_row();
    ui.label("Background");
    let mut shown = look.background == Background::Environment;
    if ui.checkbox(&mut shown, "environment").changed() {
        out.push(Command::Background(if shown {
            Background::Environment
        } else {
            Background::None
        }));
    }
    ui.end_row();
}

/// A strength among the effects.
struct Row {
    name: &'static str,
    of: fn(&mut Effects) -> &mut f32,
    most: f32,
    hint: &'static str,
}

const ROWS: [Row; 6] = [
    Row {
        name: "Defocus",
        of: |effects| &mut effects.background_blur,
        most: 0.25,
        hint: "Puts the background out of focus: radius as a share of the picture's height",
    },
    Row {
        name: "Light wrap",
        of: |effects| &mut effects.light_wrap,
        most: 1.0,
        hint: "Lets the background's light wrap around the subject's rim",
    },
    Row {
        name: "Despill",
        of: |effects| &mut effects.despill,
        most: 1.0,
        hint: "Takes the green or blue of a screen out of the subject's rim",
    },
    Row {
        name: "Glare",
        of: |effects| &mut effects.glare,
        most: 1.0,
        hint: "Scatters light above white as a lens does",
    },
    Row {
        name: "Grain",
        of: |effects| &mut effects.grain,
        most: 4.0,
        hint: "Gives the picture the plate's grain; 1 is as grainy",
    },
    Row {
        name: "Steadiness",
        of: |effects| &mut effects.smoothing,
        most: 1.0,
        hint: "Holds back jumps in brightness from frame to frame",
    },
];

fn effects_ui(ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
    let effects = sight.state.look.effects;
    let mut wanted = effects;
    let views = [
        (ViewTransform::Srgb, "sRGB"),
        (ViewTransform::Filmic, "filmic"),
        (ViewTransform::Aces, "ACES"),
    ];
    choice_ui(ui, "View", &views, &mut wanted.view);
    let shown = [
        (Inspection::Picture, "picture"),
        (Inspection::Channel(Channel::Red), "red"),
        (Inspection::Channel(Channel::Green), "green"),
        (Inspection::Channel(Channel::Blue), "blue"),
        (Inspection::Channel(Channel::Luminance), "luminance"),
        (Inspection::Channel(Channel::Alpha), "alpha"),
        (Inspection::FalseColor, "false colour"),
    ];
    choice_ui(ui, "Show", &shown, &mut wanted.inspection);
    for row in &ROWS {
        let field = DragValue::new((row.of)(&mut wanted))
            .speed(row.most / 200.0)
            .range(0.0..=row.most)
            .fixed_decimals(if row.most < 1.0 { 3 } else { 2 });
        let reset = || {
            let mut plain = effects;
            *(row.of)(&mut plain) = 0.0;
            Command::Effects(plain)
        };
        number_ui(ui, row.name, field, FIELD, out, reset).on_hover_text(row.hint);
        ui.end_row();
    }
    if wanted != effects {
        out.push(Command::Effects(wanted));
    }
}

/// One of a few, in a row of the grid.
fn choice_ui<T: PartialEq + Copy>(ui: &mut Ui, name: &str, all: &[(T, &str)], value: &mut T) {
    let label = ui.label(name);
    let now = all.iter().find(|(one, _)| one == value);
    let list = egui::ComboBox::from_id_salt(name)
        .selected_text(now.map_or("", |(_, name)| name))
        .width(FIELD)
        // All of them at once.
        .height(400.0)
        .show_ui(ui, |ui| {
            for (one, name) in all {
                ui.selectable_value(value, *one, *name);
            }
        });
    list.response.labelled_by(label.id);
    ui.end_row();
}
