//! Expected errors of frames without truth, and poses still missing.

use crate::command::{Command, ReviewCommand, ViewCommand};
use crate::panel_context::PanelContext;
use crate::theme;
use confidence::{ConfidenceReport, FrameConfidence};
use egui::{Button, RichText, Ui};
use footage::scan::counted;

/// Length of the list of frames.
const WORST: usize = 8;

/// Expected errors of frames, and the button that estimates them.
pub fn trust_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let Some(Ok(kept)) = &context.readers.review.saved else { return };
    ui.label(RichText::new("Frames without truth").color(theme::QUIET));
    match &kept.confidence {
        Err(sentence) => {
            ui.colored_label(theme::WARNING, sentence);
        }
        Ok(None) => {
            ui.label(RichText::new("Errors to expect, and frames unlike every photographed pose.").color(theme::QUIET));
        }
        Ok(Some((report, fits))) => {
            if !fits {
                ui.colored_label(theme::WARNING, "Calibration or pictures have changed since. Estimate again.");
            }
            report_ui(ui, context, report, out);
        }
    }
    let able = context.status.job.is_none() && context.is_live();
    let why = if context.status.job.is_none() { "Calibrate first." } else { "Wait until the running job ends." };
    let button = ui.add_enabled(able, Button::new("Estimate errors"));
    if button
        .on_hover_text("Predicts each pose from the others and compares it with its photographs; seconds to a minute")
        .on_disabled_hover_text(why)
        .clicked()
    {
        out.push(Command::Review(ReviewCommand::Trust));
    }
}

fn report_ui(ui: &mut Ui, context: &PanelContext, report: &ConfidenceReport, out: &mut Vec<Command>) {
    let unlike = report.unlike();
    let share = format!("{} of {}", unlike.len(), counted(report.frames.len(), "frame"));
    if unlike.is_empty() {
        ui.label("All frames are like the poses.")
    } else {
        ui.label(format!("{share} unlike every pose. The timeline marks them."))
    };
    let mut over = context.state.viewport.doubts;
    if ui.checkbox(&mut over, "Show expected errors over the picture").on_hover_text("Key: D").changed() {
        out.push(Command::View(ViewCommand::ToggleDoubts));
    }
    let mut frame_ui = |ui: &mut Ui, text: String, frame: usize| {
        let shown = context.state.frame == frame;
        if ui.selectable_label(shown, text).clicked() {
            out.push(Command::View(ViewCommand::Frame(frame)));
        }
    };
    for frame in unlike.into_iter().take(WORST) {
        frame_ui(ui, words(report, frame), frame.frame);
    }
    let worst = report.worst_olats();
    if !worst.is_empty() {
        ui.label("Largest expected errors, with the worst lamp:");
    }
    for (frame, lamp, decibels) in worst.into_iter().take(WORST) {
        let name = context.lamp_title(lamp);
        let shown = context.state.frame == frame.frame && context.state.solo == [lamp];
        let text = format!("Frame {}, {name}: {decibels:.1} dB", frame.frame);
        if ui.selectable_label(shown, text).clicked() {
            out.push(Command::View(ViewCommand::Frame(frame.frame)));
            out.push(Command::View(ViewCommand::Solo(Some(lamp))));
        }
    }
    let mut frame_ui = |ui: &mut Ui, text: String, frame: usize| {
        let shown = context.state.frame == frame;
        if ui.selectable_label(shown, text).clicked() {
            out.push(Command::View(ViewCommand::Frame(frame)));
        }
    };
    if !report.missing.is_empty() {
        ui.label("Photograph the person as in these frames next:");
        ui.horizontal_wrapped(|ui| {
            for &frame in &report.missing {
                frame_ui(ui, format!("Frame {frame}"), frame);
            }
        });
    }
}

/// Distance and expected error of a frame, in words.
fn words(report: &ConfidenceReport, frame: &FrameConfidence) -> String {
    let times = report.times(frame);
    let expected = frame.expected.map_or(String::new(), |expected| {
        let decibels = format!(", {:.1} dB", expected.psnr_db);
        match report.promised(frame) {
            Some(at_least) => format!("{decibels} ({at_least:.1} at least)"),
            None => format!("{decibels} or less"),
        }
    });
    format!("Frame {}: {times:.1} × as far{expected}", frame.frame)
}
