//! The environment list: favourites, search, and steps through the visible entries.

use super::groups;
use super::library::{MOST_WATCHED, Scan, is_panorama};
use crate::app::StudioApp;
use crate::command::{Command, EnvironmentsCommand, LookCommand};
use base::FileFormat;
use base::error::{Error, Result};
use base::files::{natural_order, shown, sorted_names};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

/// Levels of folders below a watched one, and number of folders, that are scanned.
const DEEPEST: usize = 8;
const MOST_FOLDERS: usize = 5000;

impl StudioApp {
    pub(crate) fn apply_to_environments(&mut self, command: EnvironmentsCommand) {
        match command {
            EnvironmentsCommand::Step(step) => self.step_environment(step),
            EnvironmentsCommand::Read(entry) => self.library.read(entry),
            EnvironmentsCommand::ToggleFavourite(entry) => {
                let entry = entry.unwrap_or(self.state.look.environment);
                if let Some(entry) = self.library.entries().get(entry) {
                    let origin = &entry.listed.origin;
                    self.autosave.edit_preferences(|all| all.favourites_mut().toggle(origin));
                }
            }
            EnvironmentsCommand::Search(words) => self.state.search = words,
            EnvironmentsCommand::Unwatch(folder) => {
                self.autosave.edit_preferences(|all| all.unwatch(&folder));
                self.scan_folders();
            }
        }
    }

    /// Asks for the panoramas of the watched folders as they are now.
    pub(crate) fn scan_folders(&mut self) {
        let folders = self.autosave.watched().clone();
        if folders.is_empty() {
            return self.library.watch(Scan::default());
        }
        let wake = self.wake();
        self.folders.forget();
        self.folders.ask(folders, wake, |_| |folders: &_| Ok(scan(folders.iter())));
    }

    /// Takes in the panoramas of the watched folders.
    pub(crate) fn receive_folders(&mut self) {
        let answers: Vec<_> = self.folders.answers().collect();
        for (folders, scan) in answers {
            // A later change of the folders has its own scan.
            if let Ok(scan) = scan
                && folders == *self.autosave.watched()
            {
                self.library.watch(scan);
            }
        }
    }

    /// Adds panoramas, and watches folders. Lights the subject with the first.
    pub(crate) fn add_environments(&mut self, paths: Vec<PathBuf>) {
        let add = |paths| Command::Look(LookCommand::AddEnvironments(paths));
        let (folders, mut files): (Vec<_>, Vec<_>) = paths.into_iter().partition(|p| p.is_dir());
        if folders.is_empty() {
            return self.apply(add(files));
        }
        let folders = folders.into_iter().map(|one| std::path::absolute(&one).unwrap_or(one));
        let folders: Vec<PathBuf> = folders.collect();
        let scanned = folders.clone();
        let firsts = move || scanned.iter().map(|one| first_in(one)).collect::<Result<Vec<PathBuf>>>();
        let root = self.project().map(|project| project.root.clone());
        self.errand(firsts, move |app, found| match found {
            Ok(firsts) => {
                files.extend(firsts);
                app.autosave.edit_preferences(|all| folders.iter().for_each(|one| all.watch(one)));
                app.scan_folders();
                if app.project().map(|project| &project.root) == root.as_ref() {
                    app.apply(add(files));
                }
            }
            Err(e) => app.status.refuse(e.to_string()),
        });
    }

    /// Lights the subject with the entry `step` places further in the visible list.
    fn step_environment(&mut self, step: isize) {
        let groups = groups::shown(self.library.entries(), &self.state.search);
        let next = groups::step(&groups, self.state.look.environment, step);
        if let Some((place, entry)) = next.and_then(|i| Some((i, self.library.entries().get(i)?))) {
            self.apply(entry.choose(place));
        }
    }

    /// Loads the panoramas that the list and the pictures need, and marks the favourites.
    pub(crate) fn follow_environments(&mut self) {
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

/// At most `most` panoramas in a folder and below, in order of their paths, those of upper folders first: EXR and HDR,
/// which leaves out previews; other pictures only in the folder itself, if it has no such files. Folders that cannot be
/// read have none.
fn panoramas_in(folder: &Path, most: usize) -> Vec<PathBuf> {
    let is_hdr =
        |path: &PathBuf| matches!(FileFormat::from_path(path), Some(FileFormat::OpenExr | FileFormat::Radiance));
    let mut found = Vec::new();
    let mut open = VecDeque::from([(folder.to_path_buf(), 0)]);
    let mut visited = 0;
    while let Some((folder, depth)) = open.pop_front()
        && found.len() < most
        && visited < MOST_FOLDERS
    {
        visited += 1;
        let names = sorted_names(&folder).unwrap_or_default();
        let paths = names.into_iter().map(|name| folder.join(name));
        let (mut files, others): (Vec<_>, Vec<_>) = paths.partition(|path| is_panorama(path));
        if depth > 0 || files.iter().any(is_hdr) {
            files.retain(is_hdr);
        }
        found.append(&mut files);
        if depth < DEEPEST {
            // A link to a folder above would lead round for ever.
            let below = others.into_iter().filter(|path| path.is_dir() && !path.is_symlink());
            open.extend(below.map(|path| (path, depth + 1)));
        }
    }
    found.truncate(most);
    found.sort_by(|a, b| natural_order(a, b));
    found
}

fn scan<'a>(folders: impl Iterator<Item = &'a PathBuf>) -> Scan {
    let mut scan = Scan::default();
    for folder in folders {
        match std::fs::read_dir(folder) {
            Ok(_) => scan.panoramas.extend(panoramas_in(folder, MOST_WATCHED)),
            Err(_) => scan.closed.push(folder.clone()),
        }
    }
    scan
}

/// The first panorama of a folder to watch.
fn first_in(folder: &Path) -> Result<PathBuf> {
    // Without it, a path that is not UTF-8 would make the whole file of preferences invalid.
    if folder.to_str().is_none() {
        return Err(Error::invalid(
            format!("{}: its name is not UTF-8 and cannot be saved", shown(folder)),
            "Rename the folder, or add its files one by one",
        ));
    }
    std::fs::read_dir(folder)
        .map_err(|e| Error::io("open", folder, e, "Allow reading it, or choose another folder"))?;
    panoramas_in(folder, 1).pop().ok_or_else(|| {
        Error::missing(
            format!("{}: no panorama (.exr, .hdr, .png, .jpg, .tif)", shown(folder)),
            "Choose a folder of panoramas, a project or a shoot",
        )
    })
}
