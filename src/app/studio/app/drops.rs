//! Files and folders dropped onto the window.

use super::StudioApp;
use crate::command::{Command, Dialog, LookCommand, LooksCommand, ProjectCommand};
use crate::layout::Pane;
use crate::panels::environments::library::is_panorama;
use crate::panels::project::plan::{FILES, folder_of};
use crate::state::Wanted;
use crate::status::Phase;
use crate::stored_look::ENDING;
use base::files::{plain, shown};
use base::{FileFormat, has_extension};
use footage::scan::is_shoot;
use std::path::{Path, PathBuf};
use worker::Need;

impl StudioApp {
    /// Emits the commands for dropped panoramas, projects and shoots.
    pub(super) fn dropped(&mut self, out: &mut Vec<Command>) {
        let dropped = self.ctx.input_mut(|i| std::mem::take(&mut i.raw.dropped_files));
        let paths: Vec<PathBuf> = dropped.iter().map(|file| file.path().to_path_buf()).collect();
        // While a dialog is open, a drop is its answer.
        if let Some(entry) = self.state.covers.path.as_mut().filter(|_| !paths.is_empty()) {
            if entry.wanted != Wanted::NewFile {
                return out.push(Command::Chosen(entry.dialog, paths));
            }
            // A drop never replaces an existing file.
            entry.begun = plain(&paths[0]);
            entry.fills += 1;
            entry.existing = None;
            return;
        }
        let Some(paths) = self.dropped_parts(paths) else { return };
        let (panoramas, others): (Vec<_>, Vec<_>) = paths.into_iter().partition(|p| is_panorama(p));
        if !panoramas.is_empty() {
            out.push(Command::Look(LookCommand::AddEnvironments(panoramas)));
        }
        out.extend(others.into_iter().filter_map(|path| self.dropped_folder(path)));
    }

    /// Returns the dropped paths, or None if they were added to the plan of a new project: while the plan is visible,
    /// or if one is a movie.
    fn dropped_parts(&mut self, paths: Vec<PathBuf>) -> Option<Vec<PathBuf>> {
        let is_whole = |path: &PathBuf| {
            let is_file = FILES.iter().any(|name| path.ends_with(name));
            is_file || is_shoot(path) || path.join("project.toml").exists()
        };
        let is_planned = self.picker.wizard.plan().is_some() && self.state.panes.shows(Pane::Project);
        let is_part = |path: &PathBuf| movies::is_movie(path) || (is_planned && is_part(path));
        if paths.is_empty() || paths.iter().any(is_whole) || !paths.iter().all(is_part) {
            return Some(paths);
        }
        if !is_planned {
            self.apply_to_project(ProjectCommand::New(None));
        }
        let mut plan = self.picker.wizard.plan().cloned().unwrap_or_default();
        let now = self.ctx.input(|input| input.time);
        plan.bring(paths, None, Some(now));
        self.picker.wizard.set(Some(plan));
        None
    }

    /// The command for a dropped folder, or for a file that is not a panorama.
    fn dropped_folder(&mut self, path: PathBuf) -> Option<Command> {
        let path = folder_of(path);
        if path.join("project.toml").exists() {
            return Some(Command::Project(ProjectCommand::Open(path)));
        }
        if path.to_string_lossy().ends_with(ENDING) {
            if self.session.project.is_some() {
                return Some(Command::Looks(LooksCommand::Load(path)));
            }
            let said = "Open a project first: looks need one";
            self.status.refuse(said.to_owned());
            return None;
        }
        if is_shoot(&path) {
            let lost = Some(Need::Shoot);
            return Some(match &self.status.phase {
                Phase::Blocked(blocked) if blocked.need == lost => Command::Project(ProjectCommand::Locate(path)),
                _ => Command::Project(ProjectCommand::New(Some(path))),
            });
        }
        if path.is_dir() {
            return Some(Command::Chosen(Dialog::Environments, vec![path]));
        }
        self.status.refuse(format!(
            "{} cannot be used. Drop a panorama (.exr, .hdr, .png, .jpg, .tif), a look (.look.json), or the folder of \
             panoramas, a project or a shoot",
            shown(&path)
        ));
        None
    }
}

/// True if the path may be a part of a shoot: a folder, a movie, a picture or a list of lamps.
fn is_part(path: &Path) -> bool {
    let is_read = |format: FileFormat| format.is_movie() || format.is_picture() || format.is_sequence();
    path.is_dir() || has_extension(path, "lp") || FileFormat::from_path(path).is_some_and(is_read)
}
