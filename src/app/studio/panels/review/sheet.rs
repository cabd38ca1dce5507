//! The contact sheet: the current frame under every lamp, each picture in the direction of its lamp.

use super::verdict;
use crate::command::{Command, ViewCommand};
use crate::panel_context::PanelContext;
use crate::panels::lamp_title;
use crate::panels::viewport::cell::CellUi;
use crate::panels::widgets::missing::no_picture_ui;
use crate::theme::{self, GAP};
use egui::{
    Align, Align2, Button, Color32, ColorImage, FontId, Layout, Painter, Rect, Response, RichText, Sense, Stroke,
    StrokeKind, TextureHandle, TextureOptions, Ui, Vec2, pos2, vec2,
};
use evaluation::review::{MarkedOlat, place_by_direction};
use glam::Vec3;
use light::Lamp;
use std::sync::Arc;
use worker::{LampSheet, PreviewPicture, SrgbPicture};

/// Pictures wider than this many points show their lamp's number.
const NUMBERED: f32 = 26.0;

/// Holds one texture with all pictures of the sheet. A cell chosen in the map is shown in place of the sheet.
#[derive(Default)]
pub struct LampSheetPanel {
    shown: Option<(Arc<LampSheet>, Atlas)>,
    cell: CellUi,
}

impl LampSheetPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let whole = ui.available_rect_before_wrap();
        if self.cell.ui(ui, whole, context, out) {
            ui.advance_cursor_after_rect(whole);
            return;
        }
        let empty = match (&context.readers.review.sheet, context.relit()) {
            _ if context.session.project.is_none() => "Open a project to see its frames under every lamp.",
            (Some(Err(sentence)), _) => {
                ui.colored_label(theme::WARNING, sentence);
                return;
            }
            (Some(Ok(sheet)), Some(relit)) if sheet.lamps.len() == relit.rig.lamps.len() => {
                return self.sheet_ui(ui, context, sheet, relit, out);
            }
            _ if !context.is_live() => {
                let sentence = "A calibration is needed to show the frame under every lamp.";
                return no_picture_ui(ui, context, sentence, out);
            }
            _ => "Predicting the frame under every lamp.",
        };
        ui.label(RichText::new(empty).color(theme::QUIET));
    }

    fn sheet_ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        sheet: &Arc<LampSheet>,
        relit: &PreviewPicture,
        out: &mut Vec<Command>,
    ) {
        let solo = &context.state.solo;
        title_ui(ui, sheet, relit, solo, out);
        self.upload(ui.ctx(), sheet);
        let Some((_, atlas)) = &self.shown else { return };
        let area = ui.available_rect_before_wrap();
        let lamps = &relit.rig.lamps;
        let directions: Vec<Vec3> = lamps.iter().map(|lamp| lamp.direction).collect();
        let placed = place_by_direction(&directions, area.width(), area.height());
        let frame = context.session.project.and_then(|p| p.settings.shoot.frames.get(sheet.frame));
        for (number, (lamp, [x, y])) in lamps.iter().zip(&placed.corners).enumerate() {
            let corner = area.min + vec2(*x, *y);
            let marked = frame.as_deref().and_then(|frame| context.readers.review.marks.get(frame, &lamp.name));
            let picture = LampPicture {
                number,
                lamp,
                rect: Rect::from_min_size(corner, Vec2::splat(placed.side)).shrink(1.0),
                chosen: solo.contains(&number),
                marked,
            };
            if picture.ui(ui, atlas).clicked() {
                let also = ui.input(|i| i.modifiers.command);
                out.push(match (also, solo.as_slice()) {
                    (true, _) => Command::View(ViewCommand::SoloAlso(number)),
                    (false, [one]) if *one == number => Command::View(ViewCommand::Solo(None)),
                    (false, _) => Command::View(ViewCommand::Solo(Some(number))),
                });
            }
        }
        ui.advance_cursor_after_rect(area);
        ui.add_space(GAP);
    }

    fn upload(&mut self, ctx: &egui::Context, sheet: &Arc<LampSheet>) {
        let same = |(shown, _): &(Arc<LampSheet>, Atlas)| Arc::ptr_eq(shown, sheet);
        if !self.shown.as_ref().is_some_and(same) {
            self.shown = Some((sheet.clone(), Atlas::new(ctx, &sheet.lamps)));
        }
    }
}

/// Title of the sheet, and the button that returns to the environment.
fn title_ui(ui: &mut Ui, sheet: &LampSheet, relit: &PreviewPicture, solo: &[usize], out: &mut Vec<Command>) {
    let frame = sheet.frame;
    let lamps = &relit.rig.lamps;
    ui.horizontal(|ui| {
        ui.label(match solo {
            [] => format!("Frame {frame} under every lamp"),
            [lamp] => {
                let lamp = &lamps[(*lamp).min(lamps.len() - 1)];
                format!("Frame {frame}: {}", lamp_title(&lamp.name))
            }
            more => format!("Frame {frame}: {} lamps", more.len()),
        });
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let back = ui.add_enabled(!solo.is_empty(), Button::new("All lamps"));
            if back.on_hover_text("Shows the picture under the environment again").clicked() {
                out.push(Command::View(ViewCommand::Solo(None)));
            }
        });
    });
}

/// The frame under one lamp.
struct LampPicture<'a> {
    number: usize,
    lamp: &'a Lamp,
    rect: Rect,
    chosen: bool,
    marked: Option<&'a MarkedOlat>,
}

impl LampPicture<'_> {
    fn ui(&self, ui: &Ui, atlas: &Atlas) -> Response {
        let id = ui.scope_id().with(("lamp", self.number));
        let response = ui.interact(self.rect, id, Sense::click());
        response.widget_info(|| {
            egui::WidgetInfo::selected(egui::Role::Button, true, self.chosen, lamp_title(&self.lamp.name))
        });
        self.paint(ui.painter(), atlas, response.hovered() || response.has_focus());
        response.on_hover_ui(|ui| {
            ui.label(self.hint());
        })
    }

    fn paint(&self, painter: &Painter, atlas: &Atlas, pointed_at: bool) {
        let (rect, texture) = (self.rect, atlas.texture.id());
        painter.image(texture, rect, atlas.place(self.number), Color32::WHITE);
        if let Some(marked) = self.marked {
            let color = marked.mark.map_or(Color32::WHITE, verdict::color);
            let rim = Stroke::new(1.0, Color32::BLACK);
            painter.circle(rect.right_top() + vec2(-6.0, 6.0), 4.0, color, rim);
        }
        if rect.width() > NUMBERED {
            let font = FontId::proportional(10.0);
            let at = rect.left_bottom() + vec2(3.0, -2.0);
            let number = painter.layout_no_wrap(self.number.to_string(), font, theme::TEXT);
            let place = Align2::LEFT_BOTTOM.anchor_size(at, number.size());
            // Dark, because some pictures are as bright as the number.
            painter.rect_filled(place.expand(1.5), 2.0, Color32::from_black_alpha(170));
            painter.galley(place.min, number, theme::TEXT);
        }
        let edge = match (self.chosen, pointed_at) {
            (true, _) => Some(Stroke::new(2.0, theme::ACCENT)),
            (false, true) => Some(Stroke::new(1.0, theme::TEXT)),
            _ => None,
        };
        if let Some(edge) = edge {
            painter.rect_stroke(rect, 1.0, edge, StrokeKind::Inside);
        }
    }

    fn hint(&self) -> String {
        let d = self.lamp.direction;
        let (azimuth, elevation) = (d.x.atan2(-d.z), d.y.clamp(-1.0, 1.0).asin());
        format!(
            "{}: azimuth {:.0}°, elevation {:.0}°. Click to solo it, Ctrl+click to add or remove it.",
            lamp_title(&self.lamp.name),
            azimuth.to_degrees(),
            elevation.to_degrees()
        )
    }
}

/// Pictures of the same size in one texture, row by row.
struct Atlas {
    texture: TextureHandle,
    columns: usize,
    rows: usize,
}

impl Atlas {
    fn new(ctx: &egui::Context, pictures: &[SrgbPicture]) -> Self {
        let columns = (pictures.len() as f32).sqrt().ceil().max(1.0) as usize;
        let rows = pictures.len().div_ceil(columns).max(1);
        let (width, height) = pictures.first().map_or((1, 1), |p| (p.width, p.height));
        let stride = columns * width;
        let mut pixels = vec![Color32::BLACK; stride * rows * height];
        for (i, picture) in pictures.iter().enumerate() {
            let corner = i / columns * height * stride + i % columns * width;
            for (y, row) in picture.rgb.chunks_exact(3 * width).enumerate() {
                for (x, code) in row.chunks_exact(3).enumerate() {
                    pixels[corner + y * stride + x] = Color32::from_rgb(code[0], code[1], code[2]);
                }
            }
        }
        let picture = ColorImage::new([stride, rows * height], pixels);
        Self { texture: ctx.load_texture("lamps", picture, TextureOptions::LINEAR), columns, rows }
    }

    /// The texture coordinates of a picture.
    fn place(&self, number: usize) -> Rect {
        let cell = vec2(1.0 / self.columns as f32, 1.0 / self.rows as f32);
        let corner = pos2((number % self.columns) as f32 * cell.x, (number / self.columns) as f32 * cell.y);
        Rect::from_min_size(corner, cell)
    }
}
