//! The list of environments: the shoot's, the built-in ones, and those a person added.

use crate::command::{Command, Dialog, LookCommand};
use crate::environment_library::{EnvironmentEntry, PanoramaState};
use crate::environment_list::Owner;
use crate::icons;
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{Color32, Pos2, Rect, Response, RichText, Sense, Ui, Vec2, pos2, vec2};

/// Side of the button that removes an entry, in points.
const REMOVE: f32 = 20.0;

/// The panel has no state of its own.
#[derive(Default)]
pub struct EnvironmentsPanel;

impl EnvironmentsPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        ui.add_space(GAP);
        ui.horizontal(|ui| {
            ui.strong("Environments");
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if icons::worded_ui(ui, icons::ADD, "Add…")
                    .on_hover_text("Add panoramas: EXR, HDR, or 8- or 16-bit pictures. They can also be dropped anywhere.")
                    .clicked()
                {
                    out.push(Command::Dialog(Dialog::Environments));
                }
            });
        });
        if context.environments.is_empty() {
            ui.label(
                RichText::new("None yet. Add lat-long panoramas, or drop them here.")
                    .color(theme::QUIET),
            );
        }
        egui::ScrollArea::vertical()
            .auto_shrink(false)
            .show(ui, |ui| {
                ui.spacing_mut().item_spacing.y = 2.0;
                for (i, entry) in context.environments.iter().enumerate() {
                    let chosen = i == context.state.look.environment;
                    let row = row_ui(ui, entry, context, chosen);
                    if chosen
                        && entry.listed.owner == Owner::Person
                        && remove_ui(ui, entry, row.rect)
                    {
                        out.push(Command::Look(LookCommand::RemoveEnvironment(i)));
                    } else if row.clicked() && !(chosen && context.state.solo.is_empty()) {
                        out.push(Command::Look(LookCommand::Environment(i)));
                    }
                }
            });
    }
}

/// One environment of the list.
fn row_ui(ui: &mut Ui, entry: &EnvironmentEntry, context: &PanelContext, chosen: bool) -> Response {
    let size = vec2(ui.available_width(), 46.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| {
        egui::WidgetInfo::selected(egui::Role::Button, true, chosen, context.title(entry))
    });
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
    let yaw_deg = context.state.look.yaw_deg;
    panorama_ui(ui, entry, picture, entry.listed.front().turned(yaw_deg));
    let removable = chosen && entry.listed.owner == Owner::Person;
    let text = Rect::from_min_max(
        pos2(picture.right() + GAP, rect.top()),
        rect.max - vec2(if removable { REMOVE } else { GAP }, 0.0),
    );
    let state = match &entry.panorama {
        PanoramaState::Waiting => Some(["", "reading"]),
        PanoramaState::Failed(_) => Some([icons::WARNING, "unreadable"]),
        PanoramaState::Done { .. } if entry.listed.asks() => Some([icons::FRONT, "front?"]),
        PanoramaState::Done { panorama, .. } if !panorama.notes.is_empty() => {
            Some(["", "see notes"])
        }
        // Tells two of the same name apart.
        PanoramaState::Done { .. } => (entry.listed)
            .is_ambiguous(&context.state.look.environments)
            .then(|| ["", entry.listed.owner.says()]),
    };
    let color = if chosen { Color32::WHITE } else { theme::TEXT };
    // A state stands below the name, which then gets one line.
    let line = |words: &str, size: f32, color, max_rows: usize| {
        let font = egui::FontId::proportional(size);
        let mut job = egui::text::LayoutJob::simple(words.to_owned(), font, color, text.width());
        job.wrap.max_rows = max_rows;
        ui.painter().layout_job(job)
    };
    let name = line(
        &entry.listed.name,
        14.0,
        color,
        if state.is_some() { 1 } else { 2 },
    );
    let state = state.map(|parts| line(parts.join(" ").trim(), 12.0, theme::QUIET, 1));
    let height = name.size().y + state.as_ref().map_or(0.0, |state| state.size().y);
    let at = pos2(text.left(), text.center().y - height / 2.0);
    let below = at + vec2(0.0, name.size().y);
    ui.painter().galley(at, name, color);
    if let Some(state) = state {
        ui.painter().galley(below, state, theme::QUIET);
    }
    match &entry.panorama {
        PanoramaState::Failed(sentence) => response.on_hover_text(sentence),
        PanoramaState::Done { panorama, .. } => {
            let (width, height) = panorama.environment.radiance.size();
            let (from, whose) = (&entry.listed.origin, entry.listed.owner.says());
            let mut hint = format!("{from}\n{whose}, {width} × {height} pixels");
            for note in &panorama.notes {
                hint += &format!("\n{note}");
            }
            response.on_hover_text(hint)
        }
        PanoramaState::Waiting => response,
    }
}

/// The button that removes a row's entry; returns whether it was clicked.
fn remove_ui(ui: &Ui, entry: &EnvironmentEntry, row: Rect) -> bool {
    let name = format!("Remove {}", entry.listed.name);
    let place = Rect::from_min_size(row.right_top() - vec2(REMOVE, 0.0), Vec2::splat(REMOVE));
    let response = ui.interact(place, ui.scope_id().with(&name), Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
    let color = if response.hovered() || response.has_focus() {
        theme::ACCENT
    } else {
        theme::QUIET
    };
    let font = egui::FontId::proportional(14.0);
    ui.painter().text(
        place.center(),
        egui::Align2::CENTER_CENTER,
        icons::REMOVE,
        font,
        color,
    );
    response
        .on_hover_text(format!("{name} from the list; the file is kept"))
        .clicked()
}

/// The panorama turned by `yaw_deg`; positive angles move the content to the right.
pub(super) fn panorama_ui(ui: &Ui, entry: &EnvironmentEntry, rect: Rect, yaw_deg: f32) {
    if let PanoramaState::Done { thumbnail, .. } = &entry.panorama {
        let from = -yaw_deg / 360.0;
        let part = Rect::from_min_max(Pos2::new(from, 0.0), Pos2::new(from + 1.0, 1.0));
        ui.painter()
            .image(thumbnail.id(), rect, part, Color32::WHITE);
    }
}
