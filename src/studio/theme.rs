//! How the window looks: neutral greys, so that nothing competes with the picture.

use super::icons;
use egui::{Color32, CornerRadius, FontDefinitions, FontId, Stroke, TextStyle};

/// Around the picture: middle grey, 18 % of white, which does not bias the eye.
pub const SURROUND: Color32 = Color32::from_gray(118);
/// Panels.
pub const PANEL: Color32 = Color32::from_gray(38);
/// Lists and tracks in a panel.
pub const WELL: Color32 = Color32::from_gray(24);
/// Text.
pub const TEXT: Color32 = Color32::from_gray(222);
/// Secondary text.
pub const QUIET: Color32 = Color32::from_gray(160);
/// What is chosen or being dragged: the one colour.
pub const ACCENT: Color32 = Color32::from_rgb(232, 164, 80);
/// Nothing to do, and something is wrong; a word always stands beside them.
pub const GREEN: Color32 = Color32::from_rgb(112, 176, 112);
pub const RED: Color32 = Color32::from_rgb(226, 98, 84);
/// A main button, and what is done already.
pub const ACCENT_DIM: Color32 = Color32::from_rgb(122, 92, 56);
/// Distance between things in points.
pub const GAP: f32 = 8.0;

/// Sets the window's fonts and colours.
pub fn apply(ctx: &egui::Context) {
    ctx.set_theme(egui::Theme::Dark);
    let mut fonts = FontDefinitions::default();
    icons::add_to(&mut fonts);
    ctx.set_fonts(fonts);
    ctx.all_styles_mut(|style| {
        style.text_styles = [
            (TextStyle::Small, FontId::proportional(12.0)),
            (TextStyle::Body, FontId::proportional(14.0)),
            (TextStyle::Button, FontId::proportional(14.0)),
            (TextStyle::Heading, FontId::proportional(20.0)),
            (TextStyle::Monospace, FontId::monospace(13.0)),
        ]
        .into();
        style.spacing.item_spacing = egui::vec2(GAP, 6.0);
        style.spacing.button_padding = egui::vec2(10.0, 4.0);
        style.spacing.interact_size.y = 24.0;
        style.interaction.selectable_labels = false;
        // Animations would ask for frames while nothing happens.
        style.animation_time = 0.0;
        let visuals = &mut style.visuals;
        visuals.panel_fill = PANEL;
        visuals.window_fill = PANEL;
        visuals.extreme_bg_color = WELL;
        visuals.faint_bg_color = Color32::from_gray(44);
        visuals.weak_text_color = Some(QUIET);
        visuals.hyperlink_color = ACCENT;
        visuals.warn_fg_color = ACCENT;
        visuals.selection.bg_fill = Color32::from_gray(92);
        visuals.selection.stroke = Stroke::new(1.0, Color32::WHITE);
        let widgets = &mut visuals.widgets;
        widgets.noninteractive.fg_stroke.color = TEXT;
        widgets.noninteractive.bg_stroke.color = Color32::from_gray(58);
        for (widget, fill) in [
            (&mut widgets.inactive, 60),
            (&mut widgets.hovered, 76),
            (&mut widgets.active, 92),
            (&mut widgets.open, 60),
        ] {
            widget.weak_bg_fill = Color32::from_gray(fill);
            widget.bg_fill = Color32::from_gray(fill);
            widget.fg_stroke.color = TEXT;
            widget.corner_radius = CornerRadius::same(3);
            widget.expansion = 0.0;
        }
        widgets.hovered.bg_stroke = Stroke::new(1.0, Color32::from_gray(110));
        widgets.active.bg_stroke = Stroke::new(1.0, ACCENT);
    });
}
