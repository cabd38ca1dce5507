//! The picture: exposure, background, view transform and effects.

use crate::command::{Command, Dialog, LookCommand};
use crate::look::Group;
use crate::panel_context::PanelContext;
use crate::panels::widgets::diamond::{animated_ui, beside};
use crate::panels::widgets::group::Heading;
use crate::panels::widgets::rows::{BESIDE, FIELD, Number, choice_ui, grid, settings_ui};
use base::files::shown;
use egui::{Button, Role, Ui, UiBuilder, WidgetInfo, vec2};
use scene::{Background, BackgroundFile, Channel, EXPOSURE_STOPS, Inspection, Unit, ViewTransform};
use std::ops::RangeInclusive;

/// The panel has no state of its own.
#[derive(Default)]
pub struct PicturePanel;

impl PicturePanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        Heading::new(Group::Picture, context).ui(
            ui,
            out,
            |_, _| {},
            |ui, out| {
                grid("picture").show(ui, |ui| {
                    settings_ui(ui, context, Group::Picture, out);
                    background_ui(ui, &context.state.look.background, out);
                    curve_ui(ui, context, out);
                });
                animated_ui(ui, context, Group::Picture);
            },
        );
        Heading::new(Group::Effects, context).ui(
            ui,
            out,
            |_, _| {},
            |ui, out| {
                grid("effects").show(ui, |ui| settings_ui(ui, context, Group::Effects, out));
                animated_ui(ui, context, Group::Effects);
            },
        );
    }
}

/// Grey of a new colour behind the subject: middle grey.
const GREY: [u8; 3] = [118; 3];

/// Field of a number.
type Field = fn(&mut BackgroundFile) -> &mut f32;

/// Numbers of a still or movie behind the subject: name, unit, range, tooltip and field.
#[rustfmt::skip]
const PLACED: [(&str, Unit, RangeInclusive<f32>, &str, Field); 4] = [
    ("Offset right", Unit::Share, BackgroundFile::OFFSETS, "Percent of the picture's width", |placed| &mut placed.offset[0]),
    ("Offset up", Unit::Share, BackgroundFile::OFFSETS, "Percent of the picture's height", |placed| &mut placed.offset[1]),
    ("Scale", Unit::Times, BackgroundFile::SCALES, "1 just covers the picture", |placed| &mut placed.scale),
    ("File exposure", Unit::Stops, EXPOSURE_STOPS, "Exposure of the still or movie alone", |placed| &mut placed.exposure_stops),
];

/// File and placement of a still or movie behind the subject.
fn placed_ui(ui: &mut Ui, placed: &BackgroundFile, out: &mut Vec<Command>) {
    ui.label("File");
    let name = placed.file.file_name().unwrap_or(placed.file.as_os_str()).to_string_lossy();
    let hint = format!("{}: choose another. Numbered stills: type sky.%04d.exr", shown(&placed.file));
    let width = (ui.available_width() - BESIDE).max(FIELD);
    let button = Button::new(&*name).truncate().min_size(vec2(width, 0.0));
    let button = ui.scope(|ui| {
        ui.set_max_width(width);
        ui.add(button)
    });
    if button.inner.on_hover_text(hint).clicked() {
        out.push(Command::Dialog(Dialog::Background));
    }
    ui.end_row();
    for (name, unit, range, hint, field) in PLACED {
        let with = |value: f32| {
            let mut placed = placed.clone();
            *field(&mut placed) = value;
            Command::Look(LookCommand::Background(Background::File(placed)))
        };
        let reset = || with(*field(&mut BackgroundFile::default()));
        let number = Number { name, unit, range, hint };
        let (_, changed) = number.ui(ui, *field(&mut placed.clone()), out, reset);
        out.extend(changed.map(with));
        ui.end_row();
    }
}

fn background_ui(ui: &mut Ui, now: &Background, out: &mut Vec<Command>) {
    let color = if let Background::Color(color) = now { *color } else { GREY };
    let file = match now {
        Background::File(placed) => placed.clone(),
        _ => BackgroundFile::default(),
    };
    let kinds = [
        (Background::Environment, "Environment"),
        (Background::Plate, "Plate"),
        (Background::File(file), "Still or movie…"),
        (Background::Color(color), "Colour"),
        (Background::Checker, "Checker"),
        (Background::None, "None"),
    ];
    let mut background = now.clone();
    let list = choice_ui(ui, "Background", &kinds, &mut background);
    let list = list.on_hover_text("Behind the subject");
    if let Background::Color(color) = &mut background {
        let mut ui = ui.new_child(UiBuilder::new().max_rect(beside(list.rect)));
        ui.spacing_mut().interact_size.x = list.rect.height();
        let swatch = ui.color_edit_button_srgb(color);
        let name = "Colour of the background";
        swatch.widget_info(|| WidgetInfo::labeled(Role::ColorWell, true, name));
    }
    ui.end_row();
    if let Background::File(placed) = now {
        placed_ui(ui, placed, out);
    }
    if background != *now {
        out.push(match background.file() {
            Some(_) => Command::Dialog(Dialog::Background),
            None => Command::Look(LookCommand::Background(background)),
        });
    }
}

/// Channels and views of the picture: the setting, its name and its key.
pub const SHOWN: [(Inspection, &str, &str); 7] = [
    (Inspection::Picture, "Picture", "C"),
    (Inspection::Channel(Channel::Red), "Red", "R"),
    (Inspection::Channel(Channel::Green), "Green", "G"),
    (Inspection::Channel(Channel::Blue), "Blue", "B"),
    (Inspection::Channel(Channel::Luminance), "Luminance", "L"),
    (Inspection::Channel(Channel::Alpha), "Matte", "A"),
    (Inspection::FalseColor, "False colour", ""),
];

/// The tone curves, with their names.
pub const TONE_CURVES: [(ViewTransform, &str); 3] =
    [(ViewTransform::Srgb, "sRGB"), (ViewTransform::Filmic, "Filmic"), (ViewTransform::Aces, "ACES")];

/// The name of a tone curve.
pub fn curve_name(view: ViewTransform) -> &'static str {
    let curve = TONE_CURVES.iter().find(|(curve, _)| *curve == view);
    curve.map_or("", |(_, name)| name)
}

/// The tone curve, which converts light to display codes.
fn curve_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let effects = context.state.look.effects;
    let mut changed = effects;
    choice_ui(ui, "Tone curve", &TONE_CURVES, &mut changed.view)
        .on_hover_text("How light becomes display values; exported with it");
    ui.end_row();
    if changed != effects {
        out.push(Command::Look(LookCommand::Effects(changed)));
    }
}
