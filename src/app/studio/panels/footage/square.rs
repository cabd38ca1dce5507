//! The framing over the picture: a square to drag by its corners or as a whole.

use crate::panels::footage::reader::FootagePicture;
use crate::theme::{self, GAP};
use egui::{Color32, CursorIcon, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, Vec2, pos2, vec2};
use project::Framing;

/// Points from a corner within which it can be grabbed.
const REACH: f32 = 9.0;
/// Smallest side of the square in pixels after a drag.
const LEAST: f32 = 16.0;
/// The corners, as shares of the side from the upper left one, with their names.
const CORNERS: [([f32; 2], &str); 4] = [
    ([0.0, 0.0], "Framing, upper left corner"),
    ([1.0, 0.0], "Framing, upper right corner"),
    ([0.0, 1.0], "Framing, lower left corner"),
    ([1.0, 1.0], "Framing, lower right corner"),
];

/// Holds where a drag began.
#[derive(Default)]
pub struct Square {
    /// The framing and the pointer, in pixels, when the drag began.
    grabbed: Option<(Framing, Pos2)>,
}

/// Converts pixels of the picture to points of the window.
pub struct Placement {
    origin: Pos2,
    /// Points per pixel.
    pub scale: f32,
}

impl Placement {
    /// Centres the picture in the room, with the part of the project's framing outside it.
    pub fn new(room: Rect, shown: &FootagePicture, kept: Framing) -> Self {
        let (width, height) = (shown.size.0 as f32, shown.size.1 as f32);
        let picture = Rect::from_min_size(Pos2::ZERO, vec2(width, height));
        let seen = picture.expand(0.04 * width.max(height)).union(square(kept));
        let room = room.shrink(2.0 * GAP);
        let scale = (room.width() / seen.width()).min(room.height() / seen.height()).max(1e-3);
        Self { origin: room.center() - scale * seen.center().to_vec2(), scale }
    }

    pub fn rect(&self, pixels: Rect) -> Rect {
        Rect::from_min_size(self.origin + self.scale * pixels.min.to_vec2(), self.scale * pixels.size())
    }

    pub fn pixel(&self, at: Pos2) -> Pos2 {
        ((at - self.origin) / self.scale).to_pos2()
    }
}

fn square(framing: Framing) -> Rect {
    let at = pos2(framing.x as f32, framing.y as f32);
    Rect::from_min_size(at, Vec2::splat(framing.side as f32))
}

impl Square {
    /// Draws the picture and the square into the rest of `ui`, and moves the square with a drag.
    pub fn ui(&mut self, ui: &mut Ui, shown: &FootagePicture, kept: Framing, framing: &mut Framing) {
        let room = ui.available_rect_before_wrap();
        let place = Placement::new(room, shown, kept);
        let (width, height) = shown.size;
        let picture = place.rect(Rect::from_min_size(Pos2::ZERO, vec2(width as f32, height as f32)));
        let painter = ui.painter_at(room);
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        painter.image(shown.texture.id(), picture, whole, Color32::WHITE);
        self.drag(ui, room, &place, framing);

        let chosen = place.rect(square(*framing));
        let shade = Color32::from_black_alpha(140);
        for part in around(picture, chosen) {
            painter.rect_filled(part, 0.0, shade);
        }
        for (width, color) in [(3.0, Color32::from_black_alpha(160)), (1.5, theme::ACCENT)] {
            painter.rect_stroke(chosen, 0.0, Stroke::new(width, color), StrokeKind::Middle);
        }
        for (corner, _) in CORNERS {
            let handle = Rect::from_center_size(at_corner(chosen, corner), Vec2::splat(9.0));
            painter.rect_filled(handle, 1.0, theme::ACCENT);
        }
    }

    fn drag(&mut self, ui: &Ui, room: Rect, place: &Placement, framing: &mut Framing) {
        let chosen = place.rect(square(*framing));
        let id = ui.scope_id().with("framing");
        // The corners are above the square and take the presses there.
        let body = ui.interact(chosen.intersect(room), id, Sense::drag());
        body.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, "Framing square"));
        let body = body.on_hover_cursor(CursorIcon::Move);
        let mut held = body.dragged().then_some((body, None));
        for (i, (corner, name)) in CORNERS.into_iter().enumerate() {
            let reach = Rect::from_center_size(at_corner(chosen, corner), Vec2::splat(2.0 * REACH));
            let response = ui.interact(reach, id.with(i), Sense::drag());
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, name));
            let cursor = if corner[0] == corner[1] { CursorIcon::ResizeNwSe } else { CursorIcon::ResizeNeSw };
            let response = response.on_hover_cursor(cursor);
            if response.dragged() {
                held = Some((response, Some(corner)));
            }
        }
        let Some((response, corner)) = held else {
            self.grabbed = None;
            return;
        };
        let Some(at) = response.interact_pointer_pos() else { return };
        let origin = ui.input(|i| i.pointer.press_origin()).unwrap_or(at);
        let (before, from) = *self.grabbed.get_or_insert((*framing, place.pixel(origin)));
        let moved = place.pixel(at) - from;
        *framing = match corner {
            None => Framing { x: before.x + moved.x.round() as i32, y: before.y + moved.y.round() as i32, ..before },
            Some(corner) => grown(before, corner, moved),
        }
        .bounded();
    }
}

/// Returns the square after a drag of one corner. The opposite corner stays.
fn grown(before: Framing, corner: [f32; 2], moved: Vec2) -> Framing {
    let outwards = |axis: usize| {
        if corner[axis] > 0.0 { moved[axis] } else { -moved[axis] }
    };
    // The axis that was dragged further decides: along it the corner stays under the pointer.
    let growth = if outwards(0).abs() > outwards(1).abs() { outwards(0) } else { outwards(1) };
    let side = (before.side as f32 + growth).round().max(LEAST);
    let more = side as i32 - before.side as i32;
    let shifted = |at: i32, axis: usize| if corner[axis] > 0.0 { at } else { at - more };
    Framing { x: shifted(before.x, 0), y: shifted(before.y, 1), side: side as usize, ..before }
}

fn at_corner(rect: Rect, [x, y]: [f32; 2]) -> Pos2 {
    rect.lerp_inside(vec2(x, y))
}

/// The part of `picture` outside `chosen`, as rectangles that do not overlap.
fn around(picture: Rect, chosen: Rect) -> [Rect; 4] {
    let inside = chosen.intersect(picture);
    if !inside.is_positive() {
        return [picture, Rect::ZERO, Rect::ZERO, Rect::ZERO];
    }
    let part = |from: Pos2, to: Pos2| Rect::from_min_max(from, to);
    [
        part(picture.min, pos2(picture.right(), inside.top())),
        part(pos2(picture.left(), inside.bottom()), picture.max),
        part(pos2(picture.left(), inside.top()), inside.left_bottom()),
        part(inside.right_top(), pos2(picture.right(), inside.bottom())),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dragged_corner_leaves_the_opposite_one_where_it_is() {
        let before = Framing { x: 10, y: 20, side: 100, ..Framing::largest((1920, 1080)) };
        for (corner, _) in CORNERS {
            for moved in [vec2(30.0, 4.0), vec2(-5.0, -40.0), vec2(-500.0, 500.0)] {
                let after = grown(before, corner, moved);
                let opposite = |f: Framing| {
                    let far = |at: i32, share: f32| at + ((1.0 - share) * f.side as f32) as i32;
                    (far(f.x, corner[0]), far(f.y, corner[1]))
                };
                assert_eq!(opposite(after), opposite(before), "{corner:?} {moved:?}");
                assert!(after.side >= LEAST as usize);
            }
        }
        assert_eq!(grown(before, [1.0, 1.0], vec2(30.0, 4.0)).side, 130);
        assert_eq!(grown(before, [0.0, 0.0], vec2(30.0, 4.0)).side, 70);
    }
}
