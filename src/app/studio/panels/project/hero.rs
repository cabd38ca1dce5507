//! The picture of the start page: one frame of the demo under four lights.

use crate::panels::covering;
use crate::theme;
use egui::{
    Color32, ColorImage, Mesh, Rect, Role, Sense, TextureHandle, TextureOptions, Ui, WidgetInfo,
    vec2,
};

/// A part of `docs/relit.jpg`.
const PICTURE: &[u8] = include_bytes!("../../../../../assets/welcome/interview.jpg");
/// Least and most height in points.
const HEIGHT: std::ops::RangeInclusive<f32> = 120.0..=360.0;
/// Share of the picture's height that fades into the page.
const FADE: f32 = 0.35;

/// Holds the texture after the first draw.
#[derive(Default)]
pub struct Hero {
    texture: Option<TextureHandle>,
}

impl Hero {
    /// Draws the picture over the full width, `height` points high within limits.
    pub fn ui(&mut self, ui: &mut Ui, height: f32) {
        let size = vec2(ui.available_width(), height.clamp(*HEIGHT.start(), *HEIGHT.end()));
        let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
        response.widget_info(|| {
            WidgetInfo::labeled(Role::Image, true, "A frame of the demo under four lights")
        });
        let texture = self.texture.get_or_insert_with(|| {
            // A bundled picture: tests check that it decodes.
            let (size, rgb) =
                imaging::file::codes_from_memory(PICTURE).unwrap_or_else(|_| ((1, 1), vec![0; 3]));
            let picture = ColorImage::from_rgb(size.into(), &rgb);
            (ui.ctx()).load_texture("hero", picture, TextureOptions::LINEAR)
        });
        let uv = covering(texture.size_vec2(), rect.size());
        // Faces are in the lower part.
        let uv = uv.translate(vec2(0.0, 0.9 * uv.top()));
        ui.painter().image(texture.id(), rect, uv, Color32::WHITE);
        fade_ui(ui, rect);
    }
}

/// Fades the lower part of `rect` into the page.
fn fade_ui(ui: &Ui, rect: Rect) {
    let top = rect.bottom() - FADE * rect.height();
    let mut fade = Mesh::default();
    for (y, color) in [(top, Color32::TRANSPARENT), (rect.bottom(), theme::PANEL)] {
        fade.colored_vertex(egui::pos2(rect.left(), y), color);
        fade.colored_vertex(egui::pos2(rect.right(), y), color);
    }
    fade.add_triangle(0, 1, 2);
    fade.add_triangle(1, 2, 3);
    ui.painter().add(fade);
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
