//! The camera's response: the interview beside an exemplar relit with the interview's light, the curve, the
//! loss surface and the histograms, with sliders that act at once.

mod cases;
mod plots;

use crate::command::{CalibrationCommand, Command, LookCommand, ViewCommand};
use crate::panel_context::PanelContext;
use crate::panels::widgets::fit::fitting;
use crate::panels::widgets::frame::column;
use crate::panels::widgets::notice::notice_ui;
use crate::panels::widgets::numbers::computing;
use crate::panels::widgets::rows::number_ui;
use crate::theme::{self, GAP};
use calibration::Trial;
use egui::{Align2, Button, Color32, FontId, Pos2, Rect, RichText, Sense, Stroke, TextureHandle, Ui, Vec2, pos2, vec2};
use imaging::{DualGamma, Response};
use std::sync::Arc;
use worker::GammaView;

/// Textures of the shown view.
struct GammaTextures {
    view: Arc<GammaView>,
    interview: TextureHandle,
    relit: TextureHandle,
    surface: TextureHandle,
    /// The exemplar relit under each open case.
    cases: Vec<TextureHandle>,
}

/// Holds the view's textures.
#[derive(Default)]
pub struct GammaPanel {
    shown: Option<GammaTextures>,
}

impl GammaPanel {
    /// The interview's frame and the relit exemplar, with a wipe between them, and the column beside it.
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        // Without a picture, the reason fills the pane.
        if !matches!(context.readers.analysis.gamma, Some(Err(_))) {
            column(ui, "Gamma", 408.0, |ui| self.side_ui(ui, context, out));
        }
        let rect = ui.available_rect_before_wrap();
        ui.painter().rect_filled(rect, 0.0, theme::SURROUND);
        self.upload(ui, context);
        let Some(shown) = &self.shown else {
            return notice_ui(ui, |ui| match &context.readers.analysis.gamma {
                Some(Err(sentence)) => {
                    ui.heading("The camera's response cannot be shown");
                    ui.add_space(GAP);
                    ui.label(sentence);
                    ui.add_space(GAP);
                    let idle = context.status.job.is_none();
                    if ui.add_enabled(idle, Button::new("Calibrate")).clicked() {
                        out.push(Command::Calibration(CalibrationCommand::Start));
                    }
                }
                _ => {
                    ui.heading("Reading the poses and the interview");
                }
            });
        };
        let picture = shown.interview.size_vec2();
        let room = (rect.size() - Vec2::splat(6.0 * GAP)).max(Vec2::splat(1.0));
        let place = fitting(picture, Rect::from_center_size(rect.center(), room));
        let response = ui.interact(rect, ui.scope_id().with("wipe"), Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Interview and relit pose"));
        let wipe = context.state.viewport.wipe.clamp(0.0, 1.0);
        let line = place.left() + wipe * place.width();
        let painter = ui.painter().with_clip_rect(rect);
        for (texture, from, to) in [(&shown.interview, 0.0, wipe), (&shown.relit, wipe, 1.0)] {
            let part = Rect::from_min_max(pos2(from, 0.0), pos2(to, 1.0));
            let window = |x: f32| place.left() + x * place.width();
            let target = Rect::from_min_max(pos2(window(from), place.top()), pos2(window(to), place.bottom()));
            painter.image(texture.id(), target, part, Color32::WHITE);
        }
        painter.vline(line, place.y_range(), Stroke::new(1.0, theme::ACCENT));
        painter.circle_filled(pos2(line, place.center().y), 5.0, theme::ACCENT);
        theme::focus_ui(ui, rect, &response);
        let caption = |at: Pos2, align: Align2, text: String| {
            let galley = ui.painter().layout_no_wrap(text, FontId::proportional(13.0), theme::TEXT);
            let text = align.anchor_size(at, galley.size());
            ui.painter().rect_filled(text.expand2(vec2(6.0, 3.0)), 3.0, Color32::from_black_alpha(170));
            ui.painter().galley(text.min, galley, theme::TEXT);
        };
        let view = &shown.view;
        caption(place.left_top() + vec2(12.0, 10.0), Align2::LEFT_TOP, format!("interview, frame {}", view.frame));
        let right = place.right_top() + vec2(-12.0, 10.0);
        caption(right, Align2::RIGHT_TOP, format!("{}, relit as the interview", view.poses[view.pose]));
        if let Some(at) = response.interact_pointer_pos().filter(|_| response.dragged() || response.clicked()) {
            out.push(Command::View(ViewCommand::Wipe((at.x - place.left()) / place.width())));
        }
        response.on_hover_cursor(egui::CursorIcon::ResizeHorizontal);
        ui.advance_cursor_after_rect(rect);
    }

    /// The plots and the sliders.
    fn side_ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        self.upload(ui, context);
        let Some(shown) = &self.shown else { return };
        let view = shown.view.clone();
        let trial = context.state.look.trial.unwrap_or(view.calibrated);
        ui.add_space(GAP);
        let width = ui.available_width();
        let side = 0.5 * (width - GAP);
        let mut wanted = trial;
        ui.horizontal_top(|ui| {
            let cases = cases::trials(&view);
            plots::curve_ui(ui, side, &trial, Some(&view.calibrated), &cases);
            if let Some([gamma1, gamma2]) = plots::surface_ui(ui, side, &view, shown.surface.id()) {
                wanted.response = DualGamma { gamma1, gamma2 }.into();
            }
        });
        ui.add_space(2.0);
        cases::ui(ui, context, &view, &shown.cases, out);
        choices_ui(ui, context, &view, &mut wanted, out);
        sliders_ui(ui, &mut wanted, out);
        if wanted != trial {
            out.push(Command::Look(LookCommand::Trial(Some(wanted))));
        }
        buttons_ui(ui, context, &view, out);
        figures_ui(ui, &view);
        plots::histograms_ui(ui, width, ui.available_height().clamp(90.0, 240.0) - GAP, &view);
    }

    fn upload(&mut self, ui: &Ui, context: &PanelContext) {
        let Some(Ok(view)) = &context.readers.analysis.gamma else {
            self.shown = None;
            return;
        };
        if self.shown.as_ref().is_some_and(|shown| Arc::ptr_eq(&shown.view, view)) {
            return;
        }
        let load =
            |name: &str, picture: egui::ColorImage| ui.ctx().load_texture(name, picture, egui::TextureOptions::LINEAR);
        let texture = |name: &str, picture: &worker::SrgbPicture| {
            load(name, egui::ColorImage::from_rgb([picture.width, picture.height], &picture.rgb))
        };
        // Textures that do not depend on the trial stay while a slider moves.
        let old = self.shown.take();
        let surface = match &old {
            Some(old) if Arc::ptr_eq(&old.view.surface, &view.surface) => old.surface.clone(),
            _ => load("surface", plots::surface_picture(&view.surface)),
        };
        let cases = match &old {
            Some(old) if Arc::ptr_eq(&old.view.cases, &view.cases) => old.cases.clone(),
            _ => (view.cases.iter()).map(|(_, relit)| texture("relit under a case", relit)).collect(),
        };
        self.shown = Some(GammaTextures {
            view: view.clone(),
            interview: texture("interview", &view.interview),
            relit: texture("relit exemplar", &view.relit),
            surface,
            cases,
        });
    }
}

/// Choice of the relit exemplar, and of the kind of curve to try.
fn choices_ui(ui: &mut Ui, context: &PanelContext, view: &GammaView, wanted: &mut Trial, out: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        let label = ui.label("Pose");
        let name = |pose: usize| view.poses.get(pose).map_or("", String::as_str);
        let list = egui::ComboBox::from_id_salt("exemplar")
            .selected_text(name(context.state.shoot.pose))
            .width(84.0)
            .show_ui(ui, |ui| {
                for pose in 0..view.poses.len() {
                    if ui.selectable_label(pose == context.state.shoot.pose, name(pose)).clicked() {
                        out.push(Command::View(ViewCommand::Pose(pose)));
                    }
                }
            });
        list.response.labelled_by(label.id);
        ui.add_space(GAP);
        let label = ui.label("Curve");
        let list = egui::ComboBox::from_id_salt("curve").selected_text(wanted.response.name()).width(104.0).show_ui(
            ui,
            |ui| {
                for curve in view.curves.iter() {
                    let name = curve.response.name();
                    let off = format!("{name}: mirror-ball error {:.1} codes", 255.0 * curve.ball);
                    let is_chosen = name == wanted.response.name();
                    if ui.selectable_label(is_chosen, off).clicked() && !is_chosen {
                        *wanted = Trial { response: curve.response, exposure: curve.exposure }.nudged([0.0; 3]);
                    }
                }
            },
        );
        list.response.labelled_by(label.id);
    });
}

fn sliders_ui(ui: &mut Ui, wanted: &mut Trial, out: &mut Vec<Command>) {
    let reset = || Command::Look(LookCommand::Trial(None));
    let exponents = match &mut wanted.response {
        Response::Dual(DualGamma { gamma1, gamma2 }) => {
            vec![("γ1, dark", gamma1), ("γ2, bright", gamma2)]
        }
        Response::Power(gamma) => vec![("γ", gamma)],
        _ => vec![],
    };
    let exponents = exponents.into_iter().map(|(name, value)| (name, value, DualGamma::BOUNDS));
    let exposure = ("Exposure", &mut wanted.exposure, Trial::EXPOSURES);
    egui::Grid::new("sliders").num_columns(3).spacing([GAP, 4.0]).show(ui, |ui| {
        for (name, value, range) in exponents.chain([exposure]) {
            let field = computing(value).speed(0.002).range(range.clone()).fixed_decimals(3);
            number_ui(ui, name, field, 72.0, out, reset);
            ui.spacing_mut().slider_width = ui.available_width() - 4.0;
            let slider = ui.add(egui::Slider::new(value, range).show_value(false));
            slider.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, name));
            ui.end_row();
        }
    });
}

fn buttons_ui(ui: &mut Ui, context: &PanelContext, view: &GammaView, out: &mut Vec<Command>) {
    let idle = context.status.job.is_none();
    let tried = context.state.look.trial.is_some_and(|trial| trial != view.calibrated);
    ui.horizontal(|ui| {
        let fit = theme::main_button(idle, "Fit");
        if ui.add_enabled(idle, fit).on_hover_text("Fits the response to the pictures and mirror balls").clicked() {
            out.push(Command::Look(LookCommand::Trial(None)));
            out.push(Command::Calibration(CalibrationCommand::Start));
        }
        if ui
            .add_enabled(idle && tried, Button::new("Use this"))
            .on_hover_text("Calibrates with the tried response. Key: Ctrl+Enter")
            .clicked()
        {
            out.push(Command::Calibration(CalibrationCommand::Start));
        }
        if ui.add_enabled(tried, Button::new("Reset")).on_hover_text("Back to the calibrated response").clicked() {
            out.push(Command::Look(LookCommand::Trial(None)));
        }
    });
}

fn figures_ui(ui: &mut Ui, view: &GammaView) {
    let quiet = |text: String| RichText::new(text).size(13.0).color(theme::QUIET);
    let response = match (view.calibrated.response, view.deviation) {
        (Response::Dual(DualGamma { gamma1, gamma2 }), [d1, d2]) if d1 > 0.0 && d2 > 0.0 => {
            format!("γ1 {gamma1:.3} ± {d1:.3}, γ2 {gamma2:.3} ± {d2:.3}")
        }
        (response, _) => response.to_string(),
    };
    ui.label(quiet(format!("Calibrated: {response}, exposure {:.3}", view.calibrated.exposure)));
    let others: Vec<String> = (view.curves.iter().skip(1))
        .map(|curve| format!("{} {:.1}", curve.response.name(), 255.0 * curve.ball))
        .collect();
    if let Some(dual) = view.curves.first() {
        ui.label(quiet(format!(
            "Mirror-ball error (8-bit codes): dual gamma {:.1}, {}",
            255.0 * dual.ball,
            others.join(", ")
        )));
    }
    ui.label(quiet(format!(
        "Error as tried (8-bit codes): pictures {:.2}, mirror balls {:.2}",
        255.0 * view.subject_distance,
        255.0 * view.ball_distance
    )));
}
