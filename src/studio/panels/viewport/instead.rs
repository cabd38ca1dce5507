//! What stands where the picture would be: what is missing, why, and the button that brings it.

use crate::command::{Command, Dialog, JobCommand, ProjectCommand};
use crate::environment_library::PanoramaState;
use crate::panel_context::PanelContext;
use crate::panels::refusal_ui;
use crate::status::Phase;
use crate::theme::{self, GAP};
use egui::Ui;
use training::Preset;
use worker::{Blocked, Need};

/// What stands where the picture would be.
pub fn instead_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let heading = |ui: &mut Ui, text: &str| {
        ui.heading(text);
        ui.add_space(GAP);
    };
    if let Some(refusal) = &context.status.refusal {
        refusal_ui(ui, refusal, out);
        ui.add_space(GAP);
    }
    let mut button = |ui: &mut Ui, text: String, command: Command| {
        ui.add_space(GAP);
        if ui.button(text).clicked() {
            out.push(command);
        }
    };
    let failed = context
        .status
        .failure
        .as_ref()
        .map(|failure| (failure, theme::ACCENT));
    let said = (context
        .status
        .message
        .as_ref()
        .filter(|_| !context.is_live()))
    .map(|said| (said, theme::QUIET));
    for (sentence, color) in failed.into_iter().chain(said) {
        ui.colored_label(color, sentence);
        ui.add_space(GAP);
    }
    if let Some(job) = context.status.job.as_ref().filter(|_| !context.is_live()) {
        if context.job_has_pane() {
            return heading(ui, "The picture comes with the first checkpoint");
        }
        return super::super::job_ui(ui, job, out);
    }
    match &context.status.phase {
        Phase::NoProject => heading(ui, "No project is open"),
        Phase::Opening => heading(ui, "Reading the calibration and the network"),
        Phase::Blocked(Blocked { sentence, need }) => {
            heading(
                ui,
                match need {
                    Some(Need::Shoot) => "This project's shoot is not there",
                    Some(Need::Calibration) => "This project has to be calibrated",
                    Some(Need::Network) => "This project has no trained network yet",
                    None => "This project cannot be relit",
                },
            );
            ui.label(sentence);
            match need {
                Some(Need::Shoot) => {
                    button(
                        ui,
                        "Locate…".to_owned(),
                        Command::Dialog(Dialog::ShootLocation),
                    );
                    button(
                        ui,
                        "Try again".to_owned(),
                        Command::Project(ProjectCommand::Reopen),
                    );
                }
                Some(Need::Calibration) => {
                    button(
                        ui,
                        "Calibrate".to_owned(),
                        Command::Job(JobCommand::Provide(Need::Calibration)),
                    );
                }
                Some(Need::Network) => {
                    let minutes = Preset::Quick.config().minutes;
                    let time = minutes.map_or(String::new(), |m| format!(" for {m} minutes"));
                    button(
                        ui,
                        format!("Train{time}"),
                        Command::Job(JobCommand::Provide(Need::Network)),
                    );
                }
                None => button(
                    ui,
                    "Try again".to_owned(),
                    Command::Project(ProjectCommand::Reopen),
                ),
            }
        }
        Phase::Ready { .. } => match context.environment().map(|e| &e.panorama) {
            _ if context.status.failure.is_some() => heading(ui, "This picture cannot be made"),
            None => {
                heading(ui, "Light is missing");
                ui.label("Add an environment: a lat-long panorama, .exr or .hdr. It can be dropped here.");
                button(
                    ui,
                    "Add environments…".to_owned(),
                    Command::Dialog(Dialog::Environments),
                );
            }
            Some(PanoramaState::Failed(sentence)) => {
                heading(ui, "This environment cannot be read");
                ui.label(sentence);
            }
            Some(PanoramaState::Waiting) => heading(ui, "Reading the environment"),
            Some(PanoramaState::Done { .. }) => {
                heading(ui, &format!("Predicting frame {}", context.state.frame));
            }
        },
    }
}
