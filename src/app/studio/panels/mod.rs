//! The panels, one file each.

mod accuracy;
mod ago;
mod checks;
mod closing;
mod color_views;
mod diamond;
mod effects;
mod environments;
mod export;
mod footage;
mod front;
mod gamma;
mod group;
mod handle;
pub mod job;
mod lamp_title;
mod light;
mod light_map;
mod lights;
mod log;
mod looks;
mod machine;
mod missing;
mod numbers;
mod panorama;
mod path;
mod picture;
mod probe;
mod project;
mod read_only;
mod review;
mod rows;
mod scopes;
mod sphere;
mod status;
mod still_plot;
mod tabs;
mod timeline;
mod training;
mod viewport;

pub use accuracy::AccuracyPanel;
pub use checks::ChecksPanel;
pub use closing::{closing_ui, leaving_ui};
pub use effects::EffectsPanel;
pub use environments::EnvironmentsPanel;
pub use export::ExportPanel;
pub use footage::FootagePanel;
pub use gamma::GammaPanel;
pub use job::JobPanel;
pub use lamp_title::{lamp_title, with_lamp_titles};
pub use light::LightPanel;
pub use log::log_ui;
pub use looks::LooksPanel;
pub use machine::machine_ui;
pub use path::PathPanel;
pub use picture::PicturePanel;
pub use probe::ProbePanel;
pub use project::ProjectPanel;
pub use review::{LampSheetPanel, ReviewPanel};
pub use scopes::ScopesPanel;
pub use status::StatusPanel;
pub use tabs::TabsPanel;
pub use timeline::TimelinePanel;
pub use training::TrainingPanel;
pub use training::controls::duration as training_time;
pub use viewport::ViewportPanel;

use super::command::{Command, WindowCommand};
use super::icons;
use super::panel_context::PanelContext;
use super::status::RunningJob;
use super::theme::{self, GAP};
use egui::{Align, Color32, Layout, Rect, RichText, ScrollArea, Ui, Vec2, vec2};
use std::ops::RangeInclusive;

/// Maximum width in points of text over the picture.
const TEXT_WIDTH: f32 = 520.0;

/// A notice in place of a picture. It scrolls where it does not fit.
fn notice_ui(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    let rect = ui.available_rect_before_wrap();
    let width = (TEXT_WIDTH + 6.0 * GAP).min(rect.width() - 4.0 * GAP);
    // The box starts above the centre, where people look first.
    let size = vec2(width, rect.height() * 0.75);
    let area = Rect::from_center_size(rect.center() + vec2(0.0, rect.height() * 0.1), size);
    ui.scope_builder(egui::UiBuilder::new().max_rect(area), |ui| {
        egui::Frame::new().fill(theme::PANEL).corner_radius(6).inner_margin(3.0 * GAP).show(
            ui,
            |ui| {
                ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| {
                    ui.vertical_centered(contents);
                });
            },
        );
    });
}

/// The interview frame, dimmed, behind a pane without content. Draws nothing until the frame is read.
fn backdrop_ui(ui: &Ui, context: &PanelContext) {
    let Some(Ok(frame)) = context.footage.picture() else {
        return;
    };
    let rect = ui.available_rect_before_wrap();
    let uv = covering(frame.texture.size_vec2(), rect.size());
    let painter = ui.painter().with_clip_rect(rect);
    painter.image(frame.texture.id(), rect, uv, Color32::from_gray(120));
}

/// The crop of a picture that fills `room` without stretching. Cuts more at the bottom than at the top, where faces are.
fn covering(picture: Vec2, room: Vec2) -> Rect {
    let shares = (room / picture.max(Vec2::splat(1.0))).max(Vec2::splat(f32::MIN_POSITIVE));
    let size = shares / shares.max_elem();
    Rect::from_min_size(((Vec2::splat(1.0) - size) * vec2(0.5, 0.3)).to_pos2(), size)
}

/// The largest rectangle in the middle of `room` that holds a whole picture without stretching.
fn fitting(picture: Vec2, room: Rect) -> Rect {
    Rect::from_center_size(room.center(), picture * (room.size() / picture).min_elem())
}

/// Reason for a refusal, and the button that dismisses the message.
pub fn refusal_ui(ui: &mut Ui, sentence: &str, out: &mut Vec<Command>) {
    ui.horizontal_top(|ui| {
        ui.label(RichText::new(icons::WARNING).size(16.0).color(theme::WARNING));
        let button = 28.0 + GAP;
        let down = Layout::top_down(Align::Min);
        let room = vec2(ui.available_width() - button, 0.0);
        ui.allocate_ui_with_layout(room, down, |ui| {
            ui.set_width(room.x);
            ui.colored_label(theme::WARNING, sentence);
        });
        dismiss_ui(ui, out);
    });
}

/// The button that dismisses a refusal.
fn dismiss_ui(ui: &mut Ui, out: &mut Vec<Command>) {
    let name = "Dismiss message";
    if icons::named_ui(ui, true, icons::alone(icons::REMOVE).frame(false), name)
        .on_hover_text("Hides the message; the log keeps it. Key: Esc")
        .clicked()
    {
        out.push(Command::Window(WindowCommand::DismissRefusal));
    }
}

/// A job that fills the panel: name, progress, and the pause and stop buttons.
fn job_ui(ui: &mut Ui, job: &RunningJob, out: &mut Vec<Command>) {
    ui.heading(job::capitalized(job.what));
    ui.add_space(GAP);
    ui.add(egui::ProgressBar::new(job.share).desired_height(8.0).fill(theme::PRIMARY));
    let mut text = format!("{} {:.0} %", job.stage, job.share * 100.0);
    let state = job::state(job);
    if !state.is_empty() {
        text += &format!(", {state}");
    }
    ui.label(text);
    ui.label(&job.note);
    ui.add_space(GAP);
    job::buttons_ui(ui, job, out);
}

/// A number to drag or type; a double-click resets it.
fn number_ui(
    ui: &mut Ui,
    name: &str,
    field: egui::DragValue,
    width: f32,
    out: &mut Vec<Command>,
    reset: impl FnOnce() -> Command,
) -> egui::Response {
    let label = ui.label(name);
    let response = ui.add_sized(vec2(width, 24.0), field).labelled_by(label.id);
    resettable_ui(ui, response, out, reset)
}

/// As [`number_ui`], with a bar behind it that shows `value` within `range`. Leaves `beside` points of the width free.
fn bar_ui(
    ui: &mut Ui,
    name: &str,
    (field, value, range): (egui::DragValue, f32, &RangeInclusive<f32>),
    beside: f32,
    out: &mut Vec<Command>,
    reset: impl FnOnce() -> Command,
) -> egui::Response {
    let label = if name.chars().count() > rows::MOST_LETTERS {
        // A name given by a person: cut to the room.
        let text = egui::Label::new(name).truncate();
        let narrow = |ui: &mut Ui| {
            ui.set_max_width(rows::MOST_NAME);
            ui.add(text)
        };
        ui.scope(narrow).inner
    } else {
        ui.label(name)
    };
    let width = (ui.available_width() - beside).max(rows::FIELD);
    let response = numbers::over_bar(ui, range, value, |ui| {
        ui.add_sized(vec2(width, 22.0), field).labelled_by(label.id)
    });
    resettable_ui(ui, response, out, reset)
}

fn resettable_ui(
    ui: &Ui,
    response: egui::Response,
    out: &mut Vec<Command>,
    reset: impl FnOnce() -> Command,
) -> egui::Response {
    if numbers::is_reset(ui, &response) {
        out.push(reset());
    }
    theme::hint_at_rest_ui(
        response,
        "Drag, or click to type: 10, +10 or /2. Hold Shift for fine steps; double-click to reset.",
    )
}
