//! Who handles which command.

use super::StudioApp;
use crate::command::{Command, LookCommand, ViewCommand};

impl StudioApp {
    pub(super) fn apply(&mut self, command: Command) {
        match command {
            Command::Look(LookCommand::Undo) if self.paints(true) => {
                self.readers.matte.travel(true)
            }
            Command::Look(LookCommand::Redo) if self.paints(false) => {
                self.readers.matte.travel(false)
            }
            Command::Look(command) => {
                if matches!(command, LookCommand::AddEnvironments(_)) {
                    // It answers why files that were dropped before are none.
                    self.status.refusal = None;
                }
                let alone = !self.state.solo.is_empty();
                self.state.change(command);
                if alone && self.state.solo.is_empty() {
                    self.status
                        .say("All lamps light the subject again, by the environment".to_owned());
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
            Command::Looks(command) => self.apply_to_looks(command),
            Command::Environments(command) => self.apply_to_environments(command),
            Command::Dialog(dialog) => self.open_dialog(dialog),
            Command::Chosen(dialog, paths) => {
                self.state.path = None;
                if let Some(command) = self.command_for(dialog, paths) {
                    self.apply(command);
                }
            }
        }
    }

    /// Says why something could not be done, if it could not.
    pub(super) fn refuse_unless(&mut self, done: Result<(), String>) {
        if let Err(sentence) = done {
            self.status.refuse(sentence);
        }
    }
}
