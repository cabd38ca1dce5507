//! Lamp directions as numbered marks, on a lat-long panorama and on a dome that can be turned.

use crate::theme;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2, pos2, vec2};
use glam::{Quat, Vec3};
use light::latlong::uv_from_direction;

/// Radius of a mark in points, as drawn and as clicked.
pub const MARK_RADIUS: f32 = 7.0;

/// A numbered direction.
#[derive(Clone, Copy)]
pub struct Mark {
    pub number: usize,
    pub direction: Vec3,
    /// Drawn in the accent colour.
    pub chosen: bool,
    /// Drawn faintly: the direction is uncertain.
    pub doubtful: bool,
}

/// Turn of the dome by dragging, in radians.
#[derive(Clone, Copy)]
pub struct DomeView {
    yaw: f32,
    pitch: f32,
}

impl Default for DomeView {
    /// From above the camera's right shoulder.
    fn default() -> Self {
        Self { yaw: 0.5, pitch: 0.4 }
    }
}

/// Draws a mark at a point of the window.
pub fn mark_ui(painter: &Painter, at: Pos2, mark: &Mark, faint: bool) {
    let strength: f32 = if faint || mark.doubtful { 0.45 } else { 1.0 };
    let fill = if mark.chosen { theme::ACCENT } else { Color32::from_gray(20).gamma_multiply(strength.max(0.6)) };
    let color = if mark.chosen { Color32::BLACK } else { theme::TEXT.gamma_multiply(strength) };
    painter.circle(at, MARK_RADIUS, fill, Stroke::new(1.0, color));
    let number = mark.number.to_string();
    let size = if number.len() < 3 { 9.0 } else { 7.0 };
    painter.text(at, Align2::CENTER_CENTER, number, FontId::proportional(size), color);
}

/// Returns the point of a direction on the lat-long panorama in `rect`.
pub fn place(rect: Rect, direction: Vec3) -> Pos2 {
    let (u, v) = uv_from_direction(direction);
    rect.min + vec2(u.rem_euclid(1.0), v) * rect.size()
}

/// Returns the panorama's coordinates u and v, from 0 to 1, at a point; outside, those of the nearest edge.
pub fn share(rect: Rect, at: Pos2) -> (f32, f32) {
    let share = (at - rect.min) / rect.size();
    (share.x.clamp(0.0, 1.0), share.y.clamp(0.0, 1.0))
}

/// Marks on a lat-long panorama drawn in `rect`. Returns the clicked one's number.
pub fn latlong_ui(ui: &Ui, rect: Rect, response: &Response, marks: &[Mark]) -> Option<usize> {
    let places: Vec<Pos2> = marks.iter().map(|mark| place(rect, mark.direction)).collect();
    let painter = ui.painter().with_clip_rect(rect);
    for (mark, at) in in_order(marks, &places) {
        mark_ui(&painter, at, mark, false);
    }
    clicked(response, marks, &places)
}

/// The dome from outside, with the directions of the camera and up. Returns the clicked mark's number.
pub fn dome_ui(ui: &mut Ui, side: f32, view: &mut DomeView, marks: &[Mark]) -> Option<usize> {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(side), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Dome of lamps"));
    let turn = response.drag_delta() * 0.01;
    if turn != Vec2::ZERO {
        view.yaw = (view.yaw + turn.x).rem_euclid(std::f32::consts::TAU);
        view.pitch = (view.pitch + turn.y).clamp(-1.5, 1.5);
    }
    if response.double_clicked() {
        *view = DomeView::default();
    }
    // After the turn the viewer is on +Z.
    let turn = Quat::from_rotation_x(view.pitch) * Quat::from_rotation_y(view.yaw);
    let (center, radius) = (rect.center(), 0.5 * side - MARK_RADIUS - 1.0);
    let place = |direction: Vec3| {
        let seen = turn * direction;
        (center + radius * vec2(seen.x, -seen.y), seen.z)
    };
    theme::focus_ui(ui, rect, &response);
    let painter = ui.painter();
    painter.circle(center, radius, theme::WELL, Stroke::new(1.0, Color32::from_gray(70)));
    let line = |direction: &dyn Fn(f32) -> Vec3| {
        let points: Vec<(Pos2, f32)> =
            (0..=72).map(|i| place(direction(i as f32 / 72.0 * std::f32::consts::TAU))).collect();
        for pair in points.windows(2) {
            let gray = if pair[0].1 >= 0.0 { 84 } else { 46 };
            painter.line_segment([pair[0].0, pair[1].0], Stroke::new(1.0, Color32::from_gray(gray)));
        }
    };
    line(&|a| Vec3::new(a.sin(), 0.0, a.cos()));
    line(&|a| Vec3::new(0.0, a.sin(), a.cos()));
    for (direction, name) in [(Vec3::Z, "camera"), (Vec3::Y, "up")] {
        let (at, depth) = place(direction);
        let color = theme::QUIET.gamma_multiply(if depth >= 0.0 { 1.0 } else { 0.4 });
        painter.circle_filled(at, 2.0, color);
        painter.text(at + vec2(0.0, -3.0), Align2::CENTER_BOTTOM, name, FontId::proportional(10.0), color);
    }
    let seen: Vec<(Pos2, f32)> = marks.iter().map(|mark| place(mark.direction)).collect();
    let places: Vec<Pos2> = seen.iter().map(|(at, _)| *at).collect();
    let mut order: Vec<usize> = (0..marks.len()).collect();
    order.sort_by(|&a, &b| seen[a].1.total_cmp(&seen[b].1));
    for i in order {
        mark_ui(painter, places[i], &marks[i], seen[i].1 < 0.0);
    }
    // Where marks overlap, a click selects the nearer one.
    let near: Vec<Pos2> = seen.iter().map(|(at, depth)| if *depth >= 0.0 { *at } else { pos2(-1e6, -1e6) }).collect();
    let hit = clicked(&response, marks, &near).or_else(|| clicked(&response, marks, &places));
    let hint =
        "The lamps around the subject. Drag to turn, double-click to reset, click a lamp to see its mirror ball.";
    theme::hint_at_rest_ui(response, hint);
    hit
}

/// The number of the mark under a click.
pub fn clicked(response: &Response, marks: &[Mark], places: &[Pos2]) -> Option<usize> {
    let at = response.interact_pointer_pos().filter(|_| response.clicked())?;
    marks
        .iter()
        .zip(places)
        .map(|(mark, place)| (mark.number, place.distance(at)))
        .filter(|(_, distance)| *distance <= MARK_RADIUS + 2.0)
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(number, _)| number)
}

/// Marks with their points, the chosen one last, so that it is drawn on top.
pub fn in_order<'a>(marks: &'a [Mark], places: &'a [Pos2]) -> impl Iterator<Item = (&'a Mark, Pos2)> {
    let all = move || marks.iter().zip(places.iter().copied());
    all().filter(|(mark, _)| !mark.chosen).chain(all().filter(|(mark, _)| mark.chosen))
}
