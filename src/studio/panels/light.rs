//! The light: how the environment is turned and graded, its brightest areas, and the lights placed by hand.

use crate::light::brightest::Area;
use crate::light::weights::{Weighting, rotation};
use crate::light::{Lighting, PlacedLight, conventions, latlong, placed, white};
use crate::studio::command::Command;
use crate::studio::panel::{Reading, Sight};
use crate::studio::panels::environments::panorama_ui;
use crate::studio::panels::number_ui;
use crate::studio::theme::{self, GAP};
use egui::{Color32, DragValue, Grid, Pos2, Rect, RichText, Sense, Stroke, Ui, Vec2, pos2, vec2};
use std::ops::RangeInclusive;

/// Width of a number's field in points.
const FIELD: f32 = 100.0;
/// Radius of a light's dot on the panorama in points.
const DOT: f32 = 6.0;

/// The panel keeps nothing.
#[derive(Default)]
pub struct LightPanel;

impl LightPanel {
    pub fn ui(&mut self, ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
        preview_ui(ui, sight, out);
        ui.add_space(GAP);
        turn_ui(ui, sight, out);
        placed_ui(ui, &sight.state.look.lighting, out);
    }
}

/// The chosen panorama as the subject sees it; dragging it turns it, dragging a light moves that.
fn preview_ui(ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
    let look = &sight.state.look;
    let width = ui.available_width();
    let (rect, response) = ui.allocate_exact_size(vec2(width, width / 2.0), Sense::drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Environment"));
    ui.painter().rect_filled(rect, 2.0, theme::WELL);
    let mut areas: &[Area] = &[];
    if let Some(entry) = sight.environment() {
        panorama_ui(ui, entry, rect, look.yaw_deg);
        if let Reading::Done { panorama, .. } = &entry.panorama {
            areas = &panorama.areas;
        }
    }
    // What is behind the subject: between these ticks, the column that the camera looks at.
    let tick = Stroke::new(2.0, theme::ACCENT);
    ui.painter()
        .vline(rect.center().x, rect.top()..=rect.top() + 8.0, tick);
    ui.painter()
        .vline(rect.center().x, rect.bottom() - 8.0..=rect.bottom(), tick);
    if response.dragged() {
        // The content follows the hand.
        out.push(Command::Turn(response.drag_delta().x / width * 360.0));
    }
    response
        .on_hover_cursor(egui::CursorIcon::ResizeHorizontal)
        .on_hover_text(
            "What lights the subject. The ticks mark what is behind the subject; drag to turn it.",
        );
    areas_ui(ui, sight, rect, areas);
    for (i, light) in look.lighting.placed.iter().enumerate() {
        if let Some(moved) = dot_ui(ui, rect, i, light) {
            let mut lighting = look.lighting.clone();
            lighting.placed[i] = moved;
            out.push(Command::Lighting(Box::new(lighting)));
        }
    }
}

/// The brightest areas where the yaw brings them, with what each gives to which lamp.
fn areas_ui(ui: &mut Ui, sight: &Sight, rect: Rect, areas: &[Area]) {
    let turn = rotation(sight.state.look.yaw_deg, 0.0, 0.0);
    for (rank, area) in areas.iter().enumerate() {
        let at = place(rect, turn * area.direction);
        let rig = sight.relit.map(|relit| &relit.rig);
        let lamp = rig.and_then(|rig| Some((rig, area.lamp(rig, sight.state.look.yaw_deg)?)));
        let on = lamp.map_or(String::new(), |(rig, (lamp, off_deg))| {
            format!(", falls on {}, {off_deg:.0}° from it", rig.lamps[lamp].name)
        });
        let hint = format!(
            "Brightest area {} of {}: {:.0} % of the light, {:.1}° across{on}",
            rank + 1,
            areas.len(),
            100.0 * area.share,
            2.0 * area.radius_deg()
        );
        let spot = Rect::from_center_size(at, Vec2::splat(2.0 * DOT)).intersect(rect);
        ui.painter()
            .circle_stroke(at, DOT - 1.5, Stroke::new(2.5, Color32::BLACK));
        ui.painter()
            .circle_stroke(at, DOT - 1.5, Stroke::new(1.0, Color32::WHITE));
        ui.interact(spot, ui.scope_id().with(("area", rank)), Sense::hover())
            .on_hover_text(hint);
    }
}

/// A placed light's dot; the light where it was dragged to.
fn dot_ui(ui: &mut Ui, rect: Rect, number: usize, light: &PlacedLight) -> Option<PlacedLight> {
    let at = place(rect, light.direction());
    let spot = Rect::from_center_size(at, Vec2::splat(2.5 * DOT));
    let response = ui.interact(spot, ui.scope_id().with(("light", number)), Sense::drag());
    let name = format!("Light {} on the panorama", number + 1);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, &name));
    let fill = if light.enabled {
        theme::ACCENT
    } else {
        theme::QUIET
    };
    ui.painter()
        .circle(at, DOT, fill, Stroke::new(1.5, Color32::BLACK));
    let moved = response
        .interact_pointer_pos()
        .filter(|_| response.dragged());
    response.on_hover_text(format!("{name}: drag it to where it should stand"));
    moved.map(|to| PlacedLight {
        yaw_deg: ((to.x - rect.left()) / rect.width()).clamp(0.0, 1.0) * 360.0 - 180.0,
        pitch_deg: 90.0 - ((to.y - rect.top()) / rect.height()).clamp(0.0, 1.0) * 180.0,
        ..light.clone()
    })
}

/// Where a direction is on the panorama.
fn place(rect: Rect, direction: glam::Vec3) -> Pos2 {
    let (u, v) = latlong::uv_from_direction(direction);
    pos2(
        rect.left() + u.rem_euclid(1.0) * rect.width(),
        rect.top() + v * rect.height(),
    )
}

/// One number of the lighting.
struct Row {
    name: &'static str,
    of: fn(&mut Lighting) -> &mut f32,
    speed: f32,
    range: RangeInclusive<f32>,
    decimals: usize,
    suffix: &'static str,
}

const ROWS: [Row; 6] = [
    Row {
        name: "Pitch",
        of: |lighting| &mut lighting.pitch_deg,
        speed: 0.5,
        range: -180.0..=180.0,
        decimals: 1,
        suffix: "°",
    },
    Row {
        name: "Roll",
        of: |lighting| &mut lighting.roll_deg,
        speed: 0.5,
        range: -180.0..=180.0,
        decimals: 1,
        suffix: "°",
    },
    Row {
        name: "Intensity",
        of: |lighting| &mut lighting.intensity_stops,
        speed: 0.02,
        range: Lighting::STOPS,
        decimals: 2,
        suffix: " stops",
    },
    Row {
        name: "Temperature",
        of: |lighting| &mut lighting.temperature_k,
        speed: 20.0,
        range: white::RANGE_K,
        decimals: 0,
        suffix: " K",
    },
    Row {
        name: "Tint",
        of: |lighting| &mut lighting.tint,
        speed: 0.5,
        range: -150.0..=150.0,
        decimals: 0,
        suffix: "",
    },
    Row {
        name: "Backdrop yaw",
        of: |lighting| &mut lighting.background_yaw_deg,
        speed: 0.5,
        range: -180.0..=180.0,
        decimals: 1,
        suffix: "°",
    },
];

fn turn_ui(ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
    let look = &sight.state.look;
    Grid::new("light")
        .num_columns(2)
        .min_col_width(96.0)
        .show(ui, |ui| {
            let mut yaw = look.yaw_deg;
            let field = DragValue::new(&mut yaw)
                .speed(0.5)
                .fixed_decimals(1)
                .suffix("°");
            number_ui(ui, "Yaw", field, FIELD, out, || Command::Yaw(0.0))
                .on_hover_text(conventions::sentence(look.yaw_deg));
            if yaw != look.yaw_deg {
                out.push(Command::Yaw(yaw));
            }
            ui.end_row();
            for row in &ROWS {
                let mut wanted = look.lighting.clone();
                let field = DragValue::new((row.of)(&mut wanted))
                    .speed(row.speed)
                    .range(row.range.clone())
                    .fixed_decimals(row.decimals)
                    .suffix(row.suffix);
                let reset = || {
                    let mut plain = look.lighting.clone();
                    *(row.of)(&mut plain) = *(row.of)(&mut Lighting::default());
                    Command::Lighting(Box::new(plain))
                };
                number_ui(ui, row.name, field, FIELD, out, reset);
                if wanted != look.lighting {
                    out.push(Command::Lighting(Box::new(wanted)));
                }
                ui.end_row();
            }
            weighting_ui(ui, &look.lighting, out);
            ui.end_row();
        });
}

/// How the environment is given to the lamps.
fn weighting_ui(ui: &mut Ui, lighting: &Lighting, out: &mut Vec<Command>) {
    let name = |weighting| match weighting {
        Weighting::Fit => "best fit",
        Weighting::Soft => "soft cells",
        Weighting::Smooth => "smooth",
        Weighting::Cells => "cells",
    };
    let label = ui.label("Lamps by");
    let list = egui::ComboBox::from_id_salt("weights")
        .selected_text(name(lighting.weighting))
        .width(FIELD)
        .show_ui(ui, |ui| {
            for kind in [
                Weighting::Fit,
                Weighting::Soft,
                Weighting::Smooth,
                Weighting::Cells,
            ] {
                let chosen = kind == lighting.weighting;
                if ui.selectable_label(chosen, name(kind)).clicked() && !chosen {
                    out.push(Command::Lighting(Box::new(Lighting {
                        weighting: kind,
                        ..lighting.clone()
                    })));
                }
            }
        });
    list.response.labelled_by(label.id).on_hover_text(
        "How the environment is given to the lamps. Best fit is nearest to the truth.",
    );
}

/// The lights placed by hand, and a way to add one.
fn placed_ui(ui: &mut Ui, lighting: &Lighting, out: &mut Vec<Command>) {
    ui.add_space(GAP);
    let mut wanted = lighting.clone();
    ui.horizontal(|ui| {
        ui.strong("Lights");
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let hint =
                "Adds a softbox beside the environment. It stays where it stands when that turns.";
            if ui.button("Add light").on_hover_text(hint).clicked() {
                wanted.placed.push(PlacedLight::default());
            }
        });
    });
    let mut removed = None;
    for (i, light) in wanted.placed.iter_mut().enumerate() {
        ui.push_id(i, |ui| {
            ui.horizontal(|ui| {
                ui.checkbox(
                    &mut light.enabled,
                    RichText::new(format!("Light {}", i + 1)),
                );
                ui.color_edit_button_rgb(&mut light.color);
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if ui.small_button("Remove").clicked() {
                        removed = Some(i);
                    }
                    let kinds = [
                        (placed::Kind::Area, "box"),
                        (placed::Kind::Disc, "disc"),
                        (placed::Kind::Point, "point"),
                    ];
                    let now = kinds.iter().find(|(kind, _)| *kind == light.kind);
                    egui::ComboBox::from_id_salt("kind")
                        .selected_text(now.map_or("", |(_, name)| name))
                        .width(56.0)
                        .show_ui(ui, |ui| {
                            for (kind, name) in kinds {
                                ui.selectable_value(&mut light.kind, kind, name);
                            }
                        });
                });
            });
            let field = |value, speed: f32, range: RangeInclusive<f32>, prefix: &str| {
                DragValue::new(value)
                    .speed(speed)
                    .range(range)
                    .prefix(prefix)
                    .max_decimals(1)
            };
            let rows = [
                [
                    (
                        field(&mut light.yaw_deg, 0.5, -180.0..=180.0, "azimuth "),
                        "Azimuth in degrees: −90 is camera-left, 180 the camera",
                    ),
                    (
                        field(&mut light.pitch_deg, 0.5, -90.0..=90.0, "elevation "),
                        "Elevation in degrees",
                    ),
                ],
                [
                    (
                        field(&mut light.radius_deg, 0.2, 0.0..=85.0, "radius "),
                        "Radius in degrees, as the subject sees it",
                    ),
                    (
                        field(&mut light.intensity, 0.05, 0.0..=1e4, "intensity "),
                        "3.14 lights white that faces it to white",
                    ),
                ],
            ];
            for row in rows {
                ui.horizontal(|ui| {
                    let width = 0.5 * (ui.available_width() - ui.spacing().item_spacing.x);
                    for (number, hint) in row {
                        ui.add_sized(vec2(width, 22.0), number).on_hover_text(hint);
                    }
                });
            }
        });
    }
    if let Some(removed) = removed {
        wanted.placed.remove(removed);
    }
    if wanted != *lighting {
        out.push(Command::Lighting(Box::new(wanted)));
    }
}
