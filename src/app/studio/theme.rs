//! Theme of the window: neutral greys, so that nothing competes with the picture.

use super::icons;
use egui::{
    Button, Color32, CornerRadius, FontDefinitions, FontId, Rect, Response, RichText, Stroke, StrokeKind, TextStyle,
    Ui, WidgetText,
};

/// Surround of the picture: middle grey, 18 % of white, which does not bias the eye.
pub const SURROUND: Color32 = Color32::from_gray(118);
/// Background of panels.
pub const PANEL: Color32 = Color32::from_gray(38);
/// Background of lists and tracks in a panel.
pub const WELL: Color32 = Color32::from_gray(24);
/// Text.
pub const TEXT: Color32 = Color32::from_gray(222);
/// Secondary text.
pub const QUIET: Color32 = Color32::from_gray(170);
/// Background of text over a picture.
pub const OVER_PICTURE: Color32 = Color32::from_black_alpha(205);
/// Colour of selected, dragged or active things, and nothing else.
pub const ACCENT: Color32 = Color32::from_rgb(232, 170, 76);
/// Colour of faults that need attention, and of the verdict "bad". Words always accompany it.
pub const WARNING: Color32 = Color32::from_rgb(252, 131, 121);
/// Colour of the verdict "doubtful", and of minor problems.
pub const DOUBTFUL: Color32 = Color32::from_rgb(255, 250, 150);
/// Colour of the verdict "good", and of states that need no action.
pub const GOOD: Color32 = Color32::from_rgb(64, 226, 176);
/// Fill of a main button and of a job's progress. Text on it is white.
pub const PRIMARY: Color32 = Color32::from_rgb(50, 116, 180);
/// Colour of frames with a cached prediction.
pub const CACHED: Color32 = Color32::from_rgb(108, 147, 192);
/// Colour of keys.
pub const KEY: Color32 = Color32::from_rgb(255, 192, 248);
/// Colour of the viewing settings, which are not exported.
pub const VIEWING: Color32 = Color32::from_rgb(178, 149, 255);
/// Opacity of a disabled control, which must stay readable.
const DISABLED: f32 = 0.65;
/// Opacity of a scroll bar away from the pointer.
const SCROLL_BAR: f32 = 0.5;
/// Greys of a button (normal, under the pointer, pressed or selected) and of alternate rows.
const BUTTON: u8 = 54;
const HOVERED: u8 = 60;
const CHOSEN: u8 = 92;
const FAINT: u8 = 44;
/// Background of a card in a panel.
pub const CARD: Color32 = Color32::from_gray(46);
/// Colour of an icon in place of a picture.
pub const PLACEHOLDER: Color32 = Color32::from_gray(130);
/// Backgrounds of a row under the pointer, and of the selected row.
pub const ROW_HOVERED: Color32 = Color32::from_gray(52);
pub const ROW_CHOSEN: Color32 = Color32::from_gray(60);
/// Spacing in points.
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
        // Visible without the pointer, over the gap that panels leave.
        style.spacing.scroll.floating_width = 4.0;
        style.spacing.scroll.dormant_handle_opacity = SCROLL_BAR;
        style.interaction.selectable_labels = false;
        // Animations would request frames while nothing happens.
        style.animation_time = 0.0;
        let visuals = &mut style.visuals;
        visuals.panel_fill = PANEL;
        visuals.window_fill = PANEL;
        visuals.extreme_bg_color = WELL;
        visuals.faint_bg_color = Color32::from_gray(FAINT);
        visuals.weak_text_color = Some(QUIET);
        visuals.hyperlink_color = TEXT;
        visuals.disabled_alpha = DISABLED;
        visuals.warn_fg_color = WARNING;
        visuals.selection.bg_fill = Color32::from_gray(CHOSEN);
        visuals.selection.stroke = Stroke::new(1.0, Color32::WHITE);
        let widgets = &mut visuals.widgets;
        widgets.noninteractive.fg_stroke.color = TEXT;
        widgets.noninteractive.bg_stroke.color = Color32::from_gray(58);
        for (widget, fill) in [
            (&mut widgets.inactive, BUTTON),
            (&mut widgets.hovered, HOVERED),
            (&mut widgets.active, CHOSEN),
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

/// The main button of a pane; while disabled, it looks like any other.
pub fn main_button(enabled: bool, words: impl Into<String>) -> Button<'static> {
    let words = RichText::new(words);
    if enabled { Button::new(words.color(Color32::WHITE)).fill(PRIMARY) } else { Button::new(words) }
}

/// Marks the focus of the keyboard on a control that paints itself into `rect`, as buttons do.
pub fn focus_ui(ui: &Ui, rect: Rect, response: &Response) {
    if response.has_focus() {
        let stroke = ui.visuals().widgets.active.bg_stroke;
        ui.painter().rect_stroke(rect, 3.0, stroke, StrokeKind::Inside);
    }
}

/// Hint of a control that can be dragged, hidden during a drag.
pub fn hint_at_rest_ui(response: Response, hint: impl Into<WidgetText>) -> Response {
    if response.dragged() { response } else { response.on_hover_text(hint) }
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

    /// Colours with a meaning, and their names.
    const MEANINGS: [(&str, Color32); 7] = [
        ("active", ACCENT),
        ("wrong", WARNING),
        ("doubtful", DOUBTFUL),
        ("good", GOOD),
        ("cached", CACHED),
        ("key", KEY),
        ("viewing", VIEWING),
    ];

    /// `over`, possibly transparent, on an opaque ground.
    fn blended(over: Color32, ground: Color32) -> Color32 {
        let (over, ground) = (over.to_array(), ground.to_array());
        let open = f32::from(255 - over[3]) / 255.0;
        let mix = |c: usize| (f32::from(over[c]) + open * f32::from(ground[c])) as u8;
        Color32::from_rgb(mix(0), mix(1), mix(2))
    }

    #[test]
    fn what_has_to_be_read_stands_out_from_every_ground_that_it_stands_on() {
        let grey = Color32::from_gray;
        let over = [Color32::BLACK, SURROUND, Color32::WHITE].map(|g| blended(OVER_PICTURE, g));
        let mut pairs: Vec<(Color32, Color32)> = Vec::new();
        let mut on = |text: &[Color32], grounds: &[Color32]| {
            pairs.extend(text.iter().flat_map(|&t| grounds.iter().map(move |&g| (t, g))));
        };
        on(
            &[TEXT],
            &[PANEL, WELL, grey(FAINT), grey(BUTTON), grey(HOVERED), grey(CHOSEN), CARD, ROW_HOVERED, ROW_CHOSEN],
        );
        on(&[TEXT], &over);
        let raised = [grey(FAINT), CARD, ROW_HOVERED, ROW_CHOSEN];
        let buttons = [grey(BUTTON), grey(HOVERED)];
        on(&[QUIET], &[&[PANEL, WELL], &raised[..], &buttons].concat());
        let white = [grey(CHOSEN), grey(HOVERED), ROW_CHOSEN, PANEL, WELL, PRIMARY];
        on(&[Color32::WHITE], &white);
        on(&MEANINGS.map(|(_, color)| color), &[PANEL, WELL]);
        // Verdicts appear in lists and on buttons, and active items under the pointer.
        let written = [ACCENT, WARNING, DOUBTFUL, GOOD, VIEWING];
        on(&written, &[&raised[..], &buttons].concat());
        on(&[ACCENT, WARNING, VIEWING], &over);
        for (text, ground) in pairs {
            let found = contrast(text, ground);
            assert!(found >= 4.5, "{text:?} on {ground:?}: {found:.2}");
        }
        // WCAG 2.2 requires 3:1 for icons and bars.
        for (drawn, ground) in [(ACCENT, grey(CHOSEN)), (PRIMARY, PANEL), (PRIMARY, WELL), (PLACEHOLDER, CARD)] {
            let found = contrast(drawn, ground);
            assert!(found >= 3.0, "{drawn:?} on {ground:?}: {found:.2}");
        }
        let faded = |color: Color32| {
            let mix = |c: usize| {
                let [color, panel] = [color, PANEL].map(|color| f32::from(color.to_array()[c]));
                (panel + DISABLED * (color - panel)) as u8
            };
            Color32::from_rgb(mix(0), mix(1), mix(2))
        };
        let disabled = contrast(faded(TEXT), faded(grey(BUTTON)));
        assert!(disabled >= 4.5, "{disabled:.2}");
    }

    /// CIELAB of a colour as a person sees it. `eyes`: matrix from linear RGB to the linear RGB that the person
    /// perceives.
    fn lab(color: Color32, eyes: [[f32; 3]; 3]) -> [f32; 3] {
        let [r, g, b, _] = color.to_array();
        let rgb = [r, g, b].map(|code| linear_from_srgb(f32::from(code) / 255.0));
        let dot = |row: [f32; 3], v: [f32; 3]| row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
        let seen = eyes.map(|row| dot(row, rgb).clamp(0.0, 1.0));
        let [x, y, z] = [[0.4339, 0.3762, 0.1899], [0.2126, 0.7152, 0.0722], [0.0177, 0.1095, 0.8728]].map(|row| {
            let t = dot(row, seen);
            if t > 0.008856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 }
        });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    #[test]
    fn colours_that_mean_something_differ_for_everyone() {
        // Machado et al. 2009, table 1 at severity 1: full vision, and without red, green and blue cones.
        let eyes = [
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
            [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
            [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
        ];
        for (place, (one, a)) in MEANINGS.into_iter().enumerate() {
            for (other, b) in &MEANINGS[place + 1..] {
                for eyes in eyes {
                    let (a, b) = (lab(a, eyes), lab(*b, eyes));
                    let square = |i: usize| (a[i] - b[i]) * (a[i] - b[i]);
                    let apart = (square(0) + square(1) + square(2)).sqrt();
                    // 2.3 is just noticeable.
                    assert!(apart > 20.0, "{one} and {other}: {apart:.1}");
                }
            }
        }
    }
}
