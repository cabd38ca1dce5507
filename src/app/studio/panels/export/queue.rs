//! The export queue: waiting exports, the progress of the running one, and the results of the others.

use crate::command::{Command, ExportCommand, JobCommand};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::job;
use crate::status::RunningJob;
use crate::theme::{self, GAP};
use egui::{Align, Button, Color32, Frame, Label, Layout, Margin, ProgressBar, RichText, ScrollArea, Ui, vec2};
use worker::{Export, ExportStatus, WrittenExport};

/// Draws the queue. Returns its height in points down to the newest export.
pub fn ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) -> f32 {
    let top = ui.cursor().top();
    ui.horizontal(|ui| {
        ui.strong("Queue");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let over = context.exports.queue.iter().filter(|e| e.status.sentence().is_some());
            let over: Vec<u64> = over.map(|export| export.id).collect();
            if !over.is_empty() && ui.button("Clear finished").clicked() {
                out.extend(over.into_iter().map(|id| Command::Export(ExportCommand::Withdraw(id))));
            }
        });
    });
    if context.exports.queue.is_empty() {
        ui.label(
            RichText::new("Queue is empty. Exports run one after another while you keep working.").color(theme::QUIET),
        );
        return ui.cursor().top() - top;
    }
    let heading = ui.cursor().top() - top;
    let mut newest = 0.0;
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        // The running export and the newest are first, so that they need no scrolling.
        let waits = |export: &Export| export.status == ExportStatus::Waiting;
        let mut shown: Vec<_> = context.exports.queue.iter().enumerate().rev().collect();
        shown.sort_by_key(|(_, export)| export.status != ExportStatus::Running);
        let last = context.exports.queue.len() - 1;
        let top = ui.cursor().top();
        for (at, export) in shown {
            let is_behind = context.exports.queue[..at].iter().any(waits);
            // Lighter than the panel, so that the progress bar stands out in it.
            let card = Frame::new().fill(ui.visuals().faint_bg_color).corner_radius(3).inner_margin(Margin::same(8));
            let card = card.show(ui, |ui| {
                ui.set_width(ui.available_width());
                // A press that began on one export never ends on another.
                ui.push_id(export.id, |ui| {
                    export_ui(ui, (export, is_behind), context.status.job.as_ref(), out);
                });
            });
            if at == last {
                newest = card.response.rect.bottom() - top;
            }
        }
    });
    heading + newest
}

/// `is_behind`: true if another export waits before it.
fn export_ui(ui: &mut Ui, (export, is_behind): (&Export, bool), job: Option<&RunningJob>, out: &mut Vec<Command>) {
    let job = job.filter(|_| export.status == ExportStatus::Running);
    let (state, color) = match &export.status {
        ExportStatus::Waiting => ("waiting".to_owned(), theme::QUIET),
        ExportStatus::Running => (job.map_or(String::new(), job::state), theme::QUIET),
        ExportStatus::Done(_) => ("done".to_owned(), theme::TEXT),
        ExportStatus::Failed(_) => ("failed".to_owned(), theme::WARNING),
        ExportStatus::Cancelled(_) => ("cancelled".to_owned(), theme::QUIET),
    };
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            // Within the line, so that waiting exports need little room.
            if export.status == ExportStatus::Waiting {
                let button = Button::new(RichText::new(icons::REMOVE).size(13.0)).small();
                let name = format!("Remove {}", export.name);
                if icons::named_ui(ui, true, button, &name).on_hover_text("Removes it from the queue").clicked() {
                    out.push(Command::Export(ExportCommand::Withdraw(export.id)));
                }
            }
            ui.label(RichText::new(state).size(13.0).color(color));
            // Here no button of a running export takes its place.
            if is_behind && export.status == ExportStatus::Waiting {
                let button = Button::new(RichText::new("Write next").size(13.0)).small();
                let name = format!("Write next: {}", export.name);
                if icons::named_ui(ui, true, button, &name).on_hover_text("To the front of the queue").clicked() {
                    out.push(Command::Export(ExportCommand::WriteNext(export.id)));
                }
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                ui.add(Label::new(&export.name).truncate()).on_hover_text(&export.settings);
            });
        });
    });
    if let Some(job) = job {
        let text = format!("{:.0} %", 100.0 * job.share);
        let bar = ProgressBar::new(job.share)
            .desired_height(18.0)
            .corner_radius(2)
            .fill(if job.is_paused() { theme::TEXT.gamma_multiply(0.35) } else { theme::PRIMARY })
            .text(RichText::new(text).size(13.0).color(Color32::WHITE));
        ui.add(bar).on_hover_text(&job.note);
    }
    match &export.status {
        ExportStatus::Failed(sentence) | ExportStatus::Cancelled(sentence) => {
            let sentence = RichText::new(sentence).size(13.0).color(color);
            ui.add(Label::new(sentence).wrap().selectable(true));
        }
        ExportStatus::Done(WrittenExport { sentence, .. }) => {
            let quiet = RichText::new(sentence).size(13.0).color(theme::QUIET);
            ui.add(Label::new(quiet).wrap().selectable(true));
        }
        ExportStatus::Waiting | ExportStatus::Running => {}
    }
    if export.status != ExportStatus::Waiting {
        ui.horizontal(|ui| buttons_ui(ui, export, job, out));
    }
}

fn buttons_ui(ui: &mut Ui, export: &Export, job: Option<&RunningJob>, out: &mut Vec<Command>) {
    let mut button = |ui: &mut Ui, enabled, icon: &str, text: &str, hint: &str, command: Command| {
        let button = Button::new((icon, text)).min_size(vec2(76.0, 22.0));
        // Several exports have the same buttons.
        let name = format!("{text} {}", export.name);
        if icons::named_ui(ui, enabled, button, &name).on_hover_text(hint).clicked() {
            out.push(command);
        }
    };
    let remove = Command::Export(ExportCommand::Withdraw(export.id));
    match &export.status {
        ExportStatus::Running => {
            let Some(job) = job else { return };
            let (icon, pause) = job::pause_name(job);
            let hint = "Pauses after the current frame and frees the processor for the picture. Key: P";
            button(ui, !job.stopping, icon, pause, hint, Command::Job(JobCommand::Pause));
            let cancel = if job.stopping { "Stopping" } else { "Cancel" };
            let hint = "Stops after the current frame. Finished stills are kept; a movie is not.";
            button(ui, !job.stopping, icons::STOP, cancel, hint, remove);
        }
        ExportStatus::Waiting => {}
        ExportStatus::Done(WrittenExport { folder, .. }) => {
            let hint = base::files::shown(folder);
            let open = Command::Export(ExportCommand::OpenFolder(folder.clone()));
            button(ui, true, icons::FOLDER, "Open folder", &hint, open);
            let hint = "Removes it from the list; the files are kept";
            button(ui, true, icons::REMOVE, "Remove", hint, remove);
        }
        ExportStatus::Failed(_) | ExportStatus::Cancelled(_) => {
            if export.retries {
                let hint = "Queues what is missing again, with the same settings";
                let retry = Command::Export(ExportCommand::Retry(export.id));
                button(ui, true, icons::LOOP, "Retry", hint, retry);
            }
            let hint = "Removes it from the list; files already written are kept";
            button(ui, true, icons::REMOVE, "Remove", hint, remove);
        }
    }
    ui.add_space(GAP);
}
