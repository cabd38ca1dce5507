//! Histogram, waveform, and the pixel under the cursor: its values, and the light from each lamp.

use crate::command::{Command, ViewCommand};
use crate::panel_context::PanelContext;
use crate::panels::missing::no_picture_ui;
use crate::theme::{self, GAP};
use egui::{Color32, Pos2, Rect, RichText, Sense, TextureHandle, Ui, pos2, vec2};
use imaging::color::luminance;
use std::sync::Arc;
use worker::PreviewPicture;

/// Columns and levels of the waveform.
const WAVEFORM: [usize; 2] = [128, 64];
const COLORS: [Color32; 3] = [
    Color32::from_rgb(220, 90, 80),
    Color32::from_rgb(90, 190, 100),
    Color32::from_rgb(90, 140, 230),
];

/// The panel, with the scopes of the newest picture.
#[derive(Default)]
pub struct ScopesPanel {
    found: Option<(Arc<PreviewPicture>, Histogram, TextureHandle)>,
}

/// Pixels per 8-bit code, for each channel.
type Histogram = [[u32; 256]; 3];

impl ScopesPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let Some(relit) = context.relit else {
            return no_picture_ui(ui, context, "No picture yet", out);
        };
        let known = (self.found.as_ref()).is_some_and(|(of, ..)| Arc::ptr_eq(of, relit));
        // A picture that is on the GPU alone was asked for before this pane was visible; its codes follow.
        if !known && !relit.rgb.is_empty() {
            let waveform = ui.ctx().load_texture(
                "waveform",
                waveform(&relit.rgb, relit.rgb_size[0]),
                egui::TextureOptions::NEAREST,
            );
            self.found = Some((relit.clone(), histogram(&relit.rgb), waveform));
        }
        if let Some((_, histogram, waveform)) = &self.found {
            ui.label(RichText::new("Histogram").color(theme::QUIET));
            histogram_ui(ui, histogram);
            ui.label(RichText::new("Waveform").color(theme::QUIET));
            let size = vec2(ui.available_width(), 90.0);
            let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Waveform"));
            let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            ui.painter()
                .image(waveform.id(), rect, whole, Color32::WHITE);
        }
        pixel_ui(ui, context, relit, out);
    }
}

fn histogram(rgb: &[u8]) -> Histogram {
    let mut counts = [[0; 256]; 3];
    for pixel in rgb.as_chunks::<3>().0 {
        for (counts, &code) in counts.iter_mut().zip(pixel) {
            counts[usize::from(code)] += 1;
        }
    }
    counts
}

/// How often each level of luma occurs in each column of the picture; bright means often.
fn waveform(rgb: &[u8], width: usize) -> egui::ColorImage {
    let [columns, levels] = WAVEFORM;
    let mut counts = vec![0u32; columns * levels];
    for (i, pixel) in rgb.as_chunks::<3>().0.iter().enumerate() {
        let luma = luminance(pixel.map(|code| f32::from(code) / 255.0));
        let level = ((1.0 - luma) * (levels - 1) as f32).round() as usize;
        let column = (i % width.max(1)) * columns / width.max(1);
        counts[level.min(levels - 1) * columns + column] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(0).max(1) as f32;
    let shade = |count: u32| {
        // Keeps rare levels visible.
        let share = (count as f32 / most).powf(0.4);
        Color32::from_gray((24.0 + 200.0 * share) as u8)
    };
    egui::ColorImage::new(WAVEFORM, counts.into_iter().map(shade).collect())
}

fn histogram_ui(ui: &mut Ui, histogram: &Histogram) {
    let size = vec2(ui.available_width(), 90.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Histogram"));
    ui.painter().rect_filled(rect, 0.0, theme::WELL);
    // Clipped pixels do not set the scale: they would flatten everything else.
    let inner = histogram.iter().flat_map(|counts| &counts[1..255]);
    let most = inner.copied().max().unwrap_or(0).max(1) as f32;
    for (counts, color) in histogram.iter().zip(COLORS) {
        let line: Vec<Pos2> = (0..256)
            .map(|code| {
                let height = (counts[code] as f32 / most).min(1.0).sqrt();
                pos2(
                    rect.left() + code as f32 / 255.0 * rect.width(),
                    rect.bottom() - height * rect.height(),
                )
            })
            .collect();
        ui.painter()
            .add(egui::Shape::line(line, egui::Stroke::new(1.0, color)));
    }
}

fn pixel_ui(ui: &mut Ui, context: &PanelContext, relit: &PreviewPicture, out: &mut Vec<Command>) {
    ui.add_space(GAP);
    let Some([x, y]) = context.state.probed else {
        let hint = "Point at the picture to read a pixel";
        ui.label(RichText::new(hint).color(theme::QUIET));
        return;
    };
    ui.label(RichText::new(format!("Pixel {x}, {y}")).color(theme::QUIET));
    let at = y * relit.width + x;
    let row = |ui: &mut Ui, name: &str, values: String| {
        ui.horizontal(|ui| {
            ui.label(RichText::new(name).size(13.0));
            ui.label(RichText::new(values).monospace().size(12.0));
        });
    };
    if let Some([r, g, b]) = relit.codes([x, y]) {
        row(ui, "Codes", format!("{r:5} {g:5} {b:5}"));
    }
    let linear = relit.linear.as_ref().and_then(|l| l.pixels.get(at));
    if let Some([r, g, b]) = linear {
        row(ui, "Linear", format!("{r:.4} {g:.4} {b:.4}"));
    }
    if let Some(texel) = context.texel {
        lamps_ui(ui, texel, context, relit, out);
    }
}

/// The pixel's light from each lamp, as bars; a click shows that lamp alone.
fn lamps_ui(
    ui: &mut Ui,
    texel: &[[f32; 3]],
    context: &PanelContext,
    relit: &PreviewPicture,
    out: &mut Vec<Command>,
) {
    let light: Vec<[f32; 3]> = texel
        .iter()
        .zip(&relit.weights)
        .map(|(texel, weight)| std::array::from_fn(|c| texel[c] * weight[c]))
        .collect();
    let most = (light.iter().map(|&light| luminance(light))).fold(f32::MIN_POSITIVE, f32::max);
    ui.label(RichText::new("Light from each lamp").color(theme::QUIET));
    let size = vec2(ui.available_width(), 100.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Light by lamp"));
    ui.painter().rect_filled(rect, 0.0, theme::WELL);
    let step = rect.width() / light.len().max(1) as f32;
    let under = (response.hover_pos()).map(|at| ((at.x - rect.left()) / step) as usize);
    for (lamp, light) in light.iter().enumerate() {
        let height = (luminance(*light) / most).clamp(0.0, 1.0) * (rect.height() - 4.0);
        let left = rect.left() + lamp as f32 * step;
        let bar = Rect::from_min_max(
            pos2(left, rect.bottom() - height),
            pos2(left + (step - 1.0).max(1.0), rect.bottom()),
        );
        let chosen = context.state.solo.contains(&lamp) || under == Some(lamp);
        let color = if chosen { theme::ACCENT } else { theme::QUIET };
        ui.painter().rect_filled(bar, 0.0, color);
    }
    let Some(lamp) = under.filter(|&lamp| lamp < light.len()) else {
        return;
    };
    if response.clicked() {
        out.push(Command::View(ViewCommand::Solo(Some(lamp))));
    }
    let names = context.project.map(|project| &project.settings.shoot.lamps);
    let name = names.and_then(|names| names.get(lamp));
    let share = luminance(light[lamp]) / light.iter().map(|&l| luminance(l)).sum::<f32>();
    response.on_hover_text(format!(
        "{}: {:.1} % of this pixel's light. Click to show it alone.",
        name.map_or("lamp", |name| name),
        100.0 * share
    ));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scopes_count_every_pixel_at_its_level() {
        // A grey ramp, two rows.
        let row = (0..=255u8).flat_map(|code| [code; 3]);
        let rgb: Vec<u8> = row.clone().chain(row).collect();
        assert!(histogram(&rgb).iter().flatten().all(|&count| count == 2));
        let waveform = waveform(&rgb, 256);
        let [columns, levels] = WAVEFORM;
        let brightest = |column: usize| {
            (0..levels).max_by_key(|level| waveform.pixels[level * columns + column].r())
        };
        assert_eq!(brightest(0), Some(levels - 1));
        assert_eq!(brightest(columns - 1), Some(0));
    }
}
