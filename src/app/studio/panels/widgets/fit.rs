//! Rectangles for a picture that is not stretched.

use egui::{Rect, Vec2, vec2};

/// The crop of a picture that fills `room` without stretching. Cuts more at the bottom than at the top, where faces are.
pub fn covering(picture: Vec2, room: Vec2) -> Rect {
    let shares = (room / picture.max(Vec2::splat(1.0))).max(Vec2::splat(f32::MIN_POSITIVE));
    let size = shares / shares.max_elem();
    Rect::from_min_size(((Vec2::splat(1.0) - size) * vec2(0.5, 0.3)).to_pos2(), size)
}

/// The largest rectangle in the middle of `room` that holds a whole picture without stretching.
pub fn fitting(picture: Vec2, room: Rect) -> Rect {
    Rect::from_center_size(room.center(), picture * (room.size() / picture).min_elem())
}
