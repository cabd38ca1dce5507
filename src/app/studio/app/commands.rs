//! Handler of each command.

use super::StudioApp;
use crate::command::{Command, Dialog, LookCommand, ViewCommand};

impl StudioApp {
    pub(crate) fn apply(&mut self, command: Command) {
        // Others may refer to the environment that was tried.
        if !matches!(command, Command::Look(_) | Command::Environments(_) | Command::Window(_)) {
            self.state.keep_tried();
        }
        match command {
            Command::Look(LookCommand::Undo) if self.paints(true) => self.readers.matte.travel(true),
            Command::Look(LookCommand::Redo) if self.paints(false) => self.readers.matte.travel(false),
            Command::Look(LookCommand::Undo) if self.judges() => self.travel_marks(true),
            Command::Look(LookCommand::Redo) if self.judges() => self.travel_marks(false),
            Command::Look(command) => {
                if matches!(command, LookCommand::AddEnvironments(_) | LookCommand::TryEnvironment(_)) {
                    // The command answers an earlier refusal of dropped files.
                    self.status.refusal = None;
                }
                let chooses = matches!(
                    command,
                    LookCommand::Environment(_) | LookCommand::AddEnvironments(_) | LookCommand::TryEnvironment(_)
                );
                let lamps = !self.state.solo.is_empty();
                let lights = self.state.look.lighting.is_solo();
                self.state.change(command);
                let ended =
                    lamps && self.state.solo.is_empty() || chooses && lights && !self.state.look.lighting.is_solo();
                if ended {
                    self.status.mention("Solo ended".to_owned());
                }
            }
            Command::View(ViewCommand::ToggleSecond) if self.flips_cell() => {
                self.state.show(ViewCommand::FlipCell);
            }
            Command::View(command) => self.state.show(command),
            Command::Aim(command) => self.apply_to_aim(command),
            Command::Window(command) => self.apply_to_window(command),
            Command::Calibration(command) => self.apply_to_calibration(command),
            Command::Training(command) => self.apply_to_training(command),
            Command::Review(command) => self.apply_to_review(command),
            Command::Accuracy(command) => self.apply_to_accuracy(command),
            Command::Matte(command) => self.apply_to_matte(command),
            Command::Export(command) => self.apply_to_exports(command),
            Command::Project(command) => self.apply_to_project(command),
            Command::Job(command) => self.apply_to_job(command),
            Command::Machine(command) => self.apply_to_machine(command),
            Command::Timeline(command) => {
                if let Some(command) = self.view.apply_to_timeline(command, &self.state) {
                    self.apply(command);
                }
            }
            Command::Looks(command) => self.apply_to_looks(command),
            Command::Environments(command) => self.apply_to_environments(command),
            Command::Lights(command) => self.apply_to_lights(command),
            Command::Dialog(dialog) => self.open_dialog(dialog),
            Command::NewFile(dialog, path) => self.take_new_file(dialog, path),
            Command::Chosen(Dialog::Environments | Dialog::EnvironmentFolder, paths) => {
                self.state.covers.path = None;
                self.add_environments(paths);
            }
            Command::Chosen(dialog, paths) => {
                self.state.covers.path = None;
                if let Some(command) = self.command_for(dialog, paths) {
                    self.apply(command);
                }
            }
        }
    }

    /// Shows the reason if something could not be done.
    pub(crate) fn refuse_unless(&mut self, done: Result<(), String>) {
        if let Err(sentence) = done {
            self.status.refuse(sentence);
        }
    }
}
