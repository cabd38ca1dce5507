//! A measured frame or pose under one lamp: prediction, truth and difference, panned and zoomed together, or one of
//! them alone.

use super::canvas::{label, paint, placed, texture, zoom};
use super::toolbar;
use crate::command::{Command, ViewCommand};
use crate::comparison::CellPicture;
use crate::panel_context::PanelContext;
use crate::panels::lamp_title;
use crate::theme::{self, GAP};
use egui::{
    Align, Align2, Button, Layout, Margin, PointerButton, Rect, RichText, Sense, TextureId, Ui, UiBuilder, Vec2, vec2,
};
use egui::{TextureHandle, WidgetInfo};
use evaluation::review::{Case, Metric, heat};
use imaging::Encoded;
use std::sync::Arc;
use worker::{CellPictures, SrgbPicture};

/// Height of the title line in points.
const HEIGHT: f32 = 32.0;
/// Free width in points that the line's hint needs.
const HINT: f32 = 200.0;

/// Textures of the shown pictures.
#[derive(Default)]
pub struct CellUi {
    shown: Option<CellTextures>,
}

struct CellTextures {
    of: Arc<CellPictures>,
    /// Factor of the difference.
    gain: f32,
    /// In the order of [`CellPicture::ALL`].
    textures: [TextureHandle; 3],
}

impl CellUi {
    /// Draws the cell selected in the state. Returns false without one; the review holds the reason.
    pub fn ui(&mut self, ui: &mut Ui, rect: Rect, context: &PanelContext, out: &mut Vec<Command>) -> bool {
        let (Some(cell), Some(Ok(pictures))) = (context.state.review.cell, &context.readers.review.cell) else {
            return false;
        };
        let gain = context.state.display.gain;
        self.upload(ui.ctx(), pictures, gain);
        let Some(shown) = &self.shown else { return false };
        ui.painter().rect_filled(rect, 0.0, theme::SURROUND);
        let bar = rect.with_max_y(rect.top() + HEIGHT);
        bar_ui(ui, bar, cell, context, out);
        let rect = rect.with_min_y(bar.bottom());
        let truth = match pictures.cell.case {
            Case::Pose(_) => "photograph",
            Case::Frame(_) => "truth",
        };
        let difference = format!("difference (FLIP × {gain})");
        let names = ["prediction", truth, difference.as_str()];
        let size = vec2(pictures.predicted.width as f32, pictures.predicted.height as f32);
        let is_wide = rect.width() > 1.4 * rect.height();
        let third = |i: usize| {
            let share = |side: f32| side * i as f32 / 3.0;
            let (step, part) = if is_wide {
                (vec2(share(rect.width()), 0.0), vec2(rect.width() / 3.0, rect.height()))
            } else {
                (vec2(0.0, share(rect.height())), vec2(rect.width(), rect.height() / 3.0))
            };
            Rect::from_min_size(rect.min + step, part).shrink(1.0)
        };
        let all = CellPicture::ALL.into_iter().zip(&shown.textures);
        for (i, ((which, texture), name)) in all.zip(names).enumerate() {
            let part = match context.state.review.enlarged {
                Some(enlarged) if enlarged != which => continue,
                Some(_) => rect,
                None => third(i),
            };
            let picture = OnePicture { which, name, texture: texture.id(), size };
            picture.ui(ui, part, context, out);
        }
        true
    }

    fn upload(&mut self, ctx: &egui::Context, pictures: &Arc<CellPictures>, gain: f32) {
        let upload = |picture: &SrgbPicture, old| {
            let size = [picture.width, picture.height];
            texture(ctx, "cell", old, size, &picture.rgb)
        };
        let (predicted, truth, old) = match self.shown.take() {
            Some(shown) if Arc::ptr_eq(&shown.of, pictures) => {
                if shown.gain == gain {
                    self.shown = Some(shown);
                    return;
                }
                let [predicted, truth, difference] = shown.textures;
                (predicted, truth, Some(difference))
            }
            _ => (upload(&pictures.predicted, None), upload(&pictures.truth, None), None),
        };
        let difference = SrgbPicture::from_picture(&Encoded(pictures.difference.map(|flip| heat(gain * flip))));
        self.shown =
            Some(CellTextures { of: pictures.clone(), gain, textures: [predicted, truth, upload(&difference, old)] });
    }
}

/// One of the three pictures.
struct OnePicture<'a> {
    which: CellPicture,
    name: &'a str,
    texture: TextureId,
    /// Columns and rows in pixels.
    size: Vec2,
}

impl OnePicture<'_> {
    /// Draws the picture into `part`. A click shows it alone, or all three again.
    fn ui(&self, ui: &Ui, part: Rect, context: &PanelContext, out: &mut Vec<Command>) {
        let (place, _) = placed(part, self.size, context);
        paint(ui, part, self.texture, place, (0.0, 1.0));
        label(ui, part, Align2::LEFT_TOP, self.name);
        let id = ui.scope_id().with(("cell", self.which as usize));
        let response = ui.interact(part, id, Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, self.name));
        theme::focus_ui(ui, part, &response);
        let drags = [PointerButton::Primary, PointerButton::Middle];
        if drags.into_iter().any(|button| response.dragged_by(button)) {
            let by = response.drag_delta();
            out.push(Command::View(ViewCommand::Pan(by.into())));
        } else if response.clicked() {
            let enlarged = match context.state.review.enlarged {
                Some(_) => None,
                None => Some(self.which),
            };
            out.push(Command::View(ViewCommand::Enlarge(enlarged)));
        }
        zoom(ui, &response, part, out);
    }
}

/// Name of the shown cell, its error figures, and the button back.
fn bar_ui(ui: &mut Ui, rect: Rect, (case, lamp): (usize, usize), context: &PanelContext, out: &mut Vec<Command>) {
    ui.painter().rect_filled(rect, 0.0, theme::PANEL);
    let inner = UiBuilder::new().max_rect(rect - Margin::symmetric(8, 3));
    ui.scope_builder(inner, |ui| {
        ui.horizontal_centered(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0 * GAP;
            let saved = context.readers.review.saved.as_ref().and_then(|saved| saved.as_ref().ok());
            let review = saved.and_then(|saved| saved.review.as_ref());
            if let Some((review, case)) = review.and_then(|r| Some((r, r.cases.get(case)?))) {
                let title = review.lamps.get(lamp).map_or(String::new(), |name| lamp_title(name));
                ui.strong(format!("{}, {title}", case.name));
                if let Some(cell) = case.cells.get(lamp) {
                    for metric in Metric::ALL {
                        let figure = metric.text(metric.score(cell));
                        ui.label(format!("{} {figure}", metric.name()));
                    }
                }
            }
            let enlarged = context.state.review.enlarged;
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.spacing_mut().item_spacing.x = GAP;
                let (text, hint, to) = match enlarged {
                    None => ("Back", "Exit to the picture. Key: Esc", ViewCommand::Cell(None)),
                    Some(_) => ("All three", "Or click the picture. Key: Esc", ViewCommand::Enlarge(None)),
                };
                if ui.add(Button::new(text)).on_hover_text(hint).clicked() {
                    out.push(Command::View(to));
                }
                if enlarged.is_none_or(|one| one == CellPicture::Difference) {
                    toolbar::gain_ui(ui, context, out);
                }
                if ui.available_width() > HINT {
                    let hint = match enlarged {
                        None => "Click enlarges one, Q flips",
                        Some(_) => "Q: prediction or truth",
                    };
                    ui.label(RichText::new(hint).color(theme::QUIET));
                }
            });
        });
    });
}
