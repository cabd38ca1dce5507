//! The picture of the start page: one frame of the demo under four lights.

use egui::{
    Color32, ColorImage, Pos2, Rect, Response, Role, Sense, TextureHandle, TextureOptions, Ui, Vec2, WidgetInfo, vec2,
};

/// A part of `docs/relit.jpg`.
const PICTURE: &[u8] = include_bytes!("../../../../../assets/welcome/interview.jpg");

/// Holds the texture after the first draw.
#[derive(Default)]
pub struct Hero {
    texture: Option<TextureHandle>,
}

impl Hero {
    /// Draws the whole picture, as wide as there is room, at most `height` points high.
    pub fn ui(&mut self, ui: &mut Ui, height: f32) {
        let texture = self.texture.get_or_insert_with(|| {
            // A bundled picture: tests check that it decodes.
            let (size, rgb) = imaging::file::codes_from_memory(PICTURE).unwrap_or_else(|_| ((1, 1), vec![0; 3]));
            let picture = ColorImage::from_rgb(size.into(), &rgb);
            (ui.ctx()).load_texture("hero", picture, TextureOptions::LINEAR)
        });
        picture_ui(ui, texture, height, "A frame of the demo under four lights");
    }
}

/// Draws a whole picture, as wide as there is room, at most `height` points high.
pub(super) fn picture_ui(ui: &mut Ui, texture: &TextureHandle, height: f32, name: &str) -> Response {
    let room = vec2(ui.available_width(), height);
    let size = texture.size_vec2() * (room / texture.size_vec2()).min_elem();
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
    let whole = Rect::from_min_size(Pos2::ZERO, Vec2::splat(1.0));
    ui.painter().image(texture.id(), rect, whole, Color32::WHITE);
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_can_be_read() {
        let ((width, height), rgb) = imaging::file::codes_from_memory(PICTURE).unwrap();
        assert!(width >= 1280 && height >= 360);
        assert_eq!(rgb.len(), 3 * width * height);
    }
}
