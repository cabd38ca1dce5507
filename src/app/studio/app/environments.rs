//! The environment list: favourites, search, and steps through the visible entries.

use super::StudioApp;
use crate::command::{Command, EnvironmentsCommand, LookCommand};
use crate::environment_groups;

impl StudioApp {
    pub(super) fn apply_to_environments(&mut self, command: EnvironmentsCommand) {
        match command {
            EnvironmentsCommand::Step(step) => self.step_environment(step),
            EnvironmentsCommand::ReadAgain(entry) => self.library.read_again(entry),
            EnvironmentsCommand::ToggleFavourite(entry) => {
                let entry = entry.unwrap_or(self.state.look.environment);
                if let Some(entry) = self.library.entries().get(entry) {
                    let origin = &entry.listed.origin;
                    self.autosave.edit_favourites(|all| all.toggle(origin));
                }
            }
            EnvironmentsCommand::Search(words) => self.state.search = words,
        }
    }

    /// Lights the subject with the entry `step` places further in the visible list.
    fn step_environment(&mut self, step: isize) {
        let groups = environment_groups::shown(self.library.entries(), &self.state.search);
        if let Some(next) = environment_groups::step(&groups, self.state.look.environment, step) {
            self.apply(Command::Look(LookCommand::Environment(next)));
        }
    }

    /// Loads the panoramas that the list and the pictures need, and marks the favourites.
    pub(super) fn follow_environments(&mut self) {
        let state = &self.state;
        self.library.follow(&state.look.environments);
        self.library.mark(self.autosave.favourites());
        let list = &state.look.environments;
        let shown = list.get(state.look.environment).map(|one| &one.origin);
        let compared = state.compare.environments(state, &self.looks);
        let four = state.four.environments(state, &self.looks);
        let used = shown.into_iter().cloned().chain(compared).chain(four);
        let used: Vec<_> = used.collect();
        self.library.use_light(&used);
    }
}
