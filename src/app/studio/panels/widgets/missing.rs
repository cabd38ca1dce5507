//! Buttons for the missing step before the first relit picture.

use crate::command::{Command, Dialog, JobCommand, ProjectCommand, WindowCommand};
use crate::layout::Workspace;
use crate::panel_context::PanelContext;
use crate::status::Phase;
use crate::theme::{self, GAP};
use egui::{RichText, Ui};
use worker::{Blocked, Need};

/// Sentence shown beside the button; None if the button is enough.
pub fn why(blocked: &Blocked) -> Option<&str> {
    let sentence = blocked.sentence.as_str();
    match blocked.need {
        Some(Need::Calibration) if sentence.starts_with("Not calibrated yet") => None,
        _ => Some(sentence),
    }
}

/// Opens the place where a `need` is provided.
pub fn place(need: Option<Need>) -> Command {
    match need {
        Some(Need::Shoot) => Command::Dialog(Dialog::ShootLocation),
        // The picture's place says what is missing, with its button.
        _ => Command::Window(WindowCommand::Workspace(Workspace::Relight)),
    }
}

/// Hint of a button for [`place`].
pub fn hint(need: Option<Need>) -> &'static str {
    match need {
        Some(Need::Shoot) => "The shoot is missing: locate it",
        Some(Need::Mattes) => "No mattes yet: opens Relight, where they are made",
        Some(Need::Calibration) => "Not calibrated yet: opens Relight, where it is done",
        None => "Cannot be relit: opens Relight, with the reason",
    }
}

/// The buttons that provide a `need`, or "Try again" if the window cannot provide it.
pub fn provide_ui(ui: &mut Ui, need: Option<Need>, out: &mut Vec<Command>) {
    match need {
        Some(Need::Shoot) => {
            main_ui(ui, "Locate…", Command::Dialog(Dialog::ShootLocation), out);
            button_ui(ui, "Try again", Command::Project(ProjectCommand::Reopen), out);
        }
        Some(Need::Calibration) => {
            let calibrate = Command::Job(JobCommand::Provide(Need::Calibration));
            main_ui(ui, "Calibrate", calibrate, out);
        }
        Some(Need::Mattes) => {
            main_ui(ui, "Make the mattes", Command::Job(JobCommand::Provide(Need::Mattes)), out);
        }
        None => button_ui(ui, "Try again", Command::Project(ProjectCommand::Reopen), out),
    }
}

/// Placeholder of a panel that needs the relit picture: `sentence`, and the button for the next step.
pub fn no_picture_ui(ui: &mut Ui, context: &PanelContext, sentence: &str, out: &mut Vec<Command>) {
    ui.label(RichText::new(sentence).color(theme::QUIET));
    if context.status.job.is_some() {
        return;
    }
    match &context.status.phase {
        Phase::NoProject => open_project_ui(ui, out),
        Phase::Blocked(blocked) => provide_ui(ui, blocked.need, out),
        Phase::Ready { .. } if context.environment().is_none() => add_environments_ui(ui, out),
        Phase::Opening | Phase::Ready { .. } => {}
    }
}

/// The "Locate…" button, if the project's shoot was moved or its disk is not connected.
pub fn locate_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    if let Phase::Blocked(Blocked { need, .. }) = &context.status.phase
        && *need == Some(Need::Shoot)
    {
        main_ui(ui, "Locate…", Command::Dialog(Dialog::ShootLocation), out);
    }
}

pub fn open_project_ui(ui: &mut Ui, out: &mut Vec<Command>) {
    main_ui(ui, "Open project…", Command::Dialog(Dialog::Project), out);
}

pub fn add_environments_ui(ui: &mut Ui, out: &mut Vec<Command>) {
    main_ui(ui, "Add environments…", Command::Dialog(Dialog::Environments), out);
}

/// The main button, on a line of its own.
fn main_ui(ui: &mut Ui, text: &str, command: Command, out: &mut Vec<Command>) {
    ui.add_space(GAP);
    if ui.add(theme::main_button(true, text)).clicked() {
        out.push(command);
    }
}

/// A button on a line of its own.
pub fn button_ui(ui: &mut Ui, text: &str, command: Command, out: &mut Vec<Command>) {
    ui.add_space(GAP);
    if ui.button(text).clicked() {
        out.push(command);
    }
}
