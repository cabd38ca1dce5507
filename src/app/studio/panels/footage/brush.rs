//! The brush over the picture: what it paints, the strokes of the frame, and its matte.

use super::square::Placement;
use crate::command::{Command, MatteCommand};
use crate::panel_context::PanelContext;
use crate::panels::footage::reader::FootagePicture;
use crate::theme;
use egui::{Color32, CursorIcon, Painter, PointerButton, Pos2, Rect, Sense, Shape, Stroke, Ui, pos2, vec2};
use footage::{BrushSide, Stroke as Painted};
use project::Framing;

/// Points that the brush moves before the next point of a stroke.
const STEP: f32 = 1.5;
/// Most points of a stroke; a longer line becomes several strokes.
const MOST_POINTS: usize = 2000;

/// Holds the stroke that is being painted.
#[derive(Default)]
pub struct Brush {
    painted: Option<Painted>,
}

fn color(side: BrushSide) -> Color32 {
    match side {
        BrushSide::Keep => theme::GOOD,
        BrushSide::Remove => theme::WARNING,
    }
}

impl Brush {
    /// Draws the picture, its matte and its strokes into the rest of `ui`, and paints on frame `frame` if `allowed`.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        shown: &FootagePicture,
        kept: Framing,
        (frame, allowed): (usize, bool),
        out: &mut Vec<Command>,
    ) {
        let room = ui.available_rect_before_wrap();
        let place = Placement::new(room, shown, kept);
        let size = vec2(shown.size.0 as f32, shown.size.1 as f32);
        let picture = place.rect(Rect::from_min_size(Pos2::ZERO, size));
        let painter = ui.painter_at(room);
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        painter.image(shown.texture.id(), picture, whole, Color32::WHITE);
        if !allowed {
            self.painted = None;
            return;
        }
        if let Some(Ok(live)) = context.readers.matte.live(frame) {
            painter.image(live.id(), picture, whole, Color32::WHITE);
        }
        let strokes = context.readers.matte.strokes().and_then(|strokes| strokes.as_ref().ok());
        let here = strokes.into_iter().flat_map(|all| &all.strokes);
        for stroke in here.filter(|stroke| stroke.frame == frame) {
            draw(&painter, &place, stroke, 0.35);
        }
        self.paint(ui, context, &place, shown.size, (room, frame), out);
        if let Some(stroke) = &self.painted {
            draw(&painter, &place, stroke, 0.7);
        }
    }

    fn paint(
        &mut self,
        ui: &Ui,
        context: &PanelContext,
        place: &Placement,
        size: (usize, usize),
        (room, frame): (Rect, usize),
        out: &mut Vec<Command>,
    ) {
        let id = ui.scope_id().with("brush");
        let response = ui.interact(room, id, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, "Matte brush"));
        let radius = context.readers.matte.radius(size);
        if let Some(at) = response.hover_pos() {
            let wheel = ui.input(|i| i.smooth_scroll_delta().y);
            if wheel != 0.0 {
                let radius = (radius * (0.004 * wheel).exp()).clamp(0.5, 2000.0);
                out.push(Command::Matte(MatteCommand::Radius(radius)));
            }
            let ring = (place.scale * radius).max(1.5);
            let painter = ui.painter_at(room);
            for (width, color) in [(3.0, Color32::from_black_alpha(140)), (1.5, color(context.readers.matte.side))] {
                painter.circle_stroke(at, ring, Stroke::new(width, color));
            }
            ui.set_cursor_icon(CursorIcon::Crosshair);
        }
        let (held, other) =
            (response.is_pointer_button_down_on(), ui.input(|i| i.pointer.button_down(PointerButton::Secondary)));
        let at = response.interact_pointer_pos();
        if let (true, Some(at)) = (held || response.clicked() || response.secondary_clicked(), at) {
            let radius = context.readers.matte.radius(size);
            let side = match (context.readers.matte.side, other || response.secondary_clicked()) {
                (side, false) => side,
                (BrushSide::Keep, true) => BrushSide::Remove,
                (BrushSide::Remove, true) => BrushSide::Keep,
            };
            let begins = self.painted.is_none();
            let stroke = self.painted.get_or_insert_with(|| Painted { frame, side, radius, points: Vec::new() });
            if begins {
                let origin = ui.input(|i| i.pointer.press_origin()).unwrap_or(at);
                let from = place.pixel(origin);
                stroke.points.push([from.x, from.y]);
            }
            let to = place.pixel(at);
            let far = stroke.points.last().is_none_or(|[x, y]| place.scale * (to - pos2(*x, *y)).length() >= STEP);
            if far {
                stroke.points.push([to.x, to.y]);
            }
            if stroke.points.len() >= MOST_POINTS {
                let next = Painted { points: vec![[to.x, to.y]], ..*stroke };
                let whole = std::mem::replace(stroke, next);
                out.push(Command::Matte(MatteCommand::Stroke(Box::new(whole))));
            }
        }
        if !held && let Some(stroke) = self.painted.take() {
            out.push(Command::Matte(MatteCommand::Stroke(Box::new(stroke))));
        }
    }
}

fn draw(painter: &Painter, place: &Placement, stroke: &Painted, opacity: f32) {
    let at = |[x, y]: [f32; 2]| place.rect(Rect::from_min_size(pos2(x, y), vec2(0.0, 0.0))).min;
    let width = (2.0 * place.scale * stroke.radius).max(1.0);
    let color = color(stroke.side).gamma_multiply(opacity);
    match stroke.points[..] {
        [point] => {
            painter.circle_filled(at(point), 0.5 * width, color);
        }
        _ => {
            let points = stroke.points.iter().copied().map(at).collect();
            painter.add(Shape::line(points, Stroke::new(width, color)));
        }
    }
}
