//! The current panorama, unrolled or on a mirror ball, with its brightest areas and the lights placed by hand.

use super::front;
use super::handle::{Seen, handle_ui};
use super::light_map::LightMap;
use crate::command::{Command, LookCommand};
use crate::panel_context::PanelContext;
use crate::panels::environments::library::{EnvironmentEntry, PanoramaState};
use crate::panels::environments::panorama_ui;
use crate::panels::lamp_title;
use crate::panels::widgets::rows::segments_ui;
use crate::theme;
use egui::epaint::RectShape;
use egui::{
    Align2, Color32, FontId, Painter, Pos2, Rect, Sense, Stroke, TextureHandle, TextureOptions, Ui, Vec2, pos2, vec2,
};
use glam::Quat;
use light::PlacedLight;
use light::brightest::Area;
use std::sync::Arc;
use worker::SrgbPicture;

/// Radius of a light's dot on the panorama in points.
const DOT: f32 = 6.0;
/// Height of the panorama over its width. Stretched vertically, so that elevations are easier to read and set.
const STRETCHED: f32 = 0.77;
/// Pixels across the mirror ball's picture.
const BALL: usize = 224;

/// Holds the texture of a panorama that is pitched or rolled, or of the mirror ball.
#[derive(Default)]
pub struct Preview {
    turned: Option<Turned>,
    /// The mirror ball is shown.
    is_ball: bool,
}

struct Turned {
    of: Arc<SrgbPicture>,
    turn: Quat,
    is_ball: bool,
    texture: TextureHandle,
}

impl Preview {
    /// The choice between panorama and mirror ball.
    pub fn choice_ui(&mut self, ui: &mut Ui) {
        segments_ui(ui, |ui| {
            for (is_ball, name, hint) in [
                (false, "Panorama", "All around the subject, unrolled"),
                (true, "Sphere", "As the camera sees it in a mirror ball in the subject's place"),
            ] {
                ui.selectable_value(&mut self.is_ball, is_ball, name).on_hover_text(hint);
            }
        });
    }

    /// A drag turns the panorama or moves a light. While the front is `asked` for, a click sets it.
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, asked: bool, out: &mut Vec<Command>) {
        let look = &context.state.look;
        let width = ui.available_width();
        let sense = if asked { Sense::click_and_drag() } else { Sense::drag() };
        let (rect, response) = ui.allocate_exact_size(vec2(width, STRETCHED * width), sense);
        // The front is picked on the panorama, not on the ball.
        let map = if self.is_ball && !asked { LightMap::Sphere(rect.shrink(DOT)) } else { LightMap::Panorama(rect) };
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Environment map"));
        ui.painter().rect_filled(rect, 2.0, theme::WELL);
        let yaw_deg = look.front().turned(look.yaw_deg);
        let turn = look.lighting.turn(yaw_deg);
        let mut areas: &[Area] = &[];
        if let Some(entry) = context.environment() {
            let is_ball = matches!(map, LightMap::Sphere(_));
            if look.lighting.tilt() == Quat::IDENTITY && !is_ball {
                panorama_ui(ui, entry, rect, yaw_deg);
            } else {
                self.turned_ui(ui, entry, map, turn);
            }
            if let PanoramaState::Done { panorama, .. } = &entry.panorama {
                areas = &panorama.areas;
            }
        }
        match map {
            LightMap::Panorama(rect) => sides_ui(ui.painter(), rect),
            LightMap::Sphere(_) => ball_ui(ui.painter(), map.rect()),
        }
        let dragged = response.drag_delta().x;
        if dragged != 0.0 {
            // The content follows the pointer.
            out.push(Command::Look(LookCommand::Turn(dragged / width * 360.0)));
        }
        let told = areas_ui(ui, context, map, areas, turn);
        if asked {
            front::marks_ui(ui, context, rect, &response, turn, out);
        }
        let response = response.on_hover_cursor(egui::CursorIcon::ResizeHorizontal);
        if !told {
            let hint = "The light around the subject; the centre is behind, as the camera sees it. Drag to turn.";
            theme::hint_at_rest_ui(response, hint);
        }
        let chosen = context.state.chosen_light();
        for (i, light) in look.lighting.placed.iter().enumerate() {
            let is = Standing { chosen: chosen == Some(i), shines: look.lighting.shines(light) };
            dot_ui(ui, context, map, (i, light), is, out);
        }
    }

    /// The panorama under any rotation, or the mirror ball.
    fn turned_ui(&mut self, ui: &Ui, entry: &EnvironmentEntry, map: LightMap, turn: Quat) {
        let is_ball = matches!(map, LightMap::Sphere(_));
        let PanoramaState::Done { panorama, .. } = &entry.panorama else { return };
        let thumbnail = &panorama.thumbnail;
        let is_this =
            |known: &Turned| (known.turn, known.is_ball) == (turn, is_ball) && Arc::ptr_eq(&known.of, thumbnail);
        let turned = match self.turned.take().filter(is_this) {
            Some(turned) => turned,
            None => {
                let small = if is_ball { thumbnail.mirror_ball(turn, BALL) } else { thumbnail.turned(turn) };
                let picture = egui::ColorImage::from_rgb([small.width, small.height], &small.rgb);
                Turned {
                    of: thumbnail.clone(),
                    turn,
                    is_ball,
                    texture: ui.ctx().load_texture("turned", picture, TextureOptions::LINEAR),
                }
            }
        };
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        if is_ball {
            let ball = RectShape::filled(map.rect(), 0.5 * map.rect().width(), Color32::WHITE);
            ui.painter().add(ball.with_texture(turned.texture.id(), whole));
        } else {
            let rect = map.rect();
            ui.painter().image(turned.texture.id(), rect, whole, Color32::WHITE);
        }
        self.turned = Some(turned);
    }
}

/// Directions along the panorama, as the camera sees them: a word and a tick each.
fn sides_ui(painter: &Painter, rect: Rect) {
    let painter = painter.with_clip_rect(rect);
    for (share, word, align) in [
        (0.0, "camera", Align2::LEFT_BOTTOM),
        (0.25, "left", Align2::CENTER_BOTTOM),
        (0.5, "behind", Align2::CENTER_BOTTOM),
        (0.75, "right", Align2::CENTER_BOTTOM),
        (1.0, "camera", Align2::RIGHT_BOTTOM),
    ] {
        let x = rect.left() + share * rect.width();
        let tick = Rect::from_center_size(pos2(x, rect.bottom()), vec2(1.5, 8.0));
        painter.rect_filled(tick.expand(1.0), 0.0, theme::OVER_PICTURE);
        painter.rect_filled(tick, 0.0, Color32::WHITE);
        let at = pos2(x + 4.0 * (1.0 - 2.0 * share), rect.bottom() - 5.0);
        let galley = painter.layout_no_wrap(word.into(), FontId::proportional(12.0), Color32::WHITE);
        let place = align.anchor_size(at, galley.size());
        painter.rect_filled(place.expand2(vec2(3.0, 0.0)), 2.0, theme::OVER_PICTURE);
        painter.galley(place.min, galley, Color32::WHITE);
    }
}

/// The rim of the mirror ball, with its left and right labelled.
fn ball_ui(painter: &Painter, rect: Rect) {
    painter.circle_stroke(rect.center(), 0.5 * rect.width(), Stroke::new(1.0, theme::QUIET));
    for (x, word, align) in
        [(rect.left() + 6.0, "left", Align2::LEFT_CENTER), (rect.right() - 6.0, "right", Align2::RIGHT_CENTER)]
    {
        let font = FontId::proportional(12.0);
        let galley = painter.layout_no_wrap(word.into(), font, Color32::WHITE);
        let place = align.anchor_size(pos2(x, rect.center().y), galley.size());
        painter.rect_filled(place.expand2(vec2(3.0, 0.0)), 2.0, theme::OVER_PICTURE);
        painter.galley(place.min, galley, Color32::WHITE);
    }
}

/// The brightest areas, rotated with the panorama, with the share and the nearest lamp of each. Returns true if one of
/// them, or a light in front of them, is under the pointer.
fn areas_ui(ui: &Ui, context: &PanelContext, map: LightMap, areas: &[Area], turn: Quat) -> bool {
    let rect = map.rect();
    let lights = context.state.look.lighting.placed.iter();
    let mut told = lights
        .map(|light| map.place(light.direction()))
        .any(|at| ui.rect_contains_pointer(Rect::from_center_size(at, Vec2::splat(2.5 * DOT))));
    for (rank, area) in areas.iter().enumerate() {
        let at = map.place(turn * area.direction);
        let rig = context.relit().map(|relit| &relit.rig);
        let lamp = rig.and_then(|rig| Some((rig, area.lamp(rig, turn)?)));
        let on = lamp.map_or(String::new(), |(rig, (lamp, off_deg))| {
            format!(", nearest lamp: {} ({off_deg:.0}° away)", lamp_title(&rig.lamps[lamp].name))
        });
        let hint = format!(
            "Brightest area {} of {}: {:.0} % of the light, {:.1}° across{on}",
            rank + 1,
            areas.len(),
            100.0 * area.share,
            2.0 * area.radius_deg()
        );
        let spot = Rect::from_center_size(at, Vec2::splat(2.0 * DOT)).intersect(rect);
        ui.painter().circle_stroke(at, DOT - 1.5, Stroke::new(2.5, Color32::BLACK));
        ui.painter().circle_stroke(at, DOT - 1.5, Stroke::new(1.0, Color32::WHITE));
        let response = ui.interact(spot, ui.scope_id().with(("area", rank)), Sense::hover());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &hint));
        if response.hovered() && !told {
            told = true;
            response.on_hover_text(&hint);
        }
    }
    told
}

/// State of a placed light.
#[derive(Clone, Copy)]
struct Standing {
    chosen: bool,
    /// The light is on, and no other light is solo.
    shines: bool,
}

/// The draggable handle of a placed light.
fn dot_ui(
    ui: &Ui,
    context: &PanelContext,
    map: LightMap,
    (index, light): (usize, &PlacedLight),
    is: Standing,
    out: &mut Vec<Command>,
) {
    let at = map.place(light.direction());
    let spot = Rect::from_center_size(at, Vec2::splat(2.5 * DOT));
    let id = ui.scope_id().with(("light", light.id));
    let response = ui.interact(spot, id, Sense::click_and_drag());
    let name = format!("{} on the {}", light.title(index), map.name());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, &name));
    let seen = match map {
        LightMap::Panorama(_) => Seen::Unrolled,
        LightMap::Sphere(_) => Seen::ByCamera,
    };
    handle_ui(ui, context, &response, (index, light), seen, out);
    if let Some(to) = response.interact_pointer_pos()
        && response.dragged()
    {
        let there = light.clone().towards(map.direction(to));
        if there != *light {
            let mut lighting = context.state.look.lighting.clone();
            lighting.placed[index] = there;
            out.push(Command::Look(LookCommand::Lighting(Box::new(lighting))));
        }
    }
    let fill = match (is.shines, is.chosen) {
        (true, true) => theme::ACCENT,
        (true, false) => theme::TEXT,
        (false, _) => theme::QUIET,
    };
    let edge = if response.has_focus() || is.chosen {
        Stroke::new(2.0, Color32::WHITE)
    } else {
        Stroke::new(1.5, Color32::BLACK)
    };
    ui.painter().circle(at, DOT, fill, edge);
    let hint = format!("{name}: drag it, or click it and use the arrow keys (1°, with Shift 10°). Delete removes it.");
    theme::hint_at_rest_ui(response, hint);
}
