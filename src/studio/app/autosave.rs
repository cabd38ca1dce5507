//! What is saved without being asked for: the project's look, and a person's preferences.

use crate::layout::Layout;
use crate::look::LookSettings;
use crate::preferences::Preferences;
use crate::saved_look::SavedLook;
use crate::saver::Saver;
use base::error::Result;
use project::Project;
use std::path::{Path, PathBuf};

/// What was saved last, and the thread that writes.
pub struct Autosave {
    preferences: Preferences,
    /// The layout was changed by a drag that is not over yet, or by a command.
    pub layout_edited: bool,
    look: SavedLook,
    saver: Saver,
}

impl Autosave {
    pub fn new(preferences: Preferences, wake: impl Fn() + Send + 'static) -> Self {
        Self {
            preferences,
            layout_edited: false,
            look: SavedLook::default(),
            saver: Saver::start(wake),
        }
    }

    /// The arrangements of panes.
    pub fn layout(&mut self) -> &mut Layout {
        self.preferences.layout()
    }

    /// Changes the arrangements of panes.
    pub fn edit_layout(&mut self, edit: impl FnOnce(&mut Layout)) {
        edit(self.preferences.layout());
        self.layout_edited = true;
    }

    /// Saves the arrangements if they changed.
    pub fn save_layout(&mut self) {
        if std::mem::take(&mut self.layout_edited) {
            self.save_preferences();
        }
    }

    pub fn save_preferences(&self) {
        self.preferences.save(&self.saver);
    }

    /// The recent projects' folders, the newest first.
    pub fn recent(&self) -> &[PathBuf] {
        self.preferences.recent()
    }

    /// When a recent project was opened last, in seconds since 1970.
    pub fn opened_at(&self, project: &Path) -> Option<u64> {
        self.preferences.opened_at(project)
    }

    /// Puts a project first among the recent ones.
    pub fn remember(&mut self, project: &Path) {
        self.preferences.opened(project);
        self.save_preferences();
    }

    /// Removes a project from the recent ones.
    pub fn forget(&mut self, project: &Path) {
        self.preferences.forget(project);
        self.save_preferences();
    }

    /// Gives `look`, which has the project's environments, what was saved of the project's look. `mine` says whether
    /// this window may write there.
    ///
    /// # Errors
    /// When the file cannot be understood: if it is `mine`, it is renamed; the look stays.
    pub fn load_look(
        &mut self,
        project: &Project,
        mine: bool,
        look: &mut LookSettings,
    ) -> Result<()> {
        let loaded = match self.saver.unwritten(&SavedLook::path(project)) {
            Some(text) => Ok(SavedLook::of_text(&text)),
            None => SavedLook::load(project, mine),
        };
        let loaded = loaded.map(|saved| saved.into_iter().for_each(|saved| saved.apply(look)));
        self.look = SavedLook::of(look);
        loaded
    }

    /// Saves a project's look if it changed.
    pub fn save_look(&mut self, project: &Project, look: &LookSettings) {
        let look = SavedLook::of(look);
        if look != self.look {
            self.saver.save(SavedLook::path(project), look.text());
            self.look = look;
        }
    }

    /// What could not be written since the last call.
    pub fn failures(&self) -> impl Iterator<Item = String> {
        self.saver.failures()
    }
}
