//! A measured frame or pose under one lamp: what was predicted, the truth, and their difference, moved and enlarged
//! together.

use super::{label, paint, placed, texture, zoom};
use crate::command::{Command, ViewCommand};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{
    Align, Align2, Button, Layout, Margin, PointerButton, Rect, Sense, Ui, UiBuilder, vec2,
};
use egui::{TextureHandle, WidgetInfo};
use evaluation::review::{Case, Metric};
use std::sync::Arc;
use worker::CellPictures;

/// Height of the line that says what is shown.
const HEIGHT: f32 = 32.0;

/// The textures of the pictures that are shown.
#[derive(Default)]
pub struct CellUi {
    shown: Option<(Arc<CellPictures>, [TextureHandle; 3])>,
}

impl CellUi {
    /// Draws the cell that the state asks for. Returns whether there is one; why not is left in the review.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        rect: Rect,
        context: &PanelContext,
        out: &mut Vec<Command>,
    ) -> bool {
        let (Some(cell), Some(Ok(pictures))) = (context.state.cell, &context.review.cell) else {
            return false;
        };
        self.upload(ui.ctx(), pictures);
        let Some((_, textures)) = &self.shown else {
            return false;
        };
        ui.painter().rect_filled(rect, 0.0, theme::SURROUND);
        let bar = rect.with_max_y(rect.top() + HEIGHT);
        bar_ui(ui, bar, cell, context, out);
        let rect = rect.with_min_y(bar.bottom());
        let truth = match pictures.cell.case {
            Case::Pose(_) => "photograph",
            Case::Frame(_) => "truth",
        };
        let names = ["prediction", truth, "difference (FLIP)"];
        let size = vec2(
            pictures.predicted.width as f32,
            pictures.predicted.height as f32,
        );
        let is_wide = rect.width() > 1.4 * rect.height();
        for (i, (texture, name)) in textures.iter().zip(names).enumerate() {
            let share = |side: f32| side * i as f32 / 3.0;
            let (step, part) = match is_wide {
                true => (
                    vec2(share(rect.width()), 0.0),
                    vec2(rect.width() / 3.0, rect.height()),
                ),
                false => (
                    vec2(0.0, share(rect.height())),
                    vec2(rect.width(), rect.height() / 3.0),
                ),
            };
            let part = Rect::from_min_size(rect.min + step, part).shrink(1.0);
            let (place, _) = placed(part, size, context);
            paint(ui, part, texture.id(), place, (0.0, 1.0));
            label(ui, part, Align2::LEFT_TOP, name);
            let response = ui.interact(part, ui.scope_id().with(("cell", i)), Sense::drag());
            response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, name));
            let drags = [PointerButton::Primary, PointerButton::Middle];
            if drags.into_iter().any(|button| response.dragged_by(button)) {
                let by = response.drag_delta();
                out.push(Command::View(ViewCommand::Pan(by.into())));
            }
            zoom(ui, &response, part, out);
        }
        true
    }

    fn upload(&mut self, ctx: &egui::Context, pictures: &Arc<CellPictures>) {
        let same = |(shown, _): &(Arc<CellPictures>, _)| Arc::ptr_eq(shown, pictures);
        if self.shown.as_ref().is_some_and(same) {
            return;
        }
        let each = [&pictures.predicted, &pictures.truth, &pictures.difference];
        let textures = each.map(|picture| {
            let size = [picture.width, picture.height];
            texture(ctx, "cell", None, size, &picture.rgb)
        });
        self.shown = Some((pictures.clone(), textures));
    }
}

/// What is shown, how near it is, and the way back.
fn bar_ui(
    ui: &mut Ui,
    rect: Rect,
    (case, lamp): (usize, usize),
    context: &PanelContext,
    out: &mut Vec<Command>,
) {
    ui.painter().rect_filled(rect, 0.0, theme::PANEL);
    let inner = UiBuilder::new().max_rect(rect - Margin::symmetric(8, 3));
    ui.scope_builder(inner, |ui| {
        ui.horizontal_centered(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0 * GAP;
            let saved = context
                .review
                .saved
                .as_ref()
                .and_then(|saved| saved.as_ref().ok());
            let review = saved.and_then(|saved| saved.review.as_ref());
            if let Some((review, case)) = review.and_then(|r| Some((r, r.cases.get(case)?))) {
                let lamp_name = review.lamps.get(lamp).map_or("", |name| name);
                ui.strong(format!("{}, {lamp_name}", case.name));
                if let Some(cell) = case.cells.get(lamp) {
                    for metric in Metric::ALL {
                        let figure = metric.text(metric.of(cell));
                        ui.label(format!("{} {figure}", metric.name()));
                    }
                }
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let back = Button::new("Back");
                if ui.add(back).on_hover_text("Key: Esc").clicked() {
                    out.push(Command::View(ViewCommand::Cell(None)));
                }
            });
        });
    });
}
