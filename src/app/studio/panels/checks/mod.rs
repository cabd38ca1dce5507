//! Checks of the project: each with its finding, its remedy, and a button for the pane that fixes it.

pub mod query;

use crate::command::{Command, ProjectCommand, WindowCommand};
use crate::layout::{Pane, Workspace};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use check::{Check, Level, Subject};
use egui::{Color32, RichText, ScrollArea, Sense, Ui, vec2};

/// The panel has no state of its own.
#[derive(Default)]
pub struct ChecksPanel;

impl ChecksPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let quiet = |text: &str| RichText::new(text).color(theme::QUIET);
        let report = match &context.readers.check.report {
            Some(Ok(report)) => report,
            Some(Err(sentence)) => {
                ui.label(sentence);
                return;
            }
            None => {
                ui.label(quiet("Checking the project"));
                return;
            }
        };
        let mut checks: Vec<&Check> = report.checks.iter().collect();
        // Checks that need action come first.
        checks.sort_by_key(|check| match check.level {
            Level::Bad => 0,
            Level::Doubtful => 1,
            Level::Unknown => 2,
            Level::Good => 3,
        });
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            for check in checks {
                ui.add_space(0.5 * GAP);
                check_ui(ui, check, context, out);
                ui.add_space(0.5 * GAP);
                ui.separator();
            }
        });
    }
}

fn check_ui(ui: &mut Ui, check: &Check, context: &PanelContext, out: &mut Vec<Command>) {
    ui.horizontal_top(|ui| {
        ui.allocate_ui(vec2(92.0, 20.0), |ui| {
            ui.set_min_width(92.0);
            // Same height as the title beside it.
            ui.spacing_mut().interact_size.y = 17.0;
            ui.horizontal(|ui| {
                dot_ui(ui, check.level);
                ui.label(RichText::new(verdict(check.level)).color(color(check.level)));
            });
        });
        ui.vertical(|ui| {
            let title = match &check.environment {
                Some(name) => format!("{} – {name}", check.subject.title()),
                None => check.subject.title().to_owned(),
            };
            ui.label(RichText::new(title).strong().color(Color32::WHITE));
            let sentence = context.with_lamp_titles(&check.sentence);
            ui.add(egui::Label::new(sentence).wrap().selectable(true));
            if let Some(remedy) = &check.remedy {
                let remedy = RichText::new(remedy).color(theme::QUIET);
                ui.add(egui::Label::new(remedy).wrap().selectable(true));
                let (workspace, pane) = mended_in(check.subject);
                ui.horizontal_wrapped(|ui| {
                    if let Some(correction) = &check.correction {
                        let button = ui.button(context.with_lamp_titles(&correction.words()));
                        let tip = "The files stay as they are. Calibrate again afterwards";
                        if button.on_hover_text(tip).clicked() {
                            let correct = ProjectCommand::CorrectLamps(correction.clone());
                            out.push(Command::Project(correct));
                        }
                    }
                    if ui.button(format!("Open {}", pane.name())).clicked() {
                        out.push(Command::Window(WindowCommand::Workspace(workspace)));
                        out.push(Command::Window(WindowCommand::ShowPane(pane)));
                    }
                });
            }
        });
    });
}

/// Word for a level in the window. Does not name the colour, which colour-blind people may not see.
pub fn verdict(level: Level) -> &'static str {
    match level {
        Level::Good => "Good",
        Level::Doubtful => "Doubtful",
        Level::Bad => "Bad",
        Level::Unknown => "Not known",
    }
}

/// A disc in the colour of a level, always shown beside the level's word.
pub fn dot_ui(ui: &mut Ui, level: Level) {
    let (rect, _) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
    ui.painter().circle_filled(rect.center(), 5.0, color(level));
}

/// The colour of a level.
pub fn color(level: Level) -> Color32 {
    match level {
        Level::Good => theme::GOOD,
        Level::Doubtful => theme::DOUBTFUL,
        Level::Bad => theme::WARNING,
        Level::Unknown => theme::QUIET,
    }
}

/// Workspace and pane in which a person can fix the subject of a check.
fn mended_in(subject: Subject) -> (Workspace, Pane) {
    match subject {
        Subject::LampsSeen
        | Subject::LampsAgree
        | Subject::LampsClipped
        | Subject::LampsHidden
        | Subject::InterviewLight => (Workspace::Calibrate, Pane::Probe),
        Subject::Response => (Workspace::Calibrate, Pane::Gamma),
        Subject::Motion | Subject::Shading | Subject::Frames | Subject::Mattes => (Workspace::Calibrate, Pane::Footage),
        Subject::Coverage | Subject::Contrast => (Workspace::Relight, Pane::Environments),
        Subject::HalfFloats => (Workspace::Relight, Pane::Light),
    }
}
