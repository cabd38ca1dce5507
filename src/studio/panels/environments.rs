//! The light: the list of environments, how far they are turned, exposure and background.

use crate::scene::Background;
use crate::studio::command::Command;
use crate::studio::panel::{Entry, Reading, Sight};
use crate::studio::panels::number_ui;
use crate::studio::state::EXPOSURE_STOPS;
use crate::studio::theme::{self, GAP};
use egui::{Color32, Pos2, Rect, RichText, Sense, Stroke, Ui, pos2, vec2};

/// The panel keeps nothing.
#[derive(Default)]
pub struct EnvironmentsPanel;

impl EnvironmentsPanel {
    pub fn ui(&mut self, ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
        ui.add_space(GAP);
        preview_ui(ui, sight, out);
        ui.add_space(GAP);
        controls_ui(ui, sight, out);
        ui.add_space(GAP);
        ui.horizontal(|ui| {
            ui.strong("Environments");
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui
                    .button("Add…")
                    .on_hover_text("Add .exr or .hdr panoramas; they can be dropped anywhere")
                    .clicked()
                {
                    out.push(Command::ChooseEnvironments);
                }
            });
        });
        if sight.environments.is_empty() {
            ui.label(
                RichText::new("None yet. Add lat-long panoramas, or drop them here.")
                    .color(theme::QUIET),
            );
        }
        egui::ScrollArea::vertical()
            .auto_shrink(false)
            .show(ui, |ui| {
                ui.spacing_mut().item_spacing.y = 2.0;
                for (i, entry) in sight.environments.iter().enumerate() {
                    let chosen = i == sight.state.look.environment;
                    if row_ui(ui, entry, sight.state.look.yaw_deg, chosen) && !chosen {
                        out.push(Command::Environment(i));
                    }
                }
            });
    }
}

/// The chosen panorama as the subject sees it; dragging it turns it.
fn preview_ui(ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
    let width = ui.available_width();
    let (rect, response) = ui.allocate_exact_size(vec2(width, width / 2.0), Sense::drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Environment"));
    ui.painter().rect_filled(rect, 2.0, theme::WELL);
    if let Some(entry) = sight.environment() {
        panorama_ui(ui, entry, rect, sight.state.look.yaw_deg);
    }
    // What is behind the subject: between these ticks, the column that the camera looks at.
    let tick = Stroke::new(2.0, theme::ACCENT);
    ui.painter()
        .vline(rect.center().x, rect.top()..=rect.top() + 8.0, tick);
    ui.painter()
        .vline(rect.center().x, rect.bottom() - 8.0..=rect.bottom(), tick);
    if response.dragged() {
        // The content follows the hand.
        out.push(Command::Turn(response.drag_delta().x / width * 360.0));
    }
    response
        .on_hover_cursor(egui::CursorIcon::ResizeHorizontal)
        .on_hover_text(
            "What lights the subject. The ticks mark what is behind the subject; drag to turn it.",
        );
}

fn controls_ui(ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
    let look = &sight.state.look;
    egui::Grid::new("light")
        .num_columns(2)
        .min_col_width(84.0)
        .show(ui, |ui| {
            let mut yaw = look.yaw_deg;
            let field = egui::DragValue::new(&mut yaw)
                .speed(0.5)
                .fixed_decimals(1)
                .suffix("°");
            number_ui(ui, "Yaw", field, 110.0, out, || Command::Yaw(0.0));
            if yaw != look.yaw_deg {
                out.push(Command::Yaw(yaw));
            }
            ui.end_row();
            let mut stops = look.exposure_stops;
            let field = egui::DragValue::new(&mut stops)
                .speed(0.02)
                .range(EXPOSURE_STOPS)
                .fixed_decimals(2)
                .suffix(" stops");
            number_ui(ui, "Exposure", field, 110.0, out, || Command::Exposure(0.0));
            if stops != look.exposure_stops {
                out.push(Command::Exposure(stops));
            }
            ui.end_row();
            ui.label("Background");
            let mut shown = look.background == Background::Environment;
            if ui.checkbox(&mut shown, "environment").changed() {
                out.push(Command::Background(if shown {
                    Background::Environment
                } else {
                    Background::None
                }));
            }
            ui.end_row();
            ui.label("");
            ui.horizontal(|ui| {
                for (text, can, command) in [
                    ("Undo", sight.state.can_undo(), Command::Undo),
                    ("Redo", sight.state.can_redo(), Command::Redo),
                ] {
                    if ui.add_enabled(can, egui::Button::new(text)).clicked() {
                        out.push(command);
                    }
                }
            });
            ui.end_row();
        });
}

/// One environment of the list; tells whether it was clicked.
fn row_ui(ui: &mut Ui, entry: &Entry, yaw_deg: f32, chosen: bool) -> bool {
    let size = vec2(ui.available_width(), 52.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response
        .widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, chosen, &entry.name));
    let fill = match (chosen, response.hovered()) {
        (true, _) => Color32::from_gray(68),
        (false, true) => Color32::from_gray(52),
        (false, false) => theme::PANEL,
    };
    ui.painter().rect_filled(rect, 3.0, fill);
    if chosen {
        ui.painter().rect_filled(
            Rect::from_min_size(rect.min, vec2(3.0, rect.height())),
            0.0,
            theme::ACCENT,
        );
    }
    let picture = Rect::from_min_size(rect.min + vec2(8.0, 4.0), vec2(88.0, 44.0));
    ui.painter().rect_filled(picture, 0.0, theme::WELL);
    panorama_ui(ui, entry, picture, yaw_deg);
    let text = Rect::from_min_max(
        pos2(picture.right() + GAP, rect.top()),
        rect.max - vec2(GAP, 0.0),
    );
    let state = match &entry.panorama {
        Reading::Waiting => Some("reading"),
        Reading::Failed(_) => Some("cannot be read"),
        Reading::Done { .. } => None,
    };
    let color = if chosen { Color32::WHITE } else { theme::TEXT };
    let mut job = egui::text::LayoutJob::default();
    let font = |size| egui::FontId::proportional(size);
    job.append(
        &entry.name,
        0.0,
        egui::TextFormat::simple(font(14.0), color),
    );
    if let Some(state) = state {
        job.append(
            &format!("\n{state}"),
            0.0,
            egui::TextFormat::simple(font(12.0), theme::QUIET),
        );
    }
    job.wrap = egui::text::TextWrapping {
        max_width: text.width(),
        max_rows: 2,
        ..Default::default()
    };
    let galley = ui.painter().layout_job(job);
    let at = pos2(text.left(), text.center().y - galley.size().y / 2.0);
    ui.painter().galley(at, galley, color);
    let clicked = response.clicked();
    match &entry.panorama {
        Reading::Failed(sentence) => response.on_hover_text(sentence),
        Reading::Done { panorama, .. } => {
            let (width, height) = panorama.environment.radiance.size();
            let mut hint = format!("{}\n{width} × {height} texels", entry.path.display());
            if panorama.environment.repaired_texels > 0 {
                hint += &format!(
                    "\n{} texels were no light and have been repaired",
                    panorama.environment.repaired_texels
                );
            }
            response.on_hover_text(hint)
        }
        Reading::Waiting => response,
    };
    clicked
}

/// The panorama turned by `yaw_deg`: its content moves to the right.
fn panorama_ui(ui: &Ui, entry: &Entry, rect: Rect, yaw_deg: f32) {
    if let Reading::Done { thumbnail, .. } = &entry.panorama {
        let from = -yaw_deg / 360.0;
        let part = Rect::from_min_max(Pos2::new(from, 0.0), Pos2::new(from + 1.0, 1.0));
        ui.painter()
            .image(thumbnail.id(), rect, part, Color32::WHITE);
    }
}
