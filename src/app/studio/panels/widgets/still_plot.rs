//! A plot that cannot be moved or zoomed.

use crate::theme;
use egui::{Color32, FontId, Vec2b};
use egui_plot::{AxisHints, Plot};

/// An empty plot of this height in points.
pub fn still_plot<'a>(name: &'static str, height: f32) -> Plot<'a> {
    Plot::new(name)
        .height(height)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .allow_double_click_reset(false)
        .auto_bounds(Vec2b::TRUE)
        .show_crosshair(false)
        .grid_color(Color32::from_gray(70))
}

/// An axis with quiet numbers.
pub fn axis<'a>(hints: AxisHints<'a>) -> AxisHints<'a> {
    hints.tick_label_color(theme::QUIET).tick_label_font(FontId::proportional(11.0))
}
