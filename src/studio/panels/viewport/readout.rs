//! The pixel under the cursor or the means of a region, and what false colours mean.

use super::{toolbar, viewing};
use crate::command::{Command, ViewCommand, WindowCommand};
use crate::comparison::{CompareMode, CompareSettings};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::region::{Region, mean};
use crate::theme::{self, GAP};
use compositor::{CLIPPED, LEGEND, viewed_code};
use egui::text::LayoutJob;
use egui::{
    Align, Align2, Button, Color32, FontId, Layout, Rect, RichText, Role, Sense, TextFormat, Ui,
    UiBuilder, WidgetInfo, vec2,
};
use imaging::color::byte_from_unit;
use scene::Inspection;
use std::sync::Arc;
use worker::{PreviewPicture, SrgbPicture};

/// How a region is drawn and left.
pub const REGION_HINT: &str = "Ctrl+Shift+drag over the picture reads the mean of a region; Esc or Ctrl+Shift+click ends that";

/// Height of a line of the strip in points, and width of its buttons.
const LINE: f32 = 17.0;
const BUTTONS: f32 = 150.0;

/// The strip's height in points: what is shown, and below what is read of it.
pub const HEIGHT: f32 = 2.0 * LINE + 7.0;

/// What a pixel of one of the two pictures is, or the mean of several.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The picture's name.
    pub name: String,
    /// Its 8-bit codes, 0 to 255.
    pub codes: [f32; 3],
    /// Its scene-linear light, where that is known.
    pub linear: Option<[f32; 3]>,
    /// Whether it is a mean.
    pub is_mean: bool,
}

impl Reading {
    /// The codes: of a mean, with a tenth.
    pub fn codes_text(&self) -> String {
        let ([r, g, b], tenths) = (self.codes, usize::from(self.is_mean));
        let width = 3 + 2 * tenths;
        format!("{r:width$.tenths$} {g:width$.tenths$} {b:width$.tenths$}")
    }

    /// The codes, and the light if it is known.
    pub fn text(&self) -> String {
        let light = self.linear.map_or(String::new(), |[r, g, b]| {
            format!("   linear {r:.4} {g:.4} {b:.4}")
        });
        format!("{}{light}", self.codes_text())
    }
}

/// The readings of a region, until the picture or the region is another: it may have millions of pixels.
#[derive(Default)]
pub struct RegionReadings(Option<(Arc<PreviewPicture>, Region, CompareSettings, Vec<Reading>)>);

impl RegionReadings {
    /// The readings of a region of the newest picture.
    pub fn of(
        &mut self,
        context: &PanelContext,
        relit: &Arc<PreviewPicture>,
        region: Region,
    ) -> &[Reading] {
        let compare = &context.state.compare;
        let known = self.0.take().filter(|(of, read, compared, _)| {
            Arc::ptr_eq(of, relit) && *read == region && compared == compare
        });
        let known = known.unwrap_or_else(|| {
            let found = readings(context, relit, region);
            (relit.clone(), region, compare.clone(), found)
        });
        &self.0.insert(known).3
    }
}

/// The readings of a region, or of one pixel: of the picture, or of what is shown in its place, and of what that is compared
/// with. Channels and false colours are read as the picture that they are of.
pub fn readings(context: &PanelContext, relit: &PreviewPicture, region: Region) -> Vec<Reading> {
    let compare = &context.state.compare;
    let size = [relit.width, relit.height];
    let Some(region) = region.inside(size) else {
        return Vec::new();
    };
    let is_mean = region.size() != [1, 1];
    let codes = |rgb: &[u8], its_size: [usize; 2]| {
        let pixels = rgb.as_chunks::<3>().0;
        let pixels = region.scaled(size, its_size).of(pixels, its_size[0]);
        mean(pixels.map(|pixel| pixel.map(f32::from)))
    };
    let pixel = |picture: &SrgbPicture| codes(&picture.rgb, [picture.width, picture.height]);
    let light = || {
        let linear = relit.linear.iter();
        linear.flat_map(move |linear| region.of(&linear.pixels, linear.width).copied())
    };
    let linear = mean(light());
    let effects = relit.scene.effects;
    let first = match (&relit.first, &compare.first) {
        (Some((_, codes)), Some(with)) => pixel(codes).map(|codes| Reading {
            name: toolbar::name(with, context),
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
            shown.map(|codes| Reading {
                name: "relit".to_owned(),
                codes,
                linear,
                is_mean,
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
            is_mean,
        });
    first.into_iter().chain(second).collect()
}

/// The strip below the picture: frame, light, and the region or the pixel in both pictures. The one under the cursor is bright.
pub fn strip_ui(
    ui: &mut Ui,
    rect: Rect,
    context: &PanelContext,
    relit: &Arc<PreviewPicture>,
    second: bool,
    means: &mut RegionReadings,
    out: &mut Vec<Command>,
) {
    ui.painter().rect_filled(rect, 0.0, theme::WELL);
    let buttons = Rect::from_min_max(rect.right_top() - vec2(BUTTONS, 0.0), rect.max);
    let state = context.state;
    let light = match state.solo.first() {
        Some(&lamp) => format!("{} alone", context.lamps_named(lamp)),
        None if relit.scene.lighting.is_solo() => {
            format!("{} alone", relit.scene.lighting.solo_titles().join(", "))
        }
        None => relit.environment.clone(),
    };
    let mut lines = [LayoutJob::default(), LayoutJob::default()];
    let mut add = |line: usize, text: &str, color| {
        let format = TextFormat {
            font_id: FontId::monospace(12.0),
            color,
            ..TextFormat::default()
        };
        lines[line].append(text, 0.0, format);
    };
    let frame = relit.scene.frame;
    add(0, &format!("frame {frame}   {light}"), theme::QUIET);
    let gain = state.gain;
    let differs = state.compare.on && state.compare.mode == CompareMode::Difference;
    if differs {
        add(0, &format!("   difference × {gain}"), theme::QUIET);
    }
    if let Some(words) = viewing::words(&relit.scene.viewing) {
        add(0, &format!("   {words}"), theme::VIEWING);
    }
    let pixel;
    let found = match (state.region, state.probed) {
        (Some(region), _) => {
            let [columns, rows] = region.size();
            let found = means.of(context, relit, region);
            Some((format!("   mean of {columns} × {rows}"), found))
        }
        (None, Some([x, y])) => {
            pixel = readings(context, relit, Region::pixel([x, y]));
            Some((format!("   {x:4},{y:4}"), pixel.as_slice()))
        }
        (None, None) => None,
    };
    if let Some((place, found)) = found {
        add(0, &place, theme::QUIET);
        let two = found.len() > 1;
        for (place, reading) in found.iter().enumerate() {
            let color = match two && (place == 1) != second {
                true => theme::QUIET,
                false => theme::TEXT,
            };
            if two {
                let space = if place == 1 { "   " } else { "" };
                let name = format!("{space}{} {}  ", ["A", "B"][place], reading.name);
                add(1, &name, theme::QUIET);
            }
            add(1, &reading.text(), color);
        }
    }
    let text = lines.each_ref().map(|line| &*line.text).join("   ");
    let rights = [buttons.left(), rect.right() - GAP];
    for ((line, mut job), right) in lines.into_iter().enumerate().zip(rights) {
        let at = rect.min + vec2(GAP, 3.0 + LINE * line as f32);
        job.wrap.max_width = right - at.x;
        job.wrap.max_rows = 1;
        job.wrap.break_anywhere = true;
        let galley = ui.painter().layout_job(job);
        ui.painter().galley(at, galley, theme::QUIET);
    }
    let response = ui.interact(rect, ui.scope_id().with("readout"), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, text.trim_end()));
    let mut hint = "The pixel under the cursor: 8-bit codes as they are shown, then scene-linear light. A and B are the \
                    two pictures that are compared. Codes include how the picture is looked at, light does not. "
        .to_owned()
        + REGION_HINT;
    if differs {
        hint += &format!(". The difference is shown × {gain}");
    }
    response.on_hover_text(hint);
    // Over what is read.
    buttons_ui(ui, buttons, context, out);
}

/// Loop, zoom and what fits the picture, at the right end of the strip.
fn buttons_ui(ui: &mut Ui, rect: Rect, context: &PanelContext, out: &mut Vec<Command>) {
    let rect = rect
        .with_max_y(rect.top() + LINE + 9.0)
        .shrink2(vec2(GAP, 2.0));
    ui.scope_builder(UiBuilder::new().max_rect(rect), |ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.spacing_mut().button_padding = vec2(6.0, 1.0);
            ui.spacing_mut().interact_size.y = 19.0;
            let hint = "One pixel of the picture on one pixel of the screen. Key: 1";
            if ui.small_button("1:1").on_hover_text(hint).clicked() {
                out.push(Command::Window(WindowCommand::ActualSize));
            }
            let fit = Button::new(RichText::new(icons::FIT).size(13.0));
            if icons::named_ui(ui, true, fit, "Fit")
                .on_hover_text("Fits the picture to the pane. Key: F")
                .clicked()
            {
                out.push(Command::View(ViewCommand::Fit));
            }
            let loops = context.state.loops;
            let color = if loops { theme::ACCENT } else { theme::TEXT };
            let icon = RichText::new(icons::LOOP).size(13.0).color(color);
            let button = Button::selectable(loops, icon).frame_when_inactive(true);
            let response = ui.add_enabled(context.state.frames > 1, button);
            response.widget_info(|| WidgetInfo::selected(Role::Button, true, loops, "Loop"));
            let hint = "Plays the range between in and out again and again, or stops at its end. Key: Ctrl+L";
            if response.on_hover_text(hint).clicked() {
                out.push(Command::View(ViewCommand::ToggleLoop));
            }
            let zoom = format!("{:.0} %", 100.0 * context.state.view.zoom);
            ui.label(RichText::new(zoom).size(12.0).color(theme::QUIET))
                .on_hover_text("Of the fitted picture");
        });
    });
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
        let pixel = Reading {
            name: String::new(),
            codes: [7.0, 42.0, 255.0],
            linear: None,
            is_mean: false,
        };
        assert_eq!(pixel.text(), "  7  42 255");
        let mean = Reading {
            codes: [7.21, 42.06, 254.96],
            linear: Some([0.5, 0.0, 1.25]),
            is_mean: true,
            ..pixel
        };
        assert_eq!(
            mean.text(),
            "  7.2  42.1 255.0   linear 0.5000 0.0000 1.2500"
        );
    }
}
