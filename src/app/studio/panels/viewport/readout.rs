//! The pixel under the cursor or the means of a region, and the legend of false colours.

use super::side::Side;
use super::viewing;
use crate::command::{Command, ViewCommand, WindowCommand};
use crate::comparison::{CompareMode, CompareSettings};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::region::{Region, counted_rows, mean};
use crate::theme::{self, GAP};
use compositor::{CLIPPED, LEGEND, viewed_code};
use egui::text::LayoutJob;
use egui::{
    Align, Align2, Button, Color32, FontId, Layout, Rect, RichText, Role, Sense, TextFormat, Ui, UiBuilder, WidgetInfo,
    vec2,
};
use imaging::color::byte_from_unit;
use scene::Inspection;
use std::sync::Arc;
use worker::{PreviewPicture, SrgbPicture};

/// Keys that draw a region and leave it.
pub const REGION_HINT: &str =
    "Ctrl+Shift+drag over the picture reads the mean of a region; Esc or Ctrl+Shift+click ends that";

/// Height of a line of the strip in points, and width of its buttons.
const LINE: f32 = 17.0;
const BUTTONS: f32 = 150.0;

/// Height of the strip in points: a line for the picture, and a line for its readings.
pub const HEIGHT: f32 = 2.0 * LINE + 7.0;

/// Values of one pixel of one of the two pictures, or the mean of several pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The picture's name.
    pub name: String,
    /// 8-bit codes, 0 to 255.
    pub codes: [f32; 3],
    /// Scene-linear light, if known.
    pub linear: Option<[f32; 3]>,
    /// The values are a mean.
    pub is_mean: bool,
}

impl Reading {
    /// Text of the codes; a mean has one decimal.
    pub fn codes_text(&self) -> String {
        let ([r, g, b], tenths) = (self.codes, usize::from(self.is_mean));
        let width = 3 + 2 * tenths;
        format!("{r:width$.tenths$} {g:width$.tenths$} {b:width$.tenths$}")
    }

    /// Text of the codes, and of the light if known.
    pub fn text(&self) -> String {
        let light = self.linear.map_or(String::new(), |[r, g, b]| format!("   linear {r:.4} {g:.4} {b:.4}"));
        format!("{}{light}", self.codes_text())
    }
}

/// True if the picture changes from frame to frame of the window: it plays, or something is dragged.
pub fn moves(ui: &Ui, context: &PanelContext) -> bool {
    context.state.playback.playing || ui.input(|i| i.pointer.any_down())
}

/// Readings of a region, cached until the picture or the region changes: a region may have millions of pixels.
#[derive(Default)]
pub struct RegionReadings(Option<RegionReading>);

struct RegionReading {
    of: Arc<PreviewPicture>,
    region: Region,
    compared: CompareSettings,
    /// Row step: 1 reads all rows.
    step: usize,
    found: Vec<Reading>,
}

impl RegionReadings {
    /// The readings of a region of the newest picture. While the picture `moves`, only some rows of a large region are
    /// read.
    pub fn readings(
        &mut self,
        context: &PanelContext,
        relit: &Arc<PreviewPicture>,
        region: Region,
        moves: bool,
    ) -> &[Reading] {
        let compare = &context.state.compare;
        let step = counted_rows(region.size(), moves);
        let known = self.0.take().filter(|known| {
            Arc::ptr_eq(&known.of, relit) && known.region == region && known.compared == *compare && known.step <= step
        });
        let known = known.unwrap_or_else(|| RegionReading {
            of: relit.clone(),
            region,
            compared: compare.clone(),
            step,
            found: readings(context, relit, region, step),
        });
        &self.0.insert(known).found
    }
}

/// The readings of a region or of one pixel: of the picture or the one shown in its place, and of the picture to
/// compare. Channels and false colours give the readings of the picture behind them. Reads every `step`th row.
pub fn readings(context: &PanelContext, relit: &PreviewPicture, region: Region, step: usize) -> Vec<Reading> {
    let compare = &context.state.compare;
    let size = [relit.width, relit.height];
    let Some(region) = region.inside(size) else { return Vec::new() };
    let is_mean = region.size() != [1, 1];
    let codes = |rgb: &[u8], its_size: [usize; 2]| {
        let pixels = rgb.as_chunks::<3>().0;
        let pixels = (region.scaled(size, its_size)).every(step, pixels, its_size[0]);
        mean(pixels.map(|pixel| pixel.map(f32::from)))
    };
    let pixel = |shown: &SrgbPicture, whole: &Option<SrgbPicture>| {
        let picture = whole.as_ref().unwrap_or(shown);
        codes(&picture.rgb, [picture.width, picture.height])
    };
    let light = || {
        let linear = relit.linear.iter();
        linear.flat_map(move |linear| region.every(step, &linear.pixels, linear.width).copied())
    };
    let linear = mean(light());
    let effects = relit.scene.effects;
    let first = match (&relit.first, &compare.first) {
        (Some((_, codes)), Some(_)) => pixel(codes, &relit.whole[0]).map(|codes| Reading {
            name: Side::First.name(context, relit),
            codes,
            linear: None,
            is_mean,
        }),
        _ => {
            let shown = match (effects.inspection, linear) {
                (Inspection::Picture, _) | (_, None) => codes(&relit.rgb, relit.rgb_size),
                _ => mean(light().map(|light| {
                    let codes = viewed_code(light, &relit.scene).map(byte_from_unit);
                    codes.map(f32::from)
                })),
            };
            shown.map(|codes| Reading { name: "relit".to_owned(), codes, linear, is_mean })
        }
    };
    let second = relit.second.as_ref().filter(|_| compare.on);
    let second = second.and_then(|(_, codes)| pixel(codes, &relit.whole[1])).map(|codes| Reading {
        name: Side::Second.name(context, relit),
        codes,
        linear: None,
        is_mean,
    });
    first.into_iter().chain(second).collect()
}

/// Amount of detail in the text of a reading.
#[derive(Clone, Copy, PartialEq)]
enum Detail {
    All,
    /// Without the light.
    Codes,
    /// Without light and names.
    Letters,
}

impl Detail {
    /// Parts of the text of the readings, each with true if it is bright: the readings of the picture `shown`.
    fn parts(self, found: &[Reading], shown: usize) -> Vec<(String, bool)> {
        let two = found.len() > 1;
        let mut parts = Vec::new();
        for (place, reading) in found.iter().enumerate() {
            if two {
                let space = if place == 1 { "   " } else { "" };
                let name = match self {
                    Self::Letters => "",
                    _ => &reading.name,
                };
                let letter = ["A", "B"][place.min(1)];
                parts.push((format!("{space}{letter} {name}  "), false));
            }
            let text = match self {
                Self::All => reading.text(),
                _ => reading.codes_text(),
            };
            parts.push((text, place == shown));
        }
        parts
    }
}

/// Appends text to a line of the strip.
fn append(job: &mut LayoutJob, text: &str, color: Color32) {
    let format = TextFormat { font_id: FontId::monospace(12.0), color, ..TextFormat::default() };
    job.append(text, 0.0, format);
}

/// The strip below the picture: frame, light, and the region or the pixel in both pictures. The one under the cursor is bright:
/// the `second` of two, or the first. `scale` is in points per pixel of the picture.
pub fn strip_ui(
    ui: &mut Ui,
    rect: Rect,
    context: &PanelContext,
    relit: &Arc<PreviewPicture>,
    (second, scale): (bool, f32),
    means: &mut RegionReadings,
    out: &mut Vec<Command>,
) {
    ui.painter().rect_filled(rect, 0.0, theme::WELL);
    let buttons = Rect::from_min_max(rect.right_top() - vec2(BUTTONS, 0.0), rect.max);
    let state = context.state;
    let light = match state.solo.first() {
        Some(&lamp) => format!("solo {}", context.lamps_named(lamp)),
        None if relit.scene.lighting.is_solo() => {
            format!("solo {}", relit.scene.lighting.solo_titles().join(", "))
        }
        None => relit.environment.clone(),
    };
    let mut first = LayoutJob::default();
    let mut add = |text: &str, color| append(&mut first, text, color);
    let (frame, effects) = (relit.scene.frame, relit.scene.effects);
    add(&format!("frame {frame}   {light}"), theme::QUIET);
    let gain = state.display.gain;
    let differs = state.compare.on && state.compare.mode == CompareMode::Difference;
    if differs {
        add(&format!("   difference × {gain}"), theme::QUIET);
    }
    if let Some(words) = viewing::words(&relit.scene.viewing, effects.inspection) {
        add(&format!("   {words}"), theme::VIEWING);
    }
    let pixel;
    let found = match (state.viewport.region, state.viewport.probed) {
        (Some(region), _) => {
            let [columns, rows] = region.size();
            let found = means.readings(context, relit, region, moves(ui, context));
            add(&format!("   mean of {columns} × {rows}"), theme::QUIET);
            found
        }
        (None, Some([x, y])) => {
            add(&format!("   {x:4},{y:4}"), theme::QUIET);
            pixel = readings(context, relit, Region::pixel([x, y]), 1);
            pixel.as_slice()
        }
        (None, None) => &[],
    };
    // The bright reading, and the longest text that fits.
    let shown = usize::from(second).min(found.len().saturating_sub(1));
    let right = rect.right() - GAP;
    let values = [Detail::All, Detail::Codes, Detail::Letters].map(|detail| {
        let mut job = LayoutJob::default();
        for (text, is_bright) in detail.parts(found, shown) {
            append(&mut job, &text, if is_bright { theme::TEXT } else { theme::QUIET });
        }
        job
    });
    let text = format!("{}   {}", first.text, values[0].text);
    let line = |place: usize| rect.min + vec2(GAP, 3.0 + LINE * place as f32);
    let draw = |mut job: LayoutJob, place: usize, right: f32| {
        let at = line(place);
        job.wrap.max_width = right - at.x;
        (job.wrap.max_rows, job.wrap.break_anywhere) = (1, true);
        let galley = ui.painter().layout_job(job);
        ui.painter().galley(at, galley, theme::QUIET);
    };
    draw(first, 0, buttons.left());
    let room = right - line(1).x;
    let fits = |job: &LayoutJob| ui.painter().layout_job(job.clone()).size().x <= room;
    let [all, codes, letters] = values;
    let values = [all, codes].into_iter().find(fits).unwrap_or(letters);
    draw(values, 1, right);
    let response = ui.interact(rect, ui.scope_id().with("readout"), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, text.trim_end()));
    let mut hint = "The pixel under the cursor: 8-bit codes as shown, then scene-linear light. A and B are the \
                    two compared pictures. Codes include the viewing settings, light does not. "
        .to_owned()
        + REGION_HINT;
    if differs {
        hint += &format!(". The difference is shown × {gain}");
    }
    response.on_hover_text(hint);
    buttons_ui(ui, buttons, scale, context, out);
}

/// Loop, zoom and fit buttons, at the right end of the strip. `scale` is in points per pixel of the picture.
fn buttons_ui(ui: &mut Ui, rect: Rect, scale: f32, context: &PanelContext, out: &mut Vec<Command>) {
    // Beside the first line only.
    let rect = rect.with_max_y(rect.top() + LINE + 3.0).shrink2(vec2(GAP, 1.0));
    ui.scope_builder(UiBuilder::new().max_rect(rect), |ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.spacing_mut().button_padding = vec2(6.0, 0.0);
            ui.spacing_mut().interact_size.y = 18.0;
            let hint = "One pixel of the picture on one pixel of the screen. Key: 1";
            if ui.small_button("1:1").on_hover_text(hint).clicked() {
                out.push(Command::Window(WindowCommand::ActualSize));
            }
            let fit = Button::new(RichText::new(icons::FIT).size(13.0));
            if icons::named_ui(ui, true, fit, "Fit").on_hover_text("Fits the picture to the pane. Key: F").clicked() {
                out.push(Command::View(ViewCommand::Fit));
            }
            let loops = context.state.playback.loops;
            let color = if loops { theme::ACCENT } else { theme::TEXT };
            let icon = RichText::new(icons::LOOP).size(13.0).color(color);
            let button = Button::selectable(loops, icon).frame_when_inactive(true);
            let response = ui.add_enabled(context.state.playback.frames > 1, button);
            response.widget_info(|| WidgetInfo::selected(Role::Button, true, loops, "Loop"));
            let hint = "Repeats the range between in and out, or stops at its end. Key: Ctrl+L";
            if response.on_hover_text(hint).clicked() {
                out.push(Command::View(ViewCommand::ToggleLoop));
            }
            let zoom = format!("{:.0} %", 100.0 * scale * ui.ctx().pixels_per_point());
            ui.label(RichText::new(zoom).size(12.0).color(theme::QUIET))
                .on_hover_text("Pixels of the screen per pixel of the picture");
        });
    });
}

/// Legend of false colours, in a corner of the picture.
pub fn legend_ui(ui: &Ui, rect: Rect) {
    const ROW: f32 = 17.0;
    let clipped = (Some(CLIPPED), "clipped: white or brighter");
    let zones = LEGEND.map(|zone| (zone.color, zone.name));
    let rows: Vec<_> = std::iter::once(clipped).chain(zones.into_iter().rev()).collect();
    let painter = ui.painter().with_clip_rect(rect);
    let font = FontId::proportional(12.0);
    let size = vec2(250.0, ROW * rows.len() as f32 + GAP);
    let back = Align2::RIGHT_TOP.align_size_within_rect(size, rect.shrink(GAP));
    painter.rect_filled(back, 3.0, theme::OVER_PICTURE);
    for (row, (color, name)) in rows.into_iter().enumerate() {
        let corner = back.min + vec2(GAP, 0.5 * GAP + ROW * row as f32);
        let swatch = Rect::from_min_size(corner + vec2(0.0, 3.0), vec2(18.0, ROW - 6.0));
        let [r, g, b] = color.unwrap_or([0.5; 3]).map(byte_from_unit);
        painter.rect_filled(swatch, 1.0, Color32::from_rgb(r, g, b));
        let at = corner + vec2(26.0, 0.5 * ROW);
        painter.text(at, Align2::LEFT_CENTER, name, font.clone(), theme::TEXT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_has_whole_codes_and_a_mean_has_tenths() {
        let pixel = Reading { name: String::new(), codes: [7.0, 42.0, 255.0], linear: None, is_mean: false };
        assert_eq!(pixel.text(), "  7  42 255");
        let mean = Reading { codes: [7.21, 42.06, 254.96], linear: Some([0.5, 0.0, 1.25]), is_mean: true, ..pixel };
        assert_eq!(mean.text(), "  7.2  42.1 255.0   linear 0.5000 0.0000 1.2500");
    }

    #[test]
    fn where_there_is_less_room_the_light_goes_first_and_the_codes_never() {
        let reading =
            |name: &str, linear| Reading { name: name.to_owned(), codes: [1.0, 2.0, 3.0], linear, is_mean: false };
        let found = [reading("relit", Some([0.5; 3])), reading("sky", None)];
        let text = |detail: Detail, found: &[Reading]| {
            let parts = detail.parts(found, 1);
            let bright: Vec<bool> = parts.iter().map(|(_, bright)| *bright).collect();
            assert!(found.len() == 1 || bright == [false, false, false, true]);
            parts.into_iter().map(|(text, _)| text).collect::<String>()
        };
        let light = "   linear 0.5000 0.5000 0.5000";
        for (detail, said) in [
            (Detail::All, format!("A relit    1   2   3{light}   B sky    1   2   3")),
            (Detail::Codes, "A relit    1   2   3   B sky    1   2   3".to_owned()),
            (Detail::Letters, "A     1   2   3   B     1   2   3".to_owned()),
        ] {
            assert_eq!(text(detail, &found), said);
        }
        assert_eq!(text(Detail::Codes, &found[..1]), "  1   2   3");
    }
}
