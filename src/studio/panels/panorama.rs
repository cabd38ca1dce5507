//! The chosen panorama around the subject, with its brightest areas and the lights placed by hand.

use super::environments::panorama_ui;
use super::front;
use super::sphere::{place, share};
use crate::command::{Command, LookCommand, ViewCommand};
use crate::environment_library::{EnvironmentEntry, PanoramaState};
use crate::keys;
use crate::panel_context::PanelContext;
use crate::theme;
use egui::{
    Align2, Color32, EventFilter, FontId, Key, Painter, Pos2, Rect, Sense, Stroke, TextureHandle,
    TextureOptions, Ui, Vec2, pos2, vec2,
};
use glam::Quat;
use light::PlacedLight;
use light::brightest::Area;
use std::sync::Arc;
use worker::SrgbPicture;

/// Radius of a light's dot on the panorama in points.
const DOT: f32 = 6.0;
/// Degrees that an arrow key moves a light; with Shift ten times as many.
const STEP_DEG: f32 = 1.0;

/// Holds the texture of a panorama that is pitched or rolled.
#[derive(Default)]
pub struct Preview {
    turned: Option<Turned>,
}

struct Turned {
    of: Arc<SrgbPicture>,
    turn: Quat,
    texture: TextureHandle,
}

impl Preview {
    /// A drag turns the panorama or moves a light. While the person is `asked` which way is front, a click
    /// answers.
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, asked: bool, out: &mut Vec<Command>) {
        let look = &context.state.look;
        let width = ui.available_width();
        let sense = if asked {
            Sense::click_and_drag()
        } else {
            Sense::drag()
        };
        let (rect, response) = ui.allocate_exact_size(vec2(width, width / 2.0), sense);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Environment"));
        ui.painter().rect_filled(rect, 2.0, theme::WELL);
        let yaw_deg = look.front().turned(look.yaw_deg);
        let turn = look.lighting.turn(yaw_deg);
        let mut areas: &[Area] = &[];
        if let Some(entry) = context.environment() {
            if look.lighting.tilt() == Quat::IDENTITY {
                panorama_ui(ui, entry, rect, yaw_deg);
            } else {
                self.turned_ui(ui, entry, rect, turn);
            }
            if let PanoramaState::Done { panorama, .. } = &entry.panorama {
                areas = &panorama.areas;
            }
        }
        sides_ui(ui.painter(), rect);
        let dragged = response.drag_delta().x;
        if dragged != 0.0 {
            // The content follows the pointer.
            out.push(Command::Look(LookCommand::Turn(dragged / width * 360.0)));
        }
        let told = areas_ui(ui, context, rect, areas, turn);
        if asked {
            front::marks_ui(ui, context, rect, &response, turn, out);
        }
        let response = response.on_hover_cursor(egui::CursorIcon::ResizeHorizontal);
        if !told {
            response.on_hover_text(
                "The light around the subject; the camera looks at what is behind. Drag to turn.",
            );
        }
        let chosen = context.state.chosen_light();
        for (i, light) in look.lighting.placed.iter().enumerate() {
            let is = Standing {
                chosen: chosen == Some(i),
                shines: look.lighting.shines(light),
            };
            let (moved, chooses) = dot_ui(ui, rect, i, light, is);
            if chooses && !is.chosen {
                out.push(Command::View(ViewCommand::ChooseLight(Some(i))));
            }
            if let Some(moved) = moved {
                let mut lighting = look.lighting.clone();
                lighting.placed[i] = moved;
                out.push(Command::Look(LookCommand::Lighting(Box::new(lighting))));
            }
        }
    }

    /// The panorama under any rotation.
    fn turned_ui(&mut self, ui: &Ui, entry: &EnvironmentEntry, rect: Rect, turn: Quat) {
        let PanoramaState::Done { panorama, .. } = &entry.panorama else {
            return;
        };
        let of = &panorama.thumbnail;
        let is_this = |known: &Turned| known.turn == turn && Arc::ptr_eq(&known.of, of);
        let turned = match self.turned.take().filter(is_this) {
            Some(turned) => turned,
            None => {
                let small = of.turned(turn);
                let picture = egui::ColorImage::from_rgb([small.width, small.height], &small.rgb);
                Turned {
                    of: of.clone(),
                    turn,
                    texture: ui
                        .ctx()
                        .load_texture("turned", picture, TextureOptions::LINEAR),
                }
            }
        };
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        ui.painter()
            .image(turned.texture.id(), rect, whole, Color32::WHITE);
        self.turned = Some(turned);
    }
}

/// Where the panorama's columns are, as the camera sees it, with a tick above each word.
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
        painter.rect_filled(tick.expand(1.0), 0.0, Color32::from_black_alpha(150));
        painter.rect_filled(tick, 0.0, Color32::WHITE);
        let at = pos2(x + 4.0 * (1.0 - 2.0 * share), rect.bottom() - 5.0);
        let galley =
            painter.layout_no_wrap(word.into(), FontId::proportional(12.0), Color32::WHITE);
        let place = align.anchor_size(at, galley.size());
        painter.rect_filled(
            place.expand2(vec2(3.0, 0.0)),
            2.0,
            Color32::from_black_alpha(150),
        );
        painter.galley(place.min, galley, Color32::WHITE);
    }
}

/// The brightest areas, rotated with the panorama, with the share and the nearest lamp of each. Returns whether one of them, or
/// a light before it, is under the pointer.
fn areas_ui(ui: &Ui, context: &PanelContext, rect: Rect, areas: &[Area], turn: Quat) -> bool {
    let lights = context.state.look.lighting.placed.iter();
    let mut told = lights
        .map(|light| place(rect, light.direction()))
        .any(|at| ui.rect_contains_pointer(Rect::from_center_size(at, Vec2::splat(2.5 * DOT))));
    for (rank, area) in areas.iter().enumerate() {
        let at = place(rect, turn * area.direction);
        let rig = context.relit.map(|relit| &relit.rig);
        let lamp = rig.and_then(|rig| Some((rig, area.lamp(rig, turn)?)));
        let on = lamp.map_or(String::new(), |(rig, (lamp, off_deg))| {
            format!(
                ", nearest lamp {} ({off_deg:.0}° away)",
                rig.lamps[lamp].name
            )
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
        let response = ui.interact(spot, ui.scope_id().with(("area", rank)), Sense::hover());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &hint));
        if response.hovered() && !told {
            told = true;
            response.on_hover_text(&hint);
        }
    }
    told
}

/// How a placed light stands among the others.
#[derive(Clone, Copy)]
struct Standing {
    chosen: bool,
    /// It is on, and no other light is solo.
    shines: bool,
}

/// The dot of a placed light. Returns the light after a drag or an arrow key has moved it, and whether it was chosen.
fn dot_ui(
    ui: &Ui,
    rect: Rect,
    number: usize,
    light: &PlacedLight,
    is: Standing,
) -> (Option<PlacedLight>, bool) {
    let at = place(rect, light.direction());
    let spot = Rect::from_center_size(at, Vec2::splat(2.5 * DOT));
    let id = ui.scope_id().with(("light", number));
    let response = ui.interact(spot, id, Sense::click_and_drag());
    let name = format!("{} on the panorama", light.title(number));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, &name));
    let chooses = response.clicked() || response.drag_started();
    if chooses {
        response.request_focus();
    }
    let fill = if is.shines {
        theme::ACCENT
    } else {
        theme::QUIET
    };
    let edge = if response.has_focus() || is.chosen {
        Stroke::new(2.0, Color32::WHITE)
    } else {
        Stroke::new(1.5, Color32::BLACK)
    };
    ui.painter().circle(at, DOT, fill, edge);
    let dragged = response
        .interact_pointer_pos()
        .filter(|_| response.dragged())
        .map(|to| {
            let (u, v) = share(rect, to);
            (u * 360.0 - 180.0, 90.0 - v * 180.0)
        });
    let stepped = response.has_focus().then(|| arrows(ui, id)).flatten();
    response.on_hover_text(format!(
        "{name}: drag it, or click it and use the arrow keys (1°, with Shift 10°)"
    ));
    let stepped = stepped.map(|by| (light.yaw_deg + by.x, light.pitch_deg + by.y));
    let moved = dragged.or(stepped).map(|(yaw_deg, pitch_deg)| PlacedLight {
        // The azimuth wraps around, the elevation stops at the poles.
        yaw_deg: 180.0 - (180.0 - yaw_deg).rem_euclid(360.0),
        pitch_deg: pitch_deg.clamp(-90.0, 90.0),
        ..light.clone()
    });
    (moved, chooses)
}

/// Degrees to the right and up by which the arrow keys move the focused light.
fn arrows(ui: &Ui, id: egui::Id) -> Option<Vec2> {
    keys::leave_arrows(ui.ctx(), id);
    let all = EventFilter {
        horizontal_arrows: true,
        vertical_arrows: true,
        ..EventFilter::default()
    };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(id, all));
    let by = ui.input(|input| {
        let presses = |key| input.num_presses(key) as f32;
        let step = STEP_DEG * if input.modifiers.shift { 10.0 } else { 1.0 };
        step * vec2(
            presses(Key::ArrowRight) - presses(Key::ArrowLeft),
            presses(Key::ArrowUp) - presses(Key::ArrowDown),
        )
    });
    (by != Vec2::ZERO).then_some(by)
}
