//! The picture; where there is none, what is needed to make one.

use crate::studio::command::Command;
use crate::studio::news::{Phase, Work};
use crate::studio::panel::{Reading, Sight};
use crate::studio::panels::{TEXT_WIDTH, job, notice_ui};
use crate::studio::theme::{self, GAP};
use crate::training::Preset;
use crate::worker::{Blocked, Need, Relit};
use egui::{Color32, PointerButton, Pos2, Rect, RichText, Sense, TextureHandle, Ui, Vec2, vec2};
use std::sync::Arc;

/// Degrees of yaw per point of a drag: half a turn across a small window.
const DEGREES_PER_POINT: f32 = 0.4;

/// The viewport, and the texture that it shows.
#[derive(Default)]
pub struct ViewportPanel {
    shown: Option<(Arc<Relit>, TextureHandle)>,
}

impl ViewportPanel {
    pub fn ui(&mut self, ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
        let rect = ui.available_rect_before_wrap();
        ui.painter().rect_filled(rect, 0.0, theme::SURROUND);
        self.upload(ui.ctx(), sight.relit);
        match &self.shown {
            Some((relit, texture)) if sight.is_live() => {
                gestures(ui, rect, out);
                let size = vec2(relit.width as f32, relit.height as f32);
                let picture = placed(rect, size, sight);
                let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
                ui.painter().with_clip_rect(rect).image(
                    texture.id(),
                    picture,
                    whole,
                    Color32::WHITE,
                );
                if let Some(sentence) = overlay(sight, relit) {
                    note_ui(ui, rect, &sentence);
                }
            }
            _ => notice_ui(ui, |ui| instead_ui(ui, sight, out)),
        }
        ui.advance_cursor_after_rect(rect);
    }

    fn upload(&mut self, ctx: &egui::Context, relit: Option<&Arc<Relit>>) {
        let Some(relit) = relit else {
            self.shown = None;
            return;
        };
        if self
            .shown
            .as_ref()
            .is_some_and(|(shown, _)| Arc::ptr_eq(shown, relit))
        {
            return;
        }
        let picture = egui::ColorImage::from_rgb([relit.width, relit.height], &relit.rgb);
        let texture = match self.shown.take() {
            Some((_, mut texture)) => {
                texture.set(picture, egui::TextureOptions::LINEAR);
                texture
            }
            None => ctx.load_texture("relit", picture, egui::TextureOptions::LINEAR),
        };
        self.shown = Some((relit.clone(), texture));
    }
}

/// Where the picture is: fitted with a margin, then zoomed and moved.
fn placed(rect: Rect, size: Vec2, sight: &Sight) -> Rect {
    let room = (rect.size() - Vec2::splat(4.0 * GAP)).max(Vec2::splat(1.0));
    let fit = (room / size).min_elem();
    let view = sight.state.view;
    Rect::from_center_size(rect.center() + Vec2::from(view.pan), size * fit * view.zoom)
}

fn gestures(ui: &Ui, rect: Rect, out: &mut Vec<Command>) {
    let response = ui.interact(rect, ui.scope_id().with("picture"), Sense::drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Relit picture"));
    let shift = ui.input(|i| i.modifiers.shift);
    let delta = response.drag_delta();
    if response.dragged_by(PointerButton::Primary) {
        out.push(Command::Turn(
            delta.x * DEGREES_PER_POINT * if shift { 0.1 } else { 1.0 },
        ));
    } else if response.dragged_by(PointerButton::Secondary) && shift {
        out.push(Command::Turn(delta.x * DEGREES_PER_POINT));
    } else if response.dragged_by(PointerButton::Middle) {
        out.push(Command::Pan(delta.into()));
    }
    if let Some(at) = response.hover_pos() {
        let factor = ui.input(|i| (i.smooth_scroll_delta().y / 200.0).exp() * i.zoom_delta());
        if factor != 1.0 {
            out.push(Command::Zoom {
                factor,
                about: (at - rect.center()).into(),
            });
        }
    }
}

/// A sentence to be read over the picture: why it is not the one that was asked for.
fn overlay(sight: &Sight, relit: &Relit) -> Option<String> {
    if let Some(failure) = &sight.news.failure {
        return Some(failure.clone());
    }
    match sight.environment().map(|e| &e.panorama) {
        None => Some("Add an environment: a lat-long panorama, .exr or .hdr".to_owned()),
        Some(Reading::Waiting) => Some("Reading the environment".to_owned()),
        Some(Reading::Failed(sentence)) => Some(sentence.clone()),
        Some(Reading::Done { .. }) if relit.scene.frame != sight.state.frame => {
            Some(format!("Predicting frame {}", sight.state.frame))
        }
        Some(Reading::Done { .. }) => None,
    }
}

fn note_ui(ui: &Ui, rect: Rect, sentence: &str) {
    let width = TEXT_WIDTH.min(rect.width() - 6.0 * GAP);
    let font = egui::TextStyle::Body.resolve(ui.style());
    let text = ui
        .painter()
        .layout(sentence.to_owned(), font, theme::TEXT, width);
    let corner = rect.left_bottom() + vec2(2.0 * GAP, -2.0 * GAP - text.size().y);
    let back = Rect::from_min_size(corner, text.size()).expand2(vec2(10.0, 6.0));
    ui.painter()
        .rect_filled(back, 4.0, Color32::from_black_alpha(200));
    ui.painter().galley(corner, text, theme::TEXT);
    let label = ui.interact(back, ui.scope_id().with("note"), Sense::hover());
    label.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, sentence));
}

/// What stands where the picture would be.
fn instead_ui(ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
    let heading = |ui: &mut Ui, text: &str| {
        ui.heading(text);
        ui.add_space(GAP);
    };
    let mut button = |ui: &mut Ui, text: String, command: Command| {
        ui.add_space(GAP);
        if ui.button(text).clicked() {
            out.push(command);
        }
    };
    let failed = sight
        .news
        .failure
        .as_ref()
        .map(|failure| (failure, theme::ACCENT));
    let said =
        (sight.news.said.as_ref().filter(|_| !sight.is_live())).map(|said| (said, theme::QUIET));
    for (sentence, color) in failed.into_iter().chain(said) {
        ui.colored_label(color, sentence);
        ui.add_space(GAP);
    }
    if let Some(work) = sight.news.work.as_ref().filter(|_| !sight.is_live()) {
        return work_ui(ui, work, out);
    }
    match &sight.news.phase {
        Phase::NoProject => {
            heading(ui, "No project is open");
            ui.label("A project is a folder that points at a shoot. Three commands make one:");
            ui.add_space(GAP);
            for line in [
                "afterlight import PROJECT --shoot FOLDER",
                "afterlight calibrate PROJECT",
                "afterlight train PROJECT",
            ] {
                ui.label(RichText::new(line).monospace());
            }
            ui.add_space(GAP);
            ui.label("Without a shoot of your own, this makes one and all that follows:");
            ui.add_space(GAP);
            ui.label(RichText::new("afterlight demo FOLDER").monospace());
            button(ui, "Open project…".to_owned(), Command::ChooseProject);
        }
        Phase::Opening => heading(ui, "Reading the calibration and the network"),
        Phase::Blocked(Blocked { sentence, need }) => {
            heading(
                ui,
                match need {
                    Some(Need::Calibration) => "This project has to be calibrated",
                    Some(Need::Network) => "This project has no trained network yet",
                    None => "This project cannot be relit",
                },
            );
            ui.label(sentence);
            match need {
                Some(Need::Calibration) => {
                    button(
                        ui,
                        "Calibrate".to_owned(),
                        Command::Provide(Need::Calibration),
                    );
                }
                Some(Need::Network) => {
                    let minutes = Preset::Quick.config().minutes;
                    let time = minutes.map_or(String::new(), |m| format!(" for {m} minutes"));
                    button(ui, format!("Train{time}"), Command::Provide(Need::Network));
                }
                None => button(ui, "Try again".to_owned(), Command::Reopen),
            }
        }
        Phase::Ready { .. } => match sight.environment().map(|e| &e.panorama) {
            _ if sight.news.failure.is_some() => heading(ui, "This picture cannot be made"),
            None => {
                heading(ui, "Light is missing");
                ui.label("Add an environment: a lat-long panorama, .exr or .hdr. It can be dropped here.");
                button(
                    ui,
                    "Add environments…".to_owned(),
                    Command::ChooseEnvironments,
                );
            }
            Some(Reading::Failed(sentence)) => {
                heading(ui, "This environment cannot be read");
                ui.label(sentence);
            }
            Some(Reading::Waiting) => heading(ui, "Reading the environment"),
            Some(Reading::Done { .. }) => {
                heading(ui, &format!("Predicting frame {}", sight.state.frame));
            }
        },
    }
}

fn work_ui(ui: &mut Ui, work: &Work, out: &mut Vec<Command>) {
    ui.heading(job::capitalized(work.what));
    ui.add_space(GAP);
    ui.add(
        egui::ProgressBar::new(work.share)
            .desired_height(8.0)
            .fill(theme::ACCENT),
    );
    let mut text = format!("{} {:.0} %", work.stage, work.share * 100.0);
    let state = job::state(work);
    if !state.is_empty() {
        text += &format!(", {state}");
    }
    ui.label(text);
    ui.label(&work.note);
    ui.add_space(GAP);
    job::buttons_ui(ui, work, out);
}
