//! The mirror ball's photograph: the circle can be dragged, the rim is magnified, the lamps are marked.

use crate::command::{CalibrationCommand, Command, LookCommand, ViewCommand};
use crate::panel_context::PanelContext;
use crate::panels::widgets::sphere::{self, Mark};
use crate::theme::{self, GAP};
use calibration::Circle;
use egui::{Color32, CursorIcon, PointerButton, Pos2, Rect, Response, Sense, Stroke, TextureId, Ui, Vec2, pos2, vec2};
use worker::ProbeView;

/// Points from a handle within which it can be grabbed.
const REACH: f32 = 9.0;
/// Size of the magnifier in points, and its magnification.
const LOUPE_SIDE: f32 = 156.0;
const LOUPE_ZOOM: f32 = 6.0;
/// Beyond this many, clipped pixels are not marked.
const MOST_MARKED: usize = 4000;

/// Target of a drag.
#[derive(Clone, Copy, PartialEq)]
enum DragTarget {
    Center,
    /// The rim at an angle in radians: changes the radius.
    Rim(f32),
    Picture,
}

/// State kept from frame to frame.
#[derive(Default)]
pub struct Photograph {
    dragged: Option<DragTarget>,
    /// Points of the rim clicked so far, in pixels; `None` while clicks choose lamps.
    pub points: Option<Vec<[f64; 2]>>,
    /// Reason why no circle fits the clicked points.
    pub refused: Option<String>,
    /// The angle in radians at which the rim is magnified.
    looked_at: f32,
}

/// Converts pixels of the photograph to points of the window.
#[derive(Clone, Copy)]
struct Placement {
    rect: Rect,
    points_per_pixel: f32,
}

impl Placement {
    fn point(&self, [x, y]: [f64; 2]) -> Pos2 {
        self.rect.min + vec2(x as f32, y as f32) * self.points_per_pixel
    }

    fn pixel(&self, at: Pos2) -> [f64; 2] {
        let [x, y]: [f32; 2] = ((at - self.rect.min) / self.points_per_pixel).into();
        [f64::from(x), f64::from(y)]
    }

    fn length(&self, pixels: f64) -> f32 {
        pixels as f32 * self.points_per_pixel
    }
}

impl Photograph {
    /// Draws the photograph into the rest of `ui`.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        study: &ProbeView,
        picture: TextureId,
        marks: &[Mark],
        out: &mut Vec<Command>,
    ) {
        let rect = ui.available_rect_before_wrap();
        let (width, height) = study.size;
        let size = vec2(width as f32, height as f32);
        let room = (rect.size() - Vec2::splat(4.0 * GAP)).max(Vec2::splat(1.0));
        let view = context.state.viewport.view;
        let points_per_pixel = (room / size).min_elem() * view.zoom;
        let center = rect.center() + Vec2::from(view.pan);
        let placement = Placement { rect: Rect::from_center_size(center, size * points_per_pixel), points_per_pixel };
        let painter = ui.painter().with_clip_rect(rect);
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        painter.image(picture, placement.rect, whole, Color32::WHITE);
        if study.clipped_at.len() <= MOST_MARKED {
            let side = points_per_pixel.max(1.0);
            for &[x, y] in &study.clipped_at {
                let at = placement.point([f64::from(x), f64::from(y)]);
                let pixel = Rect::from_center_size(at, Vec2::splat(side));
                painter.rect_filled(pixel, 0.0, Color32::from_rgb(255, 0, 220));
            }
        }
        let circle = context.state.look.circle.unwrap_or(study.circle);
        let response = ui.interact(rect, ui.scope_id().with("photograph"), Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Mirror ball"));
        theme::focus_ui(ui, rect, &response);
        self.gestures(ui, &response, rect, placement, circle, out);
        let places: Vec<Pos2> = (study.lamps.iter())
            .map(|lamp| lamp.on_ball.map_or(pos2(-1e6, -1e6), |[x, y]| placement.point([f64::from(x), f64::from(y)])))
            .collect();
        for (mark, at) in sphere::in_order(marks, &places) {
            sphere::mark_ui(&painter, at, mark, false);
        }
        if self.points.is_none()
            && let Some(number) = sphere::clicked(&response, marks, &places)
        {
            out.push(Command::View(ViewCommand::Photograph(Some(number))));
        }
        circle_ui(&painter, placement, circle);
        for point in self.points.iter().flatten() {
            painter.circle_filled(placement.point(*point), 3.5, theme::ACCENT);
        }
        self.loupe_ui(ui, rect, placement, circle, picture, size);
        ui.advance_cursor_after_rect(rect);
    }

    fn gestures(
        &mut self,
        ui: &Ui,
        response: &Response,
        rect: Rect,
        placement: Placement,
        circle: Circle,
        out: &mut Vec<Command>,
    ) {
        if let Some(at) = response.hover_pos() {
            let factor = ui.input(|i| (i.smooth_scroll_delta().y / 200.0).exp() * i.zoom_delta());
            if factor != 1.0 {
                let about = (at - rect.center()).into();
                out.push(Command::View(ViewCommand::Zoom { factor, about }));
            }
            let from_center = at - placement.point(circle.center_px);
            if self.dragged.is_none() && from_center.length() > 4.0 {
                self.looked_at = from_center.angle();
            }
            if self.points.is_some() {
                ui.set_cursor_icon(CursorIcon::Crosshair);
            } else {
                match self.dragged.unwrap_or_else(|| grip(placement, circle, at)) {
                    DragTarget::Center => ui.set_cursor_icon(CursorIcon::Move),
                    DragTarget::Rim(_) => ui.set_cursor_icon(CursorIcon::ResizeNwSe),
                    DragTarget::Picture => {}
                }
            }
        }
        if let (Some(points), true, Some(at)) = (&mut self.points, response.clicked(), response.interact_pointer_pos())
        {
            points.push(placement.pixel(at));
            if let [a, b, c] = points[..] {
                match Circle::through([a, b, c]) {
                    Ok(circle) => out.push(Command::Look(LookCommand::Circle(Some(circle)))),
                    Err(e) => self.refused = Some(e.to_string()),
                }
                self.points = None;
            }
        }
        if response.drag_started_by(PointerButton::Primary)
            && let Some(at) = ui.input(|i| i.pointer.press_origin())
        {
            self.dragged = Some(grip(placement, circle, at));
        }
        let moved = response.drag_delta();
        if response.dragged_by(PointerButton::Middle) {
            out.push(Command::View(ViewCommand::Pan(moved.into())));
        }
        if response.dragged_by(PointerButton::Primary) {
            let fine = if ui.input(|i| i.modifiers.shift) { 0.1 } else { 1.0 };
            // egui recognises a drag only after some points, which count too.
            let whole = response.total_drag_delta().filter(|_| response.drag_started());
            let delta = whole.unwrap_or(moved);
            let pixels = |points: f32| f64::from(fine * points / placement.points_per_pixel);
            match self.dragged {
                Some(DragTarget::Center) => out.push(Command::Calibration(CalibrationCommand::NudgeCircle {
                    by: [pixels(delta.x), pixels(delta.y)],
                    radius: 0.0,
                })),
                Some(DragTarget::Rim(angle)) => out.push(Command::Calibration(CalibrationCommand::NudgeCircle {
                    by: [0.0; 2],
                    radius: pixels(delta.dot(Vec2::angled(angle))),
                })),
                Some(DragTarget::Picture) => out.push(Command::View(ViewCommand::Pan(delta.into()))),
                None => {}
            }
        }
        if response.drag_stopped() {
            self.dragged = None;
        }
    }

    /// The rim near the pointer, magnified in a corner.
    fn loupe_ui(&self, ui: &Ui, rect: Rect, placement: Placement, circle: Circle, picture: TextureId, size: Vec2) {
        let side = LOUPE_SIDE.min(0.4 * rect.width().min(rect.height()));
        let corner = pos2(rect.left() + 1.5 * GAP, rect.bottom() - side - 1.5 * GAP);
        let loupe = Rect::from_min_size(corner, Vec2::splat(side));
        let painter = ui.painter().with_clip_rect(loupe.intersect(rect));
        painter.rect_filled(loupe, 0.0, Color32::BLACK);
        let rim = Vec2::angled(self.looked_at) * circle.radius_px as f32
            + vec2(circle.center_px[0] as f32, circle.center_px[1] as f32);
        // Six times the picture's scale, and at least three points per pixel.
        let scale = (LOUPE_ZOOM * placement.points_per_pixel).max(3.0);
        let shown = Rect::from_center_size(rim.to_pos2(), Vec2::splat(side / scale));
        let part = shown.intersect(Rect::from_min_size(Pos2::ZERO, size));
        if part.is_positive() {
            let window = |at: Pos2| loupe.min + (at - shown.min) * scale;
            let to = Rect::from_min_max(window(part.min), window(part.max));
            let uv = |at: Pos2| (at.to_vec2() / size).to_pos2();
            painter.image(picture, to, Rect::from_min_max(uv(part.min), uv(part.max)), Color32::WHITE);
        }
        // egui draws a circle this large with visible corners, so the arc is drawn point by point.
        let radius = circle.radius_px as f32 * scale;
        let center = loupe.center() - Vec2::angled(self.looked_at) * radius;
        let reach = (side / radius).min(std::f32::consts::PI);
        let arc =
            (-24..=24).map(|i| center + Vec2::angled(self.looked_at + reach * i as f32 / 24.0) * radius).collect();
        painter.line(arc, Stroke::new(1.0, theme::ACCENT));
        ui.painter().rect_stroke(loupe, 0.0, Stroke::new(1.0, Color32::from_gray(150)), egui::StrokeKind::Outside);
        let note = format!("rim ×{:.0}", scale / placement.points_per_pixel);
        ui.painter().text(
            loupe.left_top() + vec2(5.0, 3.0),
            egui::Align2::LEFT_TOP,
            note,
            egui::FontId::proportional(12.0),
            theme::TEXT,
        );
    }
}

/// Target of a drag that starts at `at`.
fn grip(placement: Placement, circle: Circle, at: Pos2) -> DragTarget {
    let from_center = at - placement.point(circle.center_px);
    if (from_center.length() - placement.length(circle.radius_px)).abs() <= REACH {
        DragTarget::Rim(from_center.angle())
    } else if from_center.length() <= REACH {
        DragTarget::Center
    } else {
        DragTarget::Picture
    }
}

fn circle_ui(painter: &egui::Painter, placement: Placement, circle: Circle) {
    let (center, radius) = (placement.point(circle.center_px), placement.length(circle.radius_px));
    let stroke = Stroke::new(1.5, theme::ACCENT);
    painter.circle_stroke(center, radius, stroke);
    for direction in [vec2(1.0, 0.0), vec2(0.0, 1.0)] {
        painter.line_segment([center - 6.0 * direction, center + 6.0 * direction], stroke);
        for end in [-1.0, 1.0] {
            let handle = Rect::from_center_size(center + end * radius * direction, Vec2::splat(8.0));
            painter.rect(handle, 1.0, theme::ACCENT, Stroke::new(1.0, Color32::BLACK), egui::StrokeKind::Outside);
        }
    }
}
