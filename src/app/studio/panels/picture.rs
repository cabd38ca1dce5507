//! The picture: exposure, background, view transform and effects.

use crate::command::{Command, Dialog, LookCommand};
use crate::look::Group;
use crate::panel_context::PanelContext;
use crate::panels::bar_ui;
use crate::panels::diamond::{animated_ui, beside, beside_ui};
use crate::panels::group::Heading;
use crate::panels::numbers::computing;
use crate::panels::rows::{BESIDE, FIELD, Row, choice_ui, grid};
use base::files::shown;
use egui::{Button, Role, Ui, UiBuilder, WidgetInfo, vec2};
use scene::{
    Background, BackgroundFile, Channel, EXPOSURE_STOPS, Effects, Inspection, STRENGTHS, Setting,
    Strength, Unit, ViewTransform,
};

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
                    exposure_ui(ui, context, out);
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
                grid("effects").show(ui, |ui| effects_ui(ui, context, out));
                animated_ui(ui, context, Group::Effects);
            },
        );
    }
}

fn exposure_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let look = &context.state.look;
    let mut stops = look.exposure_stops;
    let field =
        computing(&mut stops).speed(0.02).range(EXPOSURE_STOPS).fixed_decimals(2).suffix(" stops");
    let field = (field, look.exposure_stops, &EXPOSURE_STOPS);
    let field =
        bar_ui(ui, "Exposure", field, BESIDE, out, || Command::Look(LookCommand::Exposure(0.0)));
    beside_ui(ui, context, Setting::Exposure, field.rect, out);
    if stops != look.exposure_stops {
        out.push(Command::Look(LookCommand::Exposure(stops)));
    }
    ui.end_row();
    background_ui(ui, &look.background, out);
}

/// Grey of a new colour behind the subject: middle grey.
const GREY: [u8; 3] = [118; 3];

/// Numbers of a still or movie behind the subject.
const PLACED: [Row<BackgroundFile>; 4] = [
    Row {
        name: "Offset right",
        of: |placed| &mut placed.offset[0],
        range: BackgroundFile::OFFSETS,
        unit: Unit::Share,
        hint: "Percent of the picture's width",
    },
    Row {
        name: "Offset up",
        of: |placed| &mut placed.offset[1],
        range: BackgroundFile::OFFSETS,
        unit: Unit::Share,
        hint: "Percent of the picture's height",
    },
    Row {
        name: "Scale",
        of: |placed| &mut placed.scale,
        range: BackgroundFile::SCALES,
        unit: Unit::Times,
        hint: "1 just covers the picture",
    },
    Row {
        name: "File exposure",
        of: |placed| &mut placed.exposure_stops,
        range: EXPOSURE_STOPS,
        unit: Unit::Stops,
        hint: "Exposure of the still or movie alone",
    },
];

/// File and placement of a still or movie behind the subject.
fn placed_ui(ui: &mut Ui, placed: &BackgroundFile, out: &mut Vec<Command>) {
    ui.label("File");
    let name = placed.file.file_name().unwrap_or(placed.file.as_os_str()).to_string_lossy();
    let hint =
        format!("{}: choose another. Numbered stills: type sky.%04d.exr", shown(&placed.file));
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
    for row in &PLACED {
        row.ui(ui, placed, out, |placed| {
            Command::Look(LookCommand::Background(Background::File(placed)))
        });
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

/// The row of an effect's strength.
fn row(strength: &Strength) -> Row<Effects> {
    Row {
        name: strength.label,
        of: strength.of,
        range: 0.0..=strength.most,
        unit: Setting::Effect(strength.pass).unit(),
        hint: strength.hint,
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
pub const TONE_CURVES: [(ViewTransform, &str); 3] = [
    (ViewTransform::Srgb, "sRGB"),
    (ViewTransform::Filmic, "Filmic"),
    (ViewTransform::Aces, "ACES"),
];

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

/// The strengths of the effects.
fn effects_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let effects = context.state.look.effects;
    for strength in STRENGTHS {
        let field = row(strength)
            .ui(ui, &effects, out, |wanted| Command::Look(LookCommand::Effects(wanted)));
        let setting = Setting::Effect(strength.pass);
        beside_ui(ui, context, setting, field.rect, out);
        ui.end_row();
    }
}
