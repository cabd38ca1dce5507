//! The mirror ball: its photograph with the circle, the light in it, and the lamps.

pub mod command;
mod handler;
mod photograph;
pub mod query;

use crate::command::{CalibrationCommand, Command, LookCommand, ViewCommand, WindowCommand};
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::panels::checks::color;
use crate::panels::lamp_title;
use crate::panels::widgets::frame::column;
use crate::panels::widgets::missing;
use crate::panels::widgets::notice::notice_ui;
use crate::panels::widgets::numbers::computing;
use crate::panels::widgets::rows::number_ui;
use crate::panels::widgets::sphere::{self, DomeView, Mark};
use crate::theme::{self, GAP};
use calibration::Circle;
use calibration::silhouette::Silhouette;
use check::Level;
use egui::{Button, Color32, Label, Pos2, Rect, RichText, Sense, TextureHandle, Ui, pos2, vec2};
use footage::scan::counted;
use photograph::Photograph;
use std::sync::Arc;
use worker::{ProbeView, SeenLamp};

/// Side of the dome in points.
const DOME_SIDE: f32 = 168.0;
/// Height of a lamp's row.
const ROW: f32 = 20.0;
/// Right edges of the table's columns, as shares of its width.
const COLUMNS: [f32; 5] = [0.28, 0.43, 0.61, 0.77, 1.0];

/// Textures of the shown study.
struct ProbeTextures {
    study: Arc<ProbeView>,
    picture: TextureHandle,
    panorama: TextureHandle,
}

/// Holds textures, and the turn of the dome.
#[derive(Default)]
pub struct ProbePanel {
    shown: Option<ProbeTextures>,
    photograph: Photograph,
    dome: DomeView,
}

impl ProbePanel {
    /// Forgets the points clicked on the rim; returns false without any to click.
    pub fn leave_points(&mut self) -> bool {
        self.photograph.points.take().is_some()
    }

    /// The photograph, and the column beside it.
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        // Without a picture, the reason fills the pane.
        if !matches!(context.readers.analysis.probe, Some(Err(_))) {
            column(ui, "Probe", 392.0, |ui| self.side_ui(ui, context, out));
        }
        let rect = ui.available_rect_before_wrap();
        ui.painter().rect_filled(rect, 0.0, theme::SURROUND);
        self.upload(ui, context);
        match &self.shown {
            Some(shown) => {
                let marks = marks(&shown.study, context.state.shoot.photograph);
                let (study, picture) = (shown.study.clone(), shown.picture.id());
                self.photograph.ui(ui, context, &study, picture, &marks, out);
            }
            None => notice_ui(ui, |ui| match &context.readers.analysis.probe {
                Some(Err(sentence)) => {
                    ui.heading("The mirror ball cannot be shown");
                    ui.add_space(GAP);
                    ui.label(sentence);
                    missing::locate_ui(ui, context, out);
                }
                _ => {
                    ui.heading("Reading the mirror balls");
                }
            }),
        }
    }

    /// The light in the ball, the lamps, and the circle's settings.
    fn side_ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        self.upload(ui, context);
        let Some(shown) = &self.shown else { return };
        let (study, panorama) = (shown.study.clone(), shown.panorama.id());
        let marks = marks(&study, context.state.shoot.photograph);
        ui.add_space(GAP);
        photographs_ui(ui, context, &study, out);
        let width = ui.available_width();
        let (rect, response) = ui.allocate_exact_size(vec2(width, 0.5 * width), Sense::click());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Light probe"));
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        ui.painter().image(panorama, rect, whole, Color32::WHITE);
        theme::focus_ui(ui, rect, &response);
        let mut chosen = sphere::latlong_ui(ui, rect, &response, &marks);
        response.on_hover_text("The mirror ball's light as a panorama; its centre is behind the subject");
        ui.add_space(4.0);
        ui.horizontal_top(|ui| {
            chosen = chosen.or(sphere::dome_ui(ui, DOME_SIDE, &mut self.dome, &marks));
            ui.vertical(|ui| figures_ui(ui, context, &study));
        });
        self.circle_ui(ui, context, &study, out);
        findings_ui(ui, &study, context, out);
        chosen = chosen.or(lamps_ui(ui, &study, context.state.shoot.photograph));
        if let Some(lamp) = chosen {
            out.push(Command::View(ViewCommand::Photograph(Some(lamp))));
        }
    }

    /// The circle in numbers, and the buttons that set it.
    fn circle_ui(&mut self, ui: &mut Ui, context: &PanelContext, study: &ProbeView, out: &mut Vec<Command>) {
        let circle = context.state.look.circle.unwrap_or(study.circle);
        let mut changed = circle;
        let reset = || Command::Look(LookCommand::Circle(None));
        ui.horizontal(|ui| {
            let [x, y] = &mut changed.center_px;
            for (name, value) in [("X", x), ("Y", y), ("Radius", &mut changed.radius_px)] {
                let field = computing(value).speed(0.1).fixed_decimals(1);
                number_ui(ui, name, field, 66.0, out, reset);
            }
        });
        if changed != circle
            && let Ok(circle) = Circle::new(changed.center_px, changed.radius_px)
        {
            out.push(Command::Look(LookCommand::Circle(Some(circle))));
        }
        ui.horizontal(|ui| {
            let find = ui.add_enabled(study.found.is_ok(), Button::new("Find"));
            let hint = match &study.found {
                Ok(found) => format!(
                    "The circle found in the photographs: radius {:.1} px, rim within {:.2} px. Key: C",
                    found.circle.radius_px, found.residual_px
                ),
                Err(sentence) => sentence.clone(),
            };
            if find.on_hover_text(&hint).on_disabled_hover_text(hint).clicked() {
                out.push(Command::Calibration(CalibrationCommand::FindCircle));
            }
            let mut by_points = self.photograph.points.is_some();
            let text = match &self.photograph.points {
                Some(points) => format!("Click point {} of 3", points.len() + 1),
                None => "Three points".to_owned(),
            };
            let hint = "Click three points on the rim, far apart. Esc ends this";
            let button = Button::selectable(by_points, text).frame_when_inactive(true);
            if ui.add(button).on_hover_text(hint).clicked() {
                by_points = !by_points;
                self.photograph.points = by_points.then(Vec::new);
                self.photograph.refused = None;
            }
            let by_hand = context.state.look.circle.is_some();
            if ui.add_enabled(by_hand, Button::new("Reset")).on_hover_text("Back to the project's circle").clicked() {
                out.push(reset());
            }
            let idle = context.status.job.is_none();
            let calibrate = theme::main_button(idle, "Calibrate");
            if ui.add_enabled(idle, calibrate).on_hover_text("Calibrates with this circle. Key: Ctrl+Enter").clicked() {
                out.push(Command::Calibration(CalibrationCommand::Start));
            }
        });
        let doubt = study.rim.as_ref().ok().and_then(Silhouette::warning);
        for sentence in self.photograph.refused.iter().chain(&doubt) {
            let sentence = context.with_lamp_titles(sentence);
            ui.label(RichText::new(sentence).color(theme::WARNING).size(13.0));
        }
    }

    fn upload(&mut self, ui: &Ui, context: &PanelContext) {
        let Some(Ok(study)) = &context.readers.analysis.probe else {
            self.shown = None;
            return;
        };
        if self.shown.as_ref().is_some_and(|shown| Arc::ptr_eq(&shown.study, study)) {
            return;
        }
        let texture = |name: &str, picture: &worker::SrgbPicture| {
            let picture = egui::ColorImage::from_rgb([picture.width, picture.height], &picture.rgb);
            ui.ctx().load_texture(name, picture, egui::TextureOptions::LINEAR)
        };
        self.shown = Some(ProbeTextures {
            study: study.clone(),
            picture: texture("ball", &study.picture),
            panorama: texture("probe", &study.panorama),
        });
    }
}

fn marks(study: &ProbeView, chosen: Option<usize>) -> Vec<Mark> {
    let mark = |(number, seen): (usize, &SeenLamp)| Mark {
        number,
        direction: seen.lamp.direction,
        chosen: chosen == Some(number),
        doubtful: seen.lamp.confidence < 0.5,
    };
    study.lamps.iter().enumerate().map(mark).collect()
}

/// Choice of the shown photograph.
fn photographs_ui(ui: &mut Ui, context: &PanelContext, study: &ProbeView, out: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        let name = |lamp: Option<usize>| {
            let lamp = lamp.and_then(|lamp| study.lamps.get(lamp));
            lamp.map_or("Interview".to_owned(), |seen| lamp_title(&seen.lamp.name))
        };
        let label = ui.label("Photograph");
        let shown = context.state.shoot.photograph;
        let list =
            egui::ComboBox::from_id_salt("photograph").selected_text(name(shown)).width(120.0).show_ui(ui, |ui| {
                for lamp in std::iter::once(None).chain((0..study.lamps.len()).map(Some)) {
                    if ui.selectable_label(lamp == shown, name(lamp)).clicked() {
                        out.push(Command::View(ViewCommand::Photograph(lamp)));
                    }
                }
            });
        list.response.labelled_by(label.id);
        for (text, step, hint) in [("Previous", -1, "Key: Page Up"), ("Next", 1, "Key: Page Down")] {
            if ui.button(text).on_hover_text(hint).clicked() {
                out.push(Command::View(ViewCommand::StepPhotograph(step)));
            }
        }
    });
}

fn figures_ui(ui: &mut Ui, context: &PanelContext, study: &ProbeView) {
    ui.spacing_mut().interact_size.y = 0.0;
    let rim = match (&study.rim, context.state.look.circle) {
        (Ok(rim), _) if rim.rim_share > 0.0 => {
            format!("{:.2} px, {:.0} % visible", rim.residual_px, 100.0 * rim.rim_share)
        }
        (Ok(_), _) => "No rim found".to_owned(),
        (Err(_), _) => "Not measured".to_owned(),
    };
    let rows = [
        ("Rim error", rim, "Distance of the rim from the circle (RMS), and how much of it is visible"),
        (
            "Clipped",
            counted(study.clipped_pixels, "pixel"),
            "Brighter than the photograph can record; marked in magenta",
        ),
        (
            "Not visible",
            format!("{:.1} % of the sphere", 100.0 * study.blind_share),
            "Behind the ball, or outside the photograph",
        ),
        ("Filled in", format!("{:.1} % of the light", 100.0 * study.filled_share), "Light filled in behind the ball"),
        ("Lamps", study.lamps.len().to_string(), "Numbered in the order of their files"),
    ];
    egui::Grid::new("figures").num_columns(1).spacing([GAP, 1.0]).show(ui, |ui| {
        for (name, value, hint) in rows {
            ui.label(RichText::new(name).size(12.0).color(theme::QUIET)).on_hover_text(hint);
            ui.end_row();
            ui.label(RichText::new(value).size(13.0)).on_hover_text(hint);
            ui.end_row();
        }
    });
}

/// Problems found with the lamps, in the levels and words of the project check.
fn findings_ui(ui: &mut Ui, study: &ProbeView, context: &PanelContext, out: &mut Vec<Command>) {
    /// Three lines; more can be scrolled to.
    const HEIGHT: f32 = 50.0;
    let found = study.checks.iter().filter(|check| check.level != Level::Good);
    let found: Vec<_> = found.map(|check| (check.sentence.as_str(), color(check.level))).collect();
    if study.findings.is_empty() && found.is_empty() {
        return;
    }
    egui::ScrollArea::vertical().id_salt("findings").max_height(HEIGHT).auto_shrink([false, true]).show(ui, |ui| {
        let wrong = study.findings.iter().map(|finding| (finding.as_str(), theme::WARNING));
        for (sentence, color) in wrong.chain(found) {
            let sentence = context.with_lamp_titles(sentence);
            let text = RichText::new(sentence).size(12.0).color(color);
            let line = ui.add(Label::new(text).sense(Sense::click()));
            if line.on_hover_text("Opens Checks, with the remedy").clicked() {
                out.push(Command::Window(WindowCommand::ShowPane(Pane::Checks)));
            }
        }
    });
}

/// The lamps as a table. Returns the clicked one's number.
fn lamps_ui(ui: &mut Ui, study: &ProbeView, chosen: Option<usize>) -> Option<usize> {
    let mut hit = None;
    row_ui(ui, ["Lamp", "Azimuth", "Elevation", "Energy", "Confidence"], false, theme::QUIET);
    let brightest = (study.lamps.iter()).map(luminance).fold(f32::MIN_POSITIVE, f32::max);
    egui::ScrollArea::vertical().auto_shrink(false).show_rows(ui, ROW, study.lamps.len(), |ui, rows| {
        ui.spacing_mut().item_spacing.y = 0.0;
        for (number, seen) in study.lamps.iter().enumerate().skip(rows.start).take(rows.len()) {
            let lamp = &seen.lamp;
            let direction = lamp.direction;
            let cells = [
                lamp_title(&lamp.name),
                format!("{:.1}°", direction.x.atan2(-direction.z).to_degrees()),
                format!("{:.1}°", direction.y.clamp(-1.0, 1.0).asin().to_degrees()),
                format!("{:.1} %", 100.0 * luminance(seen) / brightest),
                format!("{:.0} %", 100.0 * lamp.confidence),
            ];
            let color = if lamp.confidence < 0.5 { theme::WARNING } else { theme::TEXT };
            let response = row_ui(ui, cells.each_ref().map(String::as_str), chosen == Some(number), color);
            let hint = format!("energy {:.3?} in red, green and blue; spread {:.1}°", lamp.energy, lamp.spread_deg);
            if response.on_hover_text(hint).clicked() {
                hit = Some(number);
            }
        }
    });
    hit
}

fn luminance(seen: &SeenLamp) -> f32 {
    imaging::color::luminance(seen.lamp.energy)
}

fn row_ui(ui: &mut Ui, cells: [&str; 5], chosen: bool, color: Color32) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, chosen, cells[0]));
    if chosen || response.hovered() {
        let gray = if chosen { 68 } else { 52 };
        ui.painter().rect_filled(rect, 2.0, Color32::from_gray(gray));
    }
    theme::focus_ui(ui, rect, &response);
    let mut left = rect.left() + 4.0;
    for (i, cell) in cells.into_iter().enumerate() {
        let right = rect.left() + COLUMNS[i] * rect.width() - 6.0;
        let font = egui::FontId::proportional(13.0);
        let (at, align) = if i == 0 {
            (pos2(left, rect.center().y), egui::Align2::LEFT_CENTER)
        } else {
            (pos2(right, rect.center().y), egui::Align2::RIGHT_CENTER)
        };
        ui.painter().text(at, align, cell, font, color);
        left = right;
    }
    response
}
