//! The list of environments: the shoot's, those that are built in, and what was added.

use crate::studio::command::Command;
use crate::studio::panel::{Entry, Reading, Sight};
use crate::studio::theme::{self, GAP};
use egui::{Color32, Pos2, Rect, RichText, Sense, Ui, pos2, vec2};

/// The panel keeps nothing.
#[derive(Default)]
pub struct EnvironmentsPanel;

impl EnvironmentsPanel {
    pub fn ui(&mut self, ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
        ui.add_space(GAP);
        ui.horizontal(|ui| {
            ui.strong("Environments");
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui
                    .button("Add…")
                    .on_hover_text("Add panoramas: EXR, HDR, or pictures of 8 or 16 bits; they can be dropped anywhere")
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

/// One environment of the list; tells whether it was clicked.
fn row_ui(ui: &mut Ui, entry: &Entry, yaw_deg: f32, chosen: bool) -> bool {
    let size = vec2(ui.available_width(), 46.0);
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
    let picture = Rect::from_min_size(rect.min + vec2(8.0, 5.0), vec2(72.0, 36.0));
    ui.painter().rect_filled(picture, 0.0, theme::WELL);
    panorama_ui(ui, entry, picture, yaw_deg);
    let text = Rect::from_min_max(
        pos2(picture.right() + GAP, rect.top()),
        rect.max - vec2(GAP, 0.0),
    );
    let state = match &entry.panorama {
        Reading::Waiting => Some("reading"),
        Reading::Failed(_) => Some("cannot be read"),
        Reading::Done { panorama, .. } if !panorama.notes.is_empty() => Some("see the notes"),
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
            let mut hint = format!("{}\n{width} × {height} texels", entry.origin);
            for note in &panorama.notes {
                hint += &format!("\n{note}");
            }
            response.on_hover_text(hint)
        }
        Reading::Waiting => response,
    };
    clicked
}

/// The panorama turned by `yaw_deg`: its content moves to the right.
pub(super) fn panorama_ui(ui: &Ui, entry: &Entry, rect: Rect, yaw_deg: f32) {
    if let Reading::Done { thumbnail, .. } = &entry.panorama {
        let from = -yaw_deg / 360.0;
        let part = Rect::from_min_max(Pos2::new(from, 0.0), Pos2::new(from + 1.0, 1.0));
        ui.painter()
            .image(thumbnail.id(), rect, part, Color32::WHITE);
    }
}
