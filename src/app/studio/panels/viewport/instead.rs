//! Notice in place of the picture: what is missing, why, and the button that provides it.

use crate::command::Command;
use crate::panel_context::PanelContext;
use crate::panels::environments::library::PanoramaState;
use crate::panels::job::whole_job_ui;
use crate::panels::widgets::missing;
use crate::panels::widgets::notice::refusal_ui;
use crate::status::Phase;
use crate::theme::{self, GAP};
use egui::Ui;
use worker::{Blocked, Need};

/// Shown beside the training pane.
const LATER: &str = "The picture appears when the job ends";

/// Content shown in place of the picture.
pub fn instead_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let status = context.status;
    if let Some(refusal) = &status.refusal {
        refusal_ui(ui, refusal, out);
        ui.add_space(GAP);
    }
    let failure = status.failure.as_ref().map(|text| (text, theme::WARNING));
    let said = status.job.as_ref().and_then(|job| job.said.as_ref());
    let message = status.message.as_ref().or(said).filter(|_| !context.is_live());
    let message = message.map(|text| (text, theme::QUIET));
    for (text, color) in failure.into_iter().chain(message) {
        ui.colored_label(color, text);
        ui.add_space(GAP);
    }
    if let Some(job) = status.job.as_ref().filter(|_| !context.is_live()) {
        if context.job_has_pane() {
            return heading_ui(ui, LATER);
        }
        return whole_job_ui(ui, job, out);
    }
    match &status.phase {
        Phase::NoProject => {
            heading_ui(ui, "No project is open");
            missing::open_project_ui(ui, out);
        }
        Phase::Opening => heading_ui(ui, "Reading the calibration and the poses"),
        Phase::Blocked(blocked) => blocked_ui(ui, blocked, out),
        Phase::Ready { .. } if status.failure.is_some() => {
            heading_ui(ui, "This picture cannot be made");
        }
        Phase::Ready { .. } => environment_ui(ui, context, out),
    }
}

/// Needs of the project before it can be relit.
fn blocked_ui(ui: &mut Ui, blocked: &Blocked, out: &mut Vec<Command>) {
    heading_ui(
        ui,
        match blocked.need {
            Some(Need::Shoot) => "The shoot is missing",
            Some(Need::Mattes) => "No mattes yet",
            Some(Need::Calibration) => "Not calibrated yet",
            None => "Cannot be relit",
        },
    );
    if let Some(why) = missing::why(blocked) {
        ui.label(why);
    }
    missing::provide_ui(ui, blocked.need, out);
}

/// Needs of the picture's environment, or a note that the picture is being made.
fn environment_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    match context.environment().map(|entry| &entry.panorama) {
        None => {
            heading_ui(ui, "No environment yet");
            ui.label("Add a lat-long panorama, .exr or .hdr, or drop it here.");
            missing::add_environments_ui(ui, out);
        }
        Some(PanoramaState::Failed(sentence)) => {
            heading_ui(ui, "This environment cannot be read");
            ui.label(sentence);
        }
        Some(PanoramaState::Unread | PanoramaState::Waiting) => heading_ui(ui, "Reading the environment"),
        Some(PanoramaState::Done { .. }) => {
            heading_ui(ui, &format!("Predicting frame {}", context.state.frame));
        }
    }
}

fn heading_ui(ui: &mut Ui, text: &str) {
    ui.heading(text);
    ui.add_space(GAP);
}
