//! Histogram, waveform, parade and vectorscope of the picture or of a region, and the pixel under the cursor: its values, and the
//! light from each lamp.

use crate::command::{Command, ViewCommand};
use crate::panel_context::PanelContext;
use crate::panels::missing::no_picture_ui;
use crate::panels::viewport::readout::{REGION_HINT, Reading, RegionReadings, readings};
use crate::region::Region;
use crate::theme::{self, GAP};
use egui::{
    Align2, Color32, ColorImage, FontId, Pos2, Rect, RichText, Role, Sense, Stroke, TextureHandle,
    TextureOptions, Ui, Vec2, WidgetInfo, pos2, vec2,
};
use imaging::color::luminance;
use std::borrow::Cow;
use std::sync::Arc;
use worker::PreviewPicture;

/// Columns and levels of the waveform.
const WAVEFORM: [usize; 2] = [192, 96];
/// Columns and rows of the vectorscope.
const VECTORS: usize = 128;
/// How far from the middle the vectorscope reaches, in units of Cb and Cr: 75 % bars are inside.
const REACH: f32 = 0.5;
/// The angle of skin in the vectorscope, from +Cb towards +Cr: the I axis of NTSC.
const SKIN_DEG: f32 = 123.0;
const COLORS: [Color32; 3] = [
    Color32::from_rgb(220, 90, 80),
    Color32::from_rgb(90, 190, 100),
    Color32::from_rgb(90, 140, 230),
];

/// What is drawn of the picture's codes besides the histogram.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
enum Scope {
    #[default]
    Waveform,
    Parade,
    Vectorscope,
}

impl Scope {
    const ALL: [(Self, &'static str, &'static str); 3] = [
        (
            Self::Waveform,
            "Waveform",
            "How bright each column of the picture is",
        ),
        (
            Self::Parade,
            "Parade",
            "How bright red, green and blue are in each column",
        ),
        (
            Self::Vectorscope,
            "Vectors",
            "Hue as direction, saturation as distance from the middle; skin lies along the line",
        ),
    ];
}

/// The panel, with the scopes of the newest picture.
#[derive(Default)]
pub struct ScopesPanel {
    scope: Scope,
    found: Option<Found>,
    means: RegionReadings,
}

struct Found {
    of: Arc<PreviewPicture>,
    scope: Scope,
    region: Option<Region>,
    histogram: Histogram,
    texture: TextureHandle,
}

/// Pixels per 8-bit code, for each channel.
type Histogram = [[u32; 256]; 3];

impl ScopesPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let Some(relit) = context.relit else {
            return no_picture_ui(ui, context, "No picture yet", out);
        };
        let scope = self.scope;
        let region = context.state.region;
        let is_this = |found: &Found| {
            Arc::ptr_eq(&found.of, relit) && (found.scope, found.region) == (scope, region)
        };
        // A picture that is on the GPU alone was asked for before this pane was visible; its codes follow.
        if !self.found.as_ref().is_some_and(is_this) && !relit.rgb.is_empty() {
            let (rgb, width) = codes(relit, region);
            let picture = match scope {
                Scope::Waveform => waveform(&rgb, width),
                Scope::Parade => parade(&rgb, width),
                Scope::Vectorscope => vectorscope(&rgb),
            };
            self.found = Some(Found {
                of: relit.clone(),
                scope,
                region,
                histogram: histogram(&rgb),
                texture: ui
                    .ctx()
                    .load_texture("scope", picture, TextureOptions::NEAREST),
            });
        }
        if let Some(found) = &self.found {
            ui.label(RichText::new("Histogram").color(theme::QUIET));
            histogram_ui(ui, &found.histogram);
            ui.label(
                RichText::new(clipped(&found.histogram))
                    .size(12.0)
                    .color(theme::QUIET),
            )
            .on_hover_text("Pixels of which a channel is at the end of its range");
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 2.0;
                for (one, name, hint) in Scope::ALL {
                    ui.selectable_value(&mut self.scope, one, name)
                        .on_hover_text(hint);
                }
            });
            match found.scope {
                Scope::Vectorscope => vectors_ui(ui, &found.texture),
                scope => levels_ui(ui, &found.texture, scope == Scope::Parade),
            }
        }
        ui.add_space(GAP);
        match region {
            Some(region) => {
                let [columns, rows] = region.size();
                let Region { left, top, .. } = region;
                let text = format!("Mean of {columns} × {rows} pixels at {left}, {top}");
                ui.label(RichText::new(text).color(theme::QUIET))
                    .on_hover_text(REGION_HINT);
                readings_ui(ui, self.means.of(context, relit, region));
            }
            None => {
                let hint = "Ctrl+Shift+drag: mean of a region";
                ui.label(RichText::new(hint).color(theme::QUIET))
                    .on_hover_text(REGION_HINT);
            }
        }
        pixel_ui(ui, context, relit, out);
    }
}

/// The codes that are counted: the picture's, or a region's; and how many columns they have.
fn codes(relit: &PreviewPicture, region: Option<Region>) -> (Cow<'_, [u8]>, usize) {
    let columns = relit.rgb_size[0];
    let size = [relit.width, relit.height];
    let Some(region) = region.and_then(|region| region.inside(size)) else {
        return (Cow::Borrowed(&relit.rgb), columns);
    };
    let region = region.scaled(size, relit.rgb_size);
    let pixels = region.of(relit.rgb.as_chunks::<3>().0, columns);
    (pixels.flatten().copied().collect(), region.size()[0])
}

/// How much of the picture is clipped.
fn clipped(histogram: &Histogram) -> String {
    let all = histogram[0].iter().sum::<u32>().max(1) as f32;
    let share = |code: usize| {
        let each = histogram.iter().map(|counts| counts[code]);
        100.0 * each.max().unwrap_or(0) as f32 / all
    };
    format!(
        "clipped: {:.1} % white, {:.1} % black",
        share(255),
        share(0)
    )
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

/// How often each level occurs in each column of a picture's values, from 0 to 1; the brightest level comes first.
fn levels(values: impl Iterator<Item = f32>, width: usize, columns: usize) -> Vec<u32> {
    let rows = WAVEFORM[1];
    let width = width.max(1);
    let mut counts = vec![0u32; columns * rows];
    for (i, value) in values.enumerate() {
        let level = ((1.0 - value) * (rows - 1) as f32).round() as usize;
        let column = (i % width) * columns / width;
        counts[level.min(rows - 1) * columns + column] += 1;
    }
    counts
}

/// How bright a count is drawn, from 0 to 1: rare ones stay visible.
fn shade(count: u32, most: u32) -> f32 {
    match count {
        0 => 0.0,
        _ => (count as f32 / most.max(1) as f32).powf(0.4),
    }
}

fn most(counts: &[u32]) -> u32 {
    counts.iter().copied().max().unwrap_or(0)
}

/// How often each level of luma occurs in each column of the picture; bright means often.
fn waveform(rgb: &[u8], width: usize) -> ColorImage {
    let pixels = rgb.as_chunks::<3>().0.iter();
    let luma = pixels.map(|pixel| luminance(pixel.map(|code| f32::from(code) / 255.0)));
    let counts = levels(luma, width, WAVEFORM[0]);
    let most = most(&counts);
    let grey = |count: u32| Color32::from_gray((24.0 + 200.0 * shade(count, most)) as u8);
    ColorImage::new(WAVEFORM, counts.into_iter().map(grey).collect())
}

/// The same for red, green and blue, side by side.
fn parade(rgb: &[u8], width: usize) -> ColorImage {
    let [columns, rows] = WAVEFORM;
    let third = columns / 3;
    let mut picture = ColorImage::filled(WAVEFORM, theme::WELL);
    for (channel, color) in COLORS.into_iter().enumerate() {
        let codes = rgb.as_chunks::<3>().0.iter().map(|pixel| pixel[channel]);
        let counts = levels(codes.map(|code| f32::from(code) / 255.0), width, third);
        let most = most(&counts);
        for (i, &count) in counts.iter().enumerate() {
            let share = shade(count, most);
            if share > 0.0 {
                let at = i / third * columns + channel * third + i % third;
                picture.pixels[at] = theme::WELL.lerp_to_gamma(color, 0.25 + 0.75 * share);
            }
        }
    }
    debug_assert_eq!(picture.pixels.len(), columns * rows);
    picture
}

/// Cb and Cr of codes (ITU-R BT.709), each from −0.5 to 0.5.
fn chroma([r, g, b]: [f32; 3]) -> [f32; 2] {
    let luma = luminance([r, g, b]);
    [(b - luma) / 1.8556, (r - luma) / 1.5748]
}

/// How often each chroma occurs: Cb to the right, Cr up.
fn vectorscope(rgb: &[u8]) -> ColorImage {
    let mut counts = vec![0u32; VECTORS * VECTORS];
    for pixel in rgb.as_chunks::<3>().0 {
        let [cb, cr] = chroma(pixel.map(|code| f32::from(code) / 255.0));
        let place = |share: f32| {
            let place = (0.5 + 0.5 * share / REACH) * (VECTORS - 1) as f32;
            place.round().clamp(0.0, (VECTORS - 1) as f32) as usize
        };
        counts[place(-cr) * VECTORS + place(cb)] += 1;
    }
    // Grey pixels do not set the scale: they would hide everything else.
    let middle = VECTORS / 2;
    let colored = counts
        .iter()
        .enumerate()
        .filter(|(i, _)| (i / VECTORS).abs_diff(middle) > 1 || (i % VECTORS).abs_diff(middle) > 1);
    let most = colored.map(|(_, &count)| count).max().unwrap_or(0);
    let grey = |count: u32| {
        let share = shade(count, most).min(1.0);
        Color32::from_gray((24.0 + 216.0 * share) as u8)
    };
    ColorImage::new([VECTORS; 2], counts.into_iter().map(grey).collect())
}

/// A waveform or parade with its scale in percent of white.
fn levels_ui(ui: &mut Ui, texture: &TextureHandle, is_parade: bool) {
    let size = vec2(ui.available_width(), 110.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let name = if is_parade {
        "RGB parade"
    } else {
        "Waveform scope"
    };
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
    let inner = rect.with_min_x(rect.left() + 26.0);
    whole_ui(ui, texture, inner);
    let line = Stroke::new(1.0, Color32::from_white_alpha(40));
    for percent in [0, 25, 50, 75, 100] {
        let y = inner.bottom() - inner.height() * percent as f32 / 100.0;
        ui.painter().hline(inner.x_range(), y, line);
        let align = match percent {
            0 => Align2::LEFT_BOTTOM,
            100 => Align2::LEFT_TOP,
            _ => Align2::LEFT_CENTER,
        };
        let font = FontId::proportional(10.0);
        ui.painter()
            .text(pos2(rect.left(), y), align, percent, font, theme::QUIET);
    }
}

fn whole_ui(ui: &Ui, texture: &TextureHandle, rect: Rect) {
    let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
    ui.painter()
        .image(texture.id(), rect, whole, Color32::WHITE);
}

/// The vectorscope with its circle, the six colours at 75 %, and the line of skin.
fn vectors_ui(ui: &mut Ui, texture: &TextureHandle) {
    let side = ui.available_width().min(220.0);
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(side), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Vectorscope"));
    whole_ui(ui, texture, rect);
    let painter = ui.painter().with_clip_rect(rect);
    let line = Stroke::new(1.0, Color32::from_white_alpha(60));
    let radius = 0.5 * side;
    painter.circle_stroke(rect.center(), radius - 1.0, line);
    let to_skin = SKIN_DEG.to_radians();
    let skin = rect.center() + radius * vec2(to_skin.cos(), -to_skin.sin());
    painter.line_segment([rect.center(), skin], Stroke::new(1.0, theme::ACCENT));
    let font = FontId::proportional(10.0);
    for (name, color) in [
        ("R", [0.75, 0.0, 0.0]),
        ("Y", [0.75, 0.75, 0.0]),
        ("G", [0.0, 0.75, 0.0]),
        ("C", [0.0, 0.75, 0.75]),
        ("B", [0.0, 0.0, 0.75]),
        ("M", [0.75, 0.0, 0.75]),
    ] {
        let [cb, cr] = chroma(color);
        let at = rect.center() + radius / REACH * vec2(cb, -cr);
        painter.rect_stroke(
            Rect::from_center_size(at, Vec2::splat(8.0)),
            0.0,
            line,
            egui::StrokeKind::Middle,
        );
        painter.text(at, Align2::CENTER_CENTER, name, font.clone(), theme::QUIET);
    }
}

fn histogram_ui(ui: &mut Ui, histogram: &Histogram) {
    let size = vec2(ui.available_width(), 90.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Histogram"));
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
    readings_ui(ui, &readings(context, relit, Region::pixel([x, y])));
    if let Some(texel) = context.texel {
        lamps_ui(ui, texel, context, relit, out);
    }
}

/// The readings of each picture.
fn readings_ui(ui: &mut Ui, found: &[Reading]) {
    let row = |ui: &mut Ui, name: &str, values: String| {
        ui.horizontal(|ui| {
            ui.label(RichText::new(name).size(13.0));
            ui.label(RichText::new(values).monospace().size(12.0));
        });
    };
    for reading in found {
        if found.len() > 1 {
            ui.label(RichText::new(&reading.name).size(13.0).color(theme::QUIET));
        }
        row(ui, "Codes", reading.codes_text());
        if let Some([r, g, b]) = reading.linear {
            row(ui, "Linear", format!("{r:.4} {g:.4} {b:.4}"));
        }
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
        assert_eq!(
            clipped(&histogram(&rgb)),
            "clipped: 0.4 % white, 0.4 % black"
        );
    }

    #[test]
    fn each_colour_has_its_third_of_the_parade_and_its_place_among_the_vectors() {
        let red: Vec<u8> = [191, 0, 0].repeat(64);
        let parade = parade(&red, 64);
        let [columns, rows] = WAVEFORM;
        let level = |third: usize| {
            let column = third * columns / 3;
            (0..rows).find(|row| parade.pixels[row * columns + column] != theme::WELL)
        };
        let three_quarters = (0.25 * (rows - 1) as f32).round() as usize;
        assert_eq!(level(0), Some(three_quarters));
        assert_eq!((level(1), level(2)), (Some(rows - 1), Some(rows - 1)));

        let vectors = vectorscope(&red);
        let brightest = (0..vectors.pixels.len()).max_by_key(|&i| vectors.pixels[i].r());
        let brightest = brightest.unwrap();
        let (x, y) = (brightest % VECTORS, brightest / VECTORS);
        // Cb = −0.086, Cr = 0.375 at three quarters.
        assert!(x.abs_diff(53) <= 1 && y.abs_diff(16) <= 1, "{x}, {y}");
        // Skin lies near its line.
        let [cb, cr] = chroma([0.80, 0.60, 0.50]);
        let off = cr.atan2(cb).to_degrees() - SKIN_DEG;
        assert!(off.abs() < 12.0, "{off}");
    }
}
