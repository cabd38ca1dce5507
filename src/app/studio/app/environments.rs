//! The environment list: favourites, search, and steps through the visible entries.

use super::StudioApp;
use crate::command::{Command, EnvironmentsCommand, LookCommand};
use crate::environment_groups;
use base::FileFormat;
use base::error::{Error, Result};
use base::files::{shown, sorted_names};
use std::path::{Path, PathBuf};

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

    /// Adds panoramas, and all panoramas in folders.
    pub(super) fn add_environments(&mut self, paths: Vec<PathBuf>) {
        let add = |paths| Command::Look(LookCommand::AddEnvironments(paths));
        if !paths.iter().any(|path| path.is_dir()) {
            return self.apply(add(paths));
        }
        self.errand_here(
            move || panoramas(paths),
            move |app, found| match found {
                Ok(paths) => app.apply(add(paths)),
                Err(e) => app.status.refuse(e.to_string()),
            },
        );
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

/// True for a file that may be a panorama.
pub(super) fn is_panorama(path: &Path) -> bool {
    FileFormat::of(path).is_some_and(FileFormat::is_picture)
}

/// The files, and the panoramas in the folders, in order of their names.
fn panoramas(paths: Vec<PathBuf>) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for path in paths {
        if !path.is_dir() {
            found.push(path);
            continue;
        }
        let fail = |e| Error::io("open", &path, e, "Check that it is there");
        let names = sorted_names(&path).map_err(fail)?;
        let files = names.iter().map(|name| path.join(name));
        let before = found.len();
        found.extend(files.filter(|file| is_panorama(file) && file.is_file()));
        if found.len() == before {
            return Err(Error::missing(
                format!("{}: no panorama (.exr, .hdr, .png, .jpg, .tif)", shown(&path)),
                "Choose a folder of panoramas, a project or a shoot",
            ));
        }
    }
    Ok(found)
}
