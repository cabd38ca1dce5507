//! A picture in the viewport: its texture, its place, its name, and the zoom.

use crate::command::{Command, ViewCommand};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{Align2, Color32, FontId, Rect, Response, TextureHandle, TextureId, Ui, Vec2, pos2, vec2};

/// A texture with these codes; reuses `old`.
pub fn texture(
    ctx: &egui::Context,
    name: &str,
    old: Option<TextureHandle>,
    size: [usize; 2],
    rgb: &[u8],
) -> TextureHandle {
    let picture = egui::ColorImage::from_rgb(size, rgb);
    match old {
        Some(mut texture) => {
            texture.set(picture, egui::TextureOptions::LINEAR);
            texture
        }
        None => ctx.load_texture(name, picture, egui::TextureOptions::LINEAR),
    }
}

/// The picture's rectangle: fitted with a margin, then zoomed and panned. Also the points per pixel when fitted.
pub fn placed(rect: Rect, size: Vec2, context: &PanelContext) -> (Rect, f32) {
    let room = (rect.size() - Vec2::splat(4.0 * GAP)).max(Vec2::splat(1.0));
    let fit = (room / size).min_elem();
    let view = context.state.viewport.view;
    let placed = Rect::from_center_size(rect.center() + Vec2::from(view.pan), size * fit * view.zoom);
    (placed, fit)
}

/// Draws the part of a texture between two shares of its width, at its position in `place`.
pub fn paint(ui: &Ui, clip: Rect, texture: TextureId, place: Rect, (from, to): (f32, f32)) {
    let x = |share: f32| place.left() + share * place.width();
    let part = Rect::from_min_max(pos2(x(from), place.top()), pos2(x(to), place.bottom()));
    let uv = Rect::from_min_max(pos2(from, 0.0), pos2(to, 1.0));
    let painter = ui.painter().with_clip_rect(clip);
    painter.image(texture, part, uv, Color32::WHITE);
}

/// A name over a corner of the picture.
pub fn label(ui: &Ui, rect: Rect, corner: Align2, text: &str) {
    let painter = ui.painter().with_clip_rect(rect);
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(13.0), theme::TEXT);
    let back = corner.align_size_within_rect(galley.size() + vec2(12.0, 6.0), rect.shrink(GAP));
    painter.rect_filled(back, 3.0, theme::OVER_PICTURE);
    painter.galley(back.min + vec2(6.0, 3.0), galley, theme::TEXT);
}

/// Zoom by wheel or pinch over `rect`.
pub fn zoom(ui: &Ui, response: &Response, rect: Rect, out: &mut Vec<Command>) {
    if let Some(at) = response.hover_pos() {
        let factor = ui.input(|i| (i.smooth_scroll_delta().y / 200.0).exp() * i.zoom_delta());
        if factor != 1.0 {
            out.push(Command::View(ViewCommand::Zoom { factor, about: (at - rect.center()).into() }));
        }
    }
}
