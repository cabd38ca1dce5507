//! A compass over the picture that turns the environment: a view from above, with the camera at the bottom.

use crate::command::{Command, LookCommand};
use crate::look::within_a_turn;
use crate::panel_context::PanelContext;
use crate::panels::environments::library::PanoramaState;
use crate::theme::{self, GAP};
use egui::{Color32, CursorIcon, FontId, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, vec2};
use scene::Setting;

/// Radius of the ring in points.
const RADIUS: f32 = 34.0;
/// Radius of the head in the middle.
const HEAD: f32 = 9.0;

/// The compass in the lower right corner. A drag around it turns the environment by the angle that the pointer moves
/// around the centre; a click moves the dot there.
pub fn gizmo_ui(ui: &Ui, rect: Rect, context: &PanelContext, out: &mut Vec<Command>) {
    let Some(PanoramaState::Done { .. }) = context.environment().map(|entry| &entry.panorama) else { return };
    let center = rect.right_bottom() - Vec2::splat(RADIUS + 2.5 * GAP);
    let area = Rect::from_center_size(center, Vec2::splat(2.0 * RADIUS + 2.0 * GAP));
    // Over a small picture it would hide the subject.
    if area.width() * 5.0 > rect.width().min(rect.height() * 1.5) {
        return;
    }
    let response = ui.interact(area, ui.scope_id().with("compass"), Sense::click_and_drag());
    // A yaw of more than one turn keeps its turns for its keys.
    let yaw = within_a_turn(context.state.look.yaw_deg);
    response.widget_info(|| egui::WidgetInfo::slider(true, f64::from(yaw), "Compass"));
    let lively = response.hovered() || response.dragged();
    let painter = ui.painter().with_clip_rect(rect);
    painter.circle_filled(center, RADIUS + GAP, theme::OVER_PICTURE);
    let ring = if lively { theme::TEXT } else { theme::QUIET };
    painter.circle_stroke(center, RADIUS, Stroke::new(1.5, ring));
    face_ui(&painter, center, ring);
    camera_ui(&painter, center + vec2(0.0, RADIUS), ring);
    painter.circle_filled(on_ring(center, yaw), 6.0, theme::ACCENT);
    let font = FontId::proportional(12.0);
    let text = format!("{yaw:.0}°");
    let above = center - vec2(0.0, 0.5 * (RADIUS + HEAD));
    painter.text(above, egui::Align2::CENTER_CENTER, text, font, theme::TEXT);
    if lively {
        ui.ctx().set_cursor_icon(CursorIcon::Grab);
    }
    if let Some(at) = response.interact_pointer_pos() {
        let origin = ui.input(|i| i.pointer.press_origin());
        let from = match origin.filter(|_| response.drag_started()) {
            Some(origin) => origin,
            None => at - response.drag_delta(),
        };
        let turn = match response.dragged() {
            true => turned(from - center, at - center),
            false if response.clicked() => within_a_turn(angle(at - center) - yaw),
            false => 0.0,
        };
        if response.double_clicked() {
            out.push(Command::Look(LookCommand::Set(Setting::Yaw, 0.0)));
        } else if turn != 0.0 {
            out.push(Command::Look(LookCommand::Turn(turn)));
        }
    }
    let hint = "The environment from above, with the camera at the bottom. Drag to turn, click to turn it there, double-click to reset.";
    theme::hint_at_rest_ui(response, hint);
}

/// The subject from above: a head with its ears, whose nose points at the camera.
fn face_ui(painter: &Painter, center: Pos2, color: Color32) {
    for side in [-1.0, 1.0] {
        painter.circle_filled(center + vec2(side * HEAD, 0.0), 2.5, color);
    }
    let nose = [vec2(-3.0, HEAD - 1.5), vec2(3.0, HEAD - 1.5), vec2(0.0, HEAD + 4.0)];
    let nose = nose.map(|corner| center + corner);
    painter.add(Shape::convex_polygon(nose.into(), color, Stroke::NONE));
    painter.circle_filled(center, HEAD, color);
}

/// The camera from above: its body, and the lens towards the subject.
fn camera_ui(painter: &Painter, at: Pos2, color: Color32) {
    let body = Rect::from_center_size(at + vec2(0.0, 2.0), vec2(14.0, 8.0));
    painter.rect_filled(body, 1.5, color);
    let lens = [vec2(-3.0, -2.0), vec2(3.0, -2.0), vec2(5.0, -6.0), vec2(-5.0, -6.0)];
    let lens = lens.map(|corner| at + corner);
    painter.add(Shape::convex_polygon(lens.into(), color, Stroke::NONE));
}

/// The panorama's centre on the ring: at yaw 0 it is at the top, behind the subject.
fn on_ring(center: Pos2, yaw_deg: f32) -> Pos2 {
    let (sin, cos) = yaw_deg.to_radians().sin_cos();
    center + RADIUS * vec2(sin, -cos)
}

/// The yaw whose place on the ring is in direction `v`.
fn angle(v: Vec2) -> f32 {
    v.x.atan2(-v.y).to_degrees()
}

/// Degrees by which a pointer moves around the centre between two positions. 0 on the head, where the direction is
/// uncertain.
fn turned(from: Vec2, to: Vec2) -> f32 {
    if from.length().min(to.length()) < HEAD { 0.0 } else { within_a_turn(angle(to) - angle(from)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_compass_gives_back_the_yaw_that_it_shows() {
        for yaw in [-150.0, -90.0, 0.0, 30.0, 179.0] {
            let center = Pos2::new(10.0, 20.0);
            let shown = angle(on_ring(center, yaw) - center);
            assert!((shown - yaw).abs() < 1e-3, "{shown} {yaw}");
        }
        // Positive yaw turns the light to camera-right.
        assert!(on_ring(Pos2::ZERO, 90.0).x > RADIUS - 1.0);
    }

    #[test]
    fn a_drag_turns_by_as_much_as_it_goes_around_the_middle() {
        let at = |yaw| on_ring(Pos2::ZERO, yaw) - Pos2::ZERO;
        for (from, to, turn) in [(0.0, 30.0, 30.0), (170.0, -170.0, 20.0), (-170.0, 170.0, -20.0), (90.0, 90.0, 0.0)] {
            assert!((turned(at(from), at(to)) - turn).abs() < 1e-3, "{from} {to}");
        }
        assert_eq!(turned(vec2(1.0, 0.0), at(-90.0)), 0.0);
        assert_eq!(turned(at(90.0), vec2(-2.0, 1.0)), 0.0);
    }
}
