//! The contact sheet: the shown frame under every lamp, each picture where its lamp is.

use crate::command::{Command, ViewCommand};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{
    Align, Align2, Button, Color32, ColorImage, FontId, Layout, Rect, RichText, Sense, Stroke,
    StrokeKind, TextureHandle, TextureOptions, Ui, pos2, vec2,
};
use evaluation::review::{Mark, place_by_direction};
use glam::Vec3;
use std::sync::Arc;
use worker::{LampSheet, PreviewPicture, SrgbPicture};

/// The panel, and the texture that holds all pictures of the sheet that is shown.
#[derive(Default)]
pub struct LampSheetPanel {
    shown: Option<(Arc<LampSheet>, Atlas)>,
}

impl LampSheetPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let empty = match (&context.review.sheet, context.relit) {
            _ if context.project.is_none() => "Open a project to see its frames under every lamp.",
            (Some(Err(sentence)), _) => {
                ui.colored_label(theme::ACCENT, sentence);
                return;
            }
            (Some(Ok(sheet)), Some(relit)) if sheet.lamps.len() == relit.rig.lamps.len() => {
                return self.sheet_ui(ui, context, sheet, relit, out);
            }
            _ if !context.is_live() => {
                "The lamps are shown once there is a network that predicts them."
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
        ui.horizontal(|ui| {
            let title = match solo.as_slice() {
                [] => format!("Frame {} under every lamp", sheet.frame),
                [lamp] => format!(
                    "Frame {}: {}",
                    sheet.frame,
                    relit.rig.lamps[(*lamp).min(relit.rig.lamps.len() - 1)].name
                ),
                lamps => format!("Frame {}: {} lamps", sheet.frame, lamps.len()),
            };
            ui.label(title);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let all = ui.add_enabled(!solo.is_empty(), Button::new("Whole light"));
                if all
                    .on_hover_text("Shows the picture under the light again")
                    .clicked()
                {
                    out.push(Command::View(ViewCommand::Solo(None)));
                }
            });
        });
        self.upload(ui.ctx(), sheet);
        let Some((_, atlas)) = &self.shown else {
            return;
        };
        let area = ui.available_rect_before_wrap();
        let directions: Vec<Vec3> = relit.rig.lamps.iter().map(|lamp| lamp.direction).collect();
        let placed = place_by_direction(&directions, area.width(), area.height());
        let case = context
            .project
            .and_then(|p| p.settings.shoot.frames.get(sheet.frame));
        for (number, (lamp, [x, y])) in relit.rig.lamps.iter().zip(&placed.corners).enumerate() {
            let rect = Rect::from_min_size(area.min + vec2(*x, *y), vec2(placed.side, placed.side))
                .shrink(1.0);
            let response = ui.interact(rect, ui.scope_id().with(("lamp", number)), Sense::click());
            let chosen = solo.contains(&number);
            response.widget_info(|| {
                egui::WidgetInfo::selected(egui::Role::Button, true, chosen, &lamp.name)
            });
            let painter = ui.painter();
            painter.image(
                atlas.texture.id(),
                rect,
                atlas.place(number),
                Color32::WHITE,
            );
            let mark = case.and_then(|case| context.review.marks.of(case, &lamp.name));
            if let Some(marked) = mark {
                let color = match marked.mark {
                    Some(Mark::Good) => Color32::from_rgb(126, 190, 116),
                    Some(Mark::Doubtful) => theme::ACCENT,
                    Some(Mark::Bad) => Color32::from_rgb(224, 96, 84),
                    None => Color32::WHITE,
                };
                painter.circle_filled(rect.right_top() + vec2(-5.0, 5.0), 3.0, color);
            }
            if placed.side > 28.0 {
                let font = FontId::proportional(10.0);
                let at = rect.left_bottom() + vec2(3.0, -2.0);
                painter.text(
                    at,
                    Align2::LEFT_BOTTOM,
                    number.to_string(),
                    font,
                    theme::QUIET,
                );
            }
            let edge = match (chosen, response.hovered() || response.has_focus()) {
                (true, _) => Some(Stroke::new(2.0, theme::ACCENT)),
                (false, true) => Some(Stroke::new(1.0, theme::TEXT)),
                _ => None,
            };
            if let Some(edge) = edge {
                painter.rect_stroke(rect, 1.0, edge, StrokeKind::Inside);
            }
            if response.clicked() {
                let also = ui.input(|i| i.modifiers.command);
                out.push(match (also, solo.as_slice()) {
                    (true, _) => Command::View(ViewCommand::SoloAlso(number)),
                    (false, [one]) if *one == number => Command::View(ViewCommand::Solo(None)),
                    (false, _) => Command::View(ViewCommand::Solo(Some(number))),
                });
            }
            let hint = || {
                let d = lamp.direction;
                let (azimuth, elevation) = (d.x.atan2(-d.z), d.y.clamp(-1.0, 1.0).asin());
                format!(
                    "{}: azimuth {:.0}°, elevation {:.0}°. Click shows the frame under it alone, Ctrl+click adds it.",
                    lamp.name,
                    azimuth.to_degrees(),
                    elevation.to_degrees()
                )
            };
            response.on_hover_ui(|ui| {
                ui.label(hint());
            });
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

/// Pictures of one size in one texture, row by row.
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
        Self {
            texture: ctx.load_texture("lamps", picture, TextureOptions::LINEAR),
            columns,
            rows,
        }
    }

    /// Where a picture is in the texture.
    fn place(&self, number: usize) -> Rect {
        let cell = vec2(1.0 / self.columns as f32, 1.0 / self.rows as f32);
        let corner = pos2(
            (number % self.columns) as f32 * cell.x,
            (number / self.columns) as f32 * cell.y,
        );
        Rect::from_min_size(corner, cell)
    }
}
