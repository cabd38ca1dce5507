//! The pixel under the cursor, and what false colours mean.

use super::toolbar;
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use compositor::{CLIPPED, LEGEND, code};
use egui::text::LayoutJob;
use egui::{Align2, Color32, FontId, Rect, Role, Sense, TextFormat, Ui, WidgetInfo, vec2};
use imaging::color::byte_from_unit;
use scene::Inspection;
use worker::{PreviewPicture, SrgbPicture};

/// The strip's height in points.
pub const HEIGHT: f32 = 24.0;

/// What a pixel of one of the two pictures is.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The picture's name.
    pub name: String,
    /// Its 8-bit codes.
    pub codes: [u8; 3],
    /// Its scene-linear light, where that is known.
    pub linear: Option<[f32; 3]>,
}

impl Reading {
    /// The codes, and the light if it is known.
    pub fn text(&self) -> String {
        let [r, g, b] = self.codes;
        let light = self.linear.map_or(String::new(), |[r, g, b]| {
            format!("   linear {r:.4} {g:.4} {b:.4}")
        });
        format!("{r:3} {g:3} {b:3}{light}")
    }
}

/// The readings of a pixel: of the picture, or of what is shown in its place, and of what that is compared with. Channels and
/// false colours are read as the picture that they are of.
pub fn readings(context: &PanelContext, relit: &PreviewPicture, at: [usize; 2]) -> Vec<Reading> {
    let compare = &context.state.compare;
    let pixel = |codes: &SrgbPicture| {
        let place = at[1] * codes.width + at[0];
        codes.rgb.as_chunks::<3>().0.get(place).copied()
    };
    let linear = relit.linear.as_ref();
    let linear = linear.and_then(|linear| linear.pixels.get(at[1] * relit.width + at[0]).copied());
    let effects = relit.scene.effects;
    let first = match (&relit.first, &compare.first) {
        (Some((_, codes)), Some(with)) => pixel(codes).map(|codes| Reading {
            name: toolbar::name(with, context),
            codes,
            linear: None,
        }),
        _ => {
            let codes = match (effects.inspection, linear) {
                (Inspection::Picture, _) | (_, None) => relit.codes(at),
                (_, Some(light)) => Some(code(light, effects.view).map(byte_from_unit)),
            };
            codes.map(|codes| Reading {
                name: "relit".to_owned(),
                codes,
                linear,
            })
        }
    };
    let second = relit.second.as_ref().filter(|_| compare.on);
    let second = second
        .and_then(|(_, codes)| pixel(codes))
        .map(|codes| Reading {
            name: toolbar::name(&compare.reference, context),
            codes,
            linear: None,
        });
    first.into_iter().chain(second).collect()
}

/// The strip below the picture: frame, light, and the pixel in both pictures. The one under the cursor is bright.
pub fn strip_ui(ui: &Ui, rect: Rect, context: &PanelContext, relit: &PreviewPicture, second: bool) {
    ui.painter().rect_filled(rect, 0.0, theme::WELL);
    let state = context.state;
    let light = match state.solo.first() {
        Some(&lamp) => format!("{} alone", context.lamps_named(lamp)),
        None if relit.scene.lighting.is_solo() => {
            format!("{} alone", relit.scene.lighting.solo_titles().join(", "))
        }
        None => relit.environment.clone(),
    };
    let mut job = LayoutJob::default();
    let mut add = |text: &str, color| {
        let font_id = FontId::monospace(12.0);
        job.append(
            text,
            0.0,
            TextFormat {
                font_id,
                color,
                ..TextFormat::default()
            },
        );
    };
    add(
        &format!("frame {}   {light}", relit.scene.frame),
        theme::QUIET,
    );
    let found = state.probed.map(|at| (at, readings(context, relit, at)));
    if let Some(([x, y], found)) = found {
        add(&format!("   {x:4},{y:4}"), theme::QUIET);
        let two = found.len() > 1;
        for (place, reading) in found.iter().enumerate() {
            let color = match two && (place == 1) != second {
                true => theme::QUIET,
                false => theme::TEXT,
            };
            let name = match two {
                true => format!("   {} {}  ", ["A", "B"][place], reading.name),
                false => "   ".to_owned(),
            };
            add(&name, theme::QUIET);
            add(&reading.text(), color);
        }
    }
    job.wrap.max_width = rect.width() - 2.0 * GAP;
    job.wrap.max_rows = 1;
    let text = job.text.clone();
    let galley = ui.painter().layout_job(job);
    let at =
        Align2::LEFT_CENTER.align_size_within_rect(galley.size(), rect.shrink2(vec2(GAP, 0.0)));
    ui.painter().galley(at.min, galley, theme::QUIET);
    let response = ui.interact(rect, ui.scope_id().with("readout"), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &text));
    response.on_hover_text(
        "The pixel under the cursor: 8-bit codes as they are shown, then scene-linear light. A and B are the two \
         pictures that are compared.",
    );
}

/// What false colours mean, in a corner of the picture.
pub fn legend_ui(ui: &Ui, rect: Rect) {
    const ROW: f32 = 17.0;
    let clipped = (Some(CLIPPED), "clipped: white or brighter");
    let zones = LEGEND.map(|zone| (zone.color, zone.name));
    let rows: Vec<_> = std::iter::once(clipped)
        .chain(zones.into_iter().rev())
        .collect();
    let painter = ui.painter().with_clip_rect(rect);
    let font = FontId::proportional(12.0);
    let size = vec2(250.0, ROW * rows.len() as f32 + GAP);
    let back = Align2::RIGHT_TOP.align_size_within_rect(size, rect.shrink(GAP));
    painter.rect_filled(back, 3.0, Color32::from_black_alpha(200));
    for (row, (color, name)) in rows.into_iter().enumerate() {
        let corner = back.min + vec2(GAP, 0.5 * GAP + ROW * row as f32);
        let swatch = Rect::from_min_size(corner + vec2(0.0, 3.0), vec2(18.0, ROW - 6.0));
        let [r, g, b] = color.unwrap_or([0.5; 3]).map(byte_from_unit);
        painter.rect_filled(swatch, 1.0, Color32::from_rgb(r, g, b));
        let at = corner + vec2(26.0, 0.5 * ROW);
        painter.text(at, Align2::LEFT_CENTER, name, font.clone(), theme::TEXT);
    }
}
