//! The picture: exposure, background, view transform and effects.

use crate::command::{Command, LookCommand};
use crate::look::Group;
use crate::panel_context::PanelContext;
use crate::panels::bar_ui;
use crate::panels::diamond::{animated_ui, beside_ui};
use crate::panels::group::Heading;
use crate::panels::numbers::computing;
use crate::panels::rows::{BESIDE, Row, choice_ui, grid};
use egui::Ui;
use scene::{
    Background, Channel, EXPOSURE_STOPS, Effects, Inspection, STRENGTHS, Setting, Strength,
    ViewTransform,
};

/// The panel has no state of its own.
#[derive(Default)]
pub struct PicturePanel;

impl PicturePanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        Heading::of(Group::Picture, context).ui(
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
        Heading::of(Group::Effects, context).ui(
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
    ui.label("Background");
    let mut shown = look.background == Background::Environment;
    if ui.checkbox(&mut shown, "Environment").changed() {
        out.push(Command::Look(LookCommand::Background(if shown {
            Background::Environment
        } else {
            Background::None
        })));
    }
    ui.end_row();
}

/// The row of an effect's strength; a drag of 200 points covers its range.
fn row(strength: &Strength) -> Row<Effects> {
    Row {
        name: strength.label,
        of: strength.of,
        range: 0.0..=strength.most,
        speed: strength.most / 200.0,
        decimals: if strength.most < 0.5 { 3 } else { 2 },
        suffix: "",
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
