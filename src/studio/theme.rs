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
/// What is chosen, dragged or on now, and nothing else.
pub const ACCENT: Color32 = Color32::from_rgb(232, 164, 80);
/// What a person has to know or put right; words always stand beside it.
pub const WARNING: Color32 = Color32::from_rgb(244, 124, 92);
/// A main button, and what is done of a job.
pub const PRIMARY: Color32 = Color32::from_rgb(44, 98, 150);
/// Frames that are predicted already.
pub const CACHED: Color32 = Color32::from_rgb(86, 148, 196);
/// Keys of what is animated.
pub const KEY: Color32 = Color32::from_rgb(204, 150, 190);
/// Nothing to do, and something is wrong; a word always stands beside them.
pub const GREEN: Color32 = Color32::from_rgb(112, 176, 112);
pub const RED: Color32 = Color32::from_rgb(236, 112, 99);
/// Verdicts of a review, with [`RED`] for the worst; people who confuse red and green tell them apart.
pub const GOOD: Color32 = Color32::from_rgb(60, 190, 190);
pub const DOUBTFUL: Color32 = Color32::from_rgb(245, 230, 90);
/// What is left of a control's colour while it cannot be used: it can still be read.
const DISABLED: f32 = 0.65;
/// Grey of a button.
const BUTTON: u8 = 60;
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
        visuals.disabled_alpha = DISABLED;
        visuals.warn_fg_color = WARNING;
        visuals.selection.bg_fill = Color32::from_gray(92);
        visuals.selection.stroke = Stroke::new(1.0, Color32::WHITE);
        let widgets = &mut visuals.widgets;
        widgets.noninteractive.fg_stroke.color = TEXT;
        widgets.noninteractive.bg_stroke.color = Color32::from_gray(58);
        for (widget, fill) in [
            (&mut widgets.inactive, BUTTON),
            (&mut widgets.hovered, 76),
            (&mut widgets.active, 92),
            (&mut widgets.open, BUTTON),
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

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::color::{linear_from_srgb, luminance};

    /// The contrast of two colours (WCAG 2.2, contrast ratio).
    fn contrast(a: Color32, b: Color32) -> f32 {
        let light = |color: Color32| {
            let [r, g, b, _] = color.to_array();
            0.05 + luminance([r, g, b].map(|code| linear_from_srgb(f32::from(code) / 255.0)))
        };
        let (a, b) = (light(a), light(b));
        a.max(b) / a.min(b)
    }

    #[test]
    fn what_has_to_be_read_stands_out_from_its_ground() {
        for color in [
            TEXT, QUIET, ACCENT, WARNING, CACHED, KEY, GREEN, RED, GOOD, DOUBTFUL,
        ] {
            for ground in [PANEL, WELL] {
                let found = contrast(color, ground);
                assert!(found >= 4.5, "{color:?} on {ground:?}: {found:.2}");
            }
        }
        assert!(contrast(TEXT, PRIMARY) >= 4.5);
        let faded = |color: Color32| {
            let mix = |c: usize| {
                let [color, panel] = [color, PANEL].map(|color| f32::from(color.to_array()[c]));
                (panel + DISABLED * (color - panel)) as u8
            };
            Color32::from_rgb(mix(0), mix(1), mix(2))
        };
        let disabled = contrast(faded(TEXT), faded(Color32::from_gray(BUTTON)));
        assert!(disabled >= 4.5, "{disabled:.2}");
    }

    /// CIELAB of a colour as it looks to a person: rows of what their eyes make of linear RGB.
    fn lab(color: Color32, eyes: [[f32; 3]; 3]) -> [f32; 3] {
        let [r, g, b, _] = color.to_array();
        let rgb = [r, g, b].map(|code| linear_from_srgb(f32::from(code) / 255.0));
        let dot = |row: [f32; 3], v: [f32; 3]| row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
        let seen = eyes.map(|row| dot(row, rgb).clamp(0.0, 1.0));
        let [x, y, z] = [
            [0.4339, 0.3762, 0.1899],
            [0.2126, 0.7152, 0.0722],
            [0.0177, 0.1095, 0.8728],
        ]
        .map(|row| {
            let t = dot(row, seen);
            match t > 0.008856 {
                true => t.cbrt(),
                false => 7.787 * t + 16.0 / 116.0,
            }
        });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    #[test]
    fn verdicts_differ_for_everyone() {
        // Machado et al. 2009, table 1 at severity 1: full vision, and without red, green and blue cones.
        let eyes = [
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            [
                [0.152286, 1.052583, -0.204868],
                [0.114503, 0.786281, 0.099216],
                [-0.003882, -0.048116, 1.051998],
            ],
            [
                [0.367322, 0.860646, -0.227968],
                [0.280085, 0.672501, 0.047413],
                [-0.011820, 0.042940, 0.968881],
            ],
            [
                [1.255528, -0.076749, -0.178779],
                [-0.078411, 0.930809, 0.147602],
                [0.004733, 0.691367, 0.303900],
            ],
        ];
        for (one, other) in [(GOOD, DOUBTFUL), (DOUBTFUL, RED), (GOOD, RED)] {
            for eyes in eyes {
                let (a, b) = (lab(one, eyes), lab(other, eyes));
                let square = |i: usize| (a[i] - b[i]) * (a[i] - b[i]);
                let apart = (square(0) + square(1) + square(2)).sqrt();
                // 2.3 is just noticeable.
                assert!(apart > 25.0, "{one:?} and {other:?}: {apart:.1}");
            }
        }
    }
}
