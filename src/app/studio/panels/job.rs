//! The running job in the status line, and notices over the window. Neither moves other content when it comes or goes.

use crate::command::{Command, JobCommand, WindowCommand};
use crate::icons;
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::panels::widgets::notice::refusal_ui;
use crate::status::RunningJob;
use crate::theme::{self, GAP};
use egui::{Align, Align2, Area, Button, Color32, Frame, Id, Label, Layout, Order, Rect, RichText, Sense, Ui, vec2};
use std::time::{Duration, Instant};
use worker::ExportStatus;

/// Widths in points, fixed so that nothing moves as the figures change: "Stopping", "100 %", "99 h 59 min left".
const BUTTON_WIDTH: f32 = 100.0;
const SHARE_WIDTH: f32 = 110.0;
const LEFT_WIDTH: f32 = 118.0;
/// Widths in points of a message's text, and of a longer notice.
const MESSAGE_WIDTH: f32 = 360.0;
const NOTICE_WIDTH: f32 = 480.0;
/// Height in points of the line's contents.
const HEIGHT: f32 = 24.0;

/// The panel has no state of its own.
#[derive(Default)]
pub struct JobPanel;

impl JobPanel {
    /// The job for the status line. None without a job, and if the job is shown elsewhere: in the viewport while there
    /// is no relit picture, in the export queue, or in a pane of its own.
    pub fn in_line<'a>(context: &PanelContext<'a>) -> Option<&'a RunningJob> {
        let mut exports = context.exports.queue.iter();
        let queue = context.shows(Pane::Export) && exports.any(|export| export.status == ExportStatus::Running);
        let job = context.status.job.as_ref();
        job.filter(|_| !is_in_viewport(context) && !queue && !context.job_has_pane())
    }

    /// Draws notices over the bottom of the window, where they move nothing: the reason for a refusal, the reason why a
    /// job waits and, if `whole`, the last message. Skips those that a pane already shows. A message does not go while the
    /// pointer is over it.
    pub fn notices_ui(&mut self, ui: &Ui, context: &PanelContext, whole: bool, out: &mut Vec<Command>) {
        let status = context.status;
        let refusal = (status.refusal.as_ref()).filter(|_| !context.refusal_has_pane());
        let job = status.job.as_ref().filter(|_| !context.job_has_pane());
        let held = job.and_then(|job| job.held.as_ref());
        let said = (status.message.as_ref()).filter(|said| whole && !is_said(context, said));
        if refusal.is_none() && held.is_none() && said.is_none() {
            return;
        }
        let area = Area::new(Id::unique("message")).order(Order::Foreground);
        // Over the empty middle of the status line; above it while a job has its buttons there.
        let line = if Self::in_line(context).is_some() { 30.0 + GAP } else { 2.0 };
        let drawn = area.anchor(Align2::CENTER_BOTTOM, vec2(0.0, -line)).show(ui.ctx(), |ui| {
            if let Some(refusal) = refusal {
                notice_ui(ui, |ui| {
                    ui.set_width(NOTICE_WIDTH);
                    refusal_ui(ui, refusal, out);
                });
            }
            if let Some(held) = held {
                notice_ui(ui, |ui| {
                    ui.set_width(NOTICE_WIDTH);
                    let icon = RichText::new(icons::WARNING).size(16.0);
                    ui.label(icon.color(theme::WARNING));
                    ui.add(Label::new(RichText::new(held).color(theme::WARNING)).wrap());
                });
            }
            if let Some(said) = said {
                notice_ui(ui, |ui| message_ui(ui, said, out));
            }
        });
        let is_held = drawn.response.contains_pointer();
        if let Some(left) = said.and(status.message_left()).filter(|_| !is_held) {
            ui.request_repaint_after(left);
            if left.is_zero() {
                out.push(Command::Window(WindowCommand::DismissMessage));
            }
        }
    }
}

/// True if the viewport shows job and message, as it does while there is no relit picture.
fn is_in_viewport(context: &PanelContext) -> bool {
    context.shows(Pane::Picture) && !context.is_live()
}

/// True if a pane shows the last message: the viewport, or the export queue beside the finished export.
fn is_said(context: &PanelContext, said: &str) -> bool {
    let mut exports = context.exports.queue.iter();
    let queue = context.shows(Pane::Export) && exports.any(|export| export.status.sentence() == Some(said));
    is_in_viewport(context) || queue
}

/// A job in one line: name, progress, current step, time left and buttons.
pub fn job_ui(ui: &mut Ui, job: &RunningJob, out: &mut Vec<Command>) {
    ui.label(capitalized(job.what));
    share_ui(ui, job);
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        buttons_ui(ui, job, out);
        ui.allocate_ui_with_layout(vec2(LEFT_WIDTH, HEIGHT), Layout::right_to_left(Align::Center), |ui| {
            ui.set_min_width(LEFT_WIDTH);
            ui.label(RichText::new(state(job)).color(theme::QUIET));
        });
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            let note = if job.held.is_some() || job.note.is_empty() { job.stage } else { &job.note };
            let note = Label::new(RichText::new(note).color(theme::QUIET)).truncate();
            let response = ui.add(note);
            if let Some(said) = job.held.as_ref().or(job.said.as_ref()) {
                response.on_hover_text(said);
            }
        });
    });
}

/// The progress as a bar with a percentage.
fn share_ui(ui: &mut Ui, job: &RunningJob) {
    let (rect, response) = ui.allocate_exact_size(vec2(SHARE_WIDTH, HEIGHT), Sense::hover());
    let text = format!("{:.0} %", job.share * 100.0);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ProgressIndicator, true, &text));
    let bar = rect.shrink2(vec2(0.0, 3.0));
    let fill = if job.is_paused() { Color32::from_gray(92) } else { theme::PRIMARY };
    let done = Rect::from_min_size(bar.min, vec2(bar.width() * job.share, bar.height()));
    ui.painter().rect_filled(bar, 2.0, theme::WELL);
    ui.painter().rect_filled(done, 2.0, fill);
    let font = egui::FontId::proportional(13.0);
    ui.painter().text(bar.center(), Align2::CENTER_CENTER, text, font, Color32::WHITE);
    response.on_hover_text(job.stage);
}

/// The pause and stop buttons, in a fixed width.
pub fn buttons_ui(ui: &mut Ui, job: &RunningJob, out: &mut Vec<Command>) {
    let place = vec2(2.0 * BUTTON_WIDTH + GAP, HEIGHT);
    ui.allocate_ui_with_layout(place, Layout::right_to_left(Align::Center), |ui| {
        stop_ui(ui, job, out);
        pause_ui(ui, job, out);
    });
}

fn stop_ui(ui: &mut Ui, job: &RunningJob, out: &mut Vec<Command>) {
    let size = vec2(BUTTON_WIDTH, HEIGHT);
    let name = if job.stopping { "Stopping" } else { "Stop" };
    let stop = Button::new((icons::STOP, name)).min_size(size);
    if icons::named_ui(ui, !job.stopping, stop, name)
        .on_hover_text("Stops after this step. Finished work is kept.")
        .clicked()
    {
        out.push(Command::Job(JobCommand::Stop));
    }
}

/// Icon and name of the button that pauses or resumes a job.
pub fn pause_name(job: &RunningJob) -> (&'static str, &'static str) {
    if job.is_paused() { (icons::PLAY, "Resume") } else { (icons::PAUSE, "Pause") }
}

fn pause_ui(ui: &mut Ui, job: &RunningJob, out: &mut Vec<Command>) {
    let size = vec2(BUTTON_WIDTH, HEIGHT);
    let (icon, name) = pause_name(job);
    let pause = Button::new((icon, name)).min_size(size);
    if icons::named_ui(ui, !job.stopping, pause, name)
        .on_hover_text("Pauses after this step; training saves first. Key: P")
        .clicked()
    {
        out.push(Command::Job(JobCommand::Pause));
    }
}

/// A notice in a frame of its own.
fn notice_ui(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    let frame = Frame::popup(ui.style()).inner_margin(GAP);
    frame.show(ui, |ui| ui.horizontal_top(contents));
}

/// The last message in full.
fn message_ui(ui: &mut Ui, said: &str, out: &mut Vec<Command>) {
    let down = Layout::top_down(Align::Min);
    ui.allocate_ui_with_layout(vec2(MESSAGE_WIDTH, HEIGHT), down, |ui| {
        ui.set_max_width(MESSAGE_WIDTH);
        ui.add_space(3.0);
        ui.label(said);
    });
    if ui.button("Close").clicked() {
        out.push(Command::Window(WindowCommand::DismissMessage));
    }
}

/// State of a job: "paused", "stopping", or the time left.
pub fn state(job: &RunningJob) -> String {
    if job.stopping {
        return "stopping".to_owned();
    }
    if job.is_paused() {
        return "paused".to_owned();
    }
    job.left(Instant::now()).map_or(String::new(), remaining)
}

fn remaining(left: Duration) -> String {
    let seconds = left.as_secs();
    match seconds / 60 {
        minutes @ 0..60 => format!("{minutes}:{:02} left", seconds % 60),
        minutes => format!("{} h {:02} min left", minutes / 60, minutes % 60),
    }
}

/// Capitalizes the first letter.
pub fn capitalized(phrase: &str) -> String {
    let mut text = phrase.to_owned();
    if let Some(first) = text.get_mut(..1) {
        first.make_ascii_uppercase();
    }
    text
}

/// A job that fills the panel: name, progress, and the pause and stop buttons.
pub fn whole_job_ui(ui: &mut Ui, job: &RunningJob, out: &mut Vec<Command>) {
    ui.heading(capitalized(job.what));
    ui.add_space(GAP);
    ui.add(egui::ProgressBar::new(job.share).desired_height(8.0).fill(theme::PRIMARY));
    let mut text = format!("{} {:.0} %", job.stage, job.share * 100.0);
    let state = state(job);
    if !state.is_empty() {
        text += &format!(", {state}");
    }
    ui.label(text);
    ui.label(&job.note);
    ui.add_space(GAP);
    buttons_ui(ui, job, out);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_is_read_at_a_glance() {
        let said = |seconds| remaining(Duration::from_secs(seconds));
        assert_eq!(said(9), "0:09 left");
        assert_eq!(said(754), "12:34 left");
        assert_eq!(said(7260), "2 h 01 min left");
    }
}
