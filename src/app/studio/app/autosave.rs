//! Automatic saves: the project's look, and a person's preferences.

use crate::favourites::Favourites;
use crate::history::History;
use crate::layout::Layout;
use crate::look::LookSettings;
use crate::preferences::Preferences;
use crate::saved_history;
use crate::saved_look::SavedLook;
use crate::saver::Saver;
use crate::state::State;
use base::error::Result;
use project::Project;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Writes that take longer than this are shown.
const SLOW: Duration = Duration::from_millis(500);

/// The last saved state, and the thread that writes.
pub struct Autosave {
    preferences: Preferences,
    /// The layout was changed, by a command or by a drag still in progress.
    layout_edited: bool,
    look: SavedLook,
    /// Numbers of undo and redo steps at the last save of the look.
    steps: [usize; 2],
    /// Reason the newest text of a file is not on disk.
    failed: Option<String>,
    saver: Saver,
}

impl Autosave {
    pub fn new(preferences: Preferences, wake: impl Fn() + Send + 'static) -> Self {
        Self {
            preferences,
            layout_edited: false,
            look: SavedLook::default(),
            steps: [0; 2],
            failed: None,
            saver: Saver::start(wake),
        }
    }

    /// Takes out the layouts of panes, to draw them beside the preferences. [`Self::return_layout`] puts them back.
    pub fn lend_layout(&mut self) -> Layout {
        std::mem::replace(self.preferences.layout(), Layout::absent())
    }

    /// Puts back the layouts of panes. `edited`: they were changed.
    pub fn return_layout(&mut self, layout: Layout, edited: bool) {
        *self.preferences.layout() = layout;
        self.layout_edited |= edited;
    }

    /// Changes the layouts of panes.
    pub fn edit_layout(&mut self, edit: impl FnOnce(&mut Layout)) {
        edit(self.preferences.layout());
        self.layout_edited = true;
    }

    /// Saves the layouts if they changed.
    pub fn save_layout(&mut self) {
        if std::mem::take(&mut self.layout_edited) {
            self.save_preferences();
        }
    }

    pub fn save_preferences(&self) {
        self.preferences.save(&self.saver);
    }

    /// Folders of the recent projects, newest first.
    pub fn recent(&self) -> &[PathBuf] {
        self.preferences.recent()
    }

    /// Last opening of a recent project, in seconds since 1970.
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

    /// The folded headings.
    pub fn folded(&self) -> &BTreeSet<String> {
        self.preferences.folded()
    }

    /// Folds or unfolds a heading.
    pub fn fold(&mut self, heading: String, folded: bool) {
        self.preferences.fold(heading, folded);
        self.save_preferences();
    }

    /// The favourite environments.
    pub fn favourites(&self) -> &Favourites {
        self.preferences.favourites()
    }

    /// Folders whose panoramas are listed in every project.
    pub fn watched(&self) -> &BTreeSet<PathBuf> {
        self.preferences.watched()
    }

    /// Changes the preferences.
    pub fn edit_preferences(&mut self, edit: impl FnOnce(&mut Preferences)) {
        edit(&mut self.preferences);
        self.save_preferences();
    }

    /// Restores a project's saved look and undo steps in a window that was just opened and already has the project's
    /// environments. `mine`: this window may write to the project.
    ///
    /// # Errors
    /// If the look cannot be parsed: the current look stays, and the file is renamed if `mine`. If the undo steps lead
    /// to a different look: undo starts empty.
    pub fn load_look(&mut self, project: &Project, mine: bool, state: &mut State) -> Result<()> {
        let look = &mut state.look;
        let loaded = match self.saver.unwritten(&SavedLook::path(project)) {
            Some(text) => Ok(SavedLook::parse(&text)),
            None => SavedLook::load(project, mine),
        };
        let loaded = loaded.map(|saved| saved.into_iter().for_each(|saved| saved.apply(look)));
        self.look = SavedLook::from_look(&at_first_frame(look));
        let unwritten = self.saver.unwritten(&saved_history::path(project));
        let history = History::load(project, unwritten.as_deref(), look);
        let history = history.map(|history| state.remember(history));
        self.steps = state.history().map(<[_]>::len);
        loaded.and(history)
    }

    /// Saves a project's look and its undo steps if they changed. The steps are written first: see [`saved_history`].
    pub fn save_look(&mut self, project: &Project, state: &State) {
        let present = at_first_frame(&state.look);
        let (look, history) = (SavedLook::from_look(&present), state.history());
        let steps = history.map(<[_]>::len);
        let is_changed = look != self.look;
        if (is_changed || steps != self.steps)
            && let Some(text) = History::text(history, &present)
        {
            self.saver.save(saved_history::path(project), text);
        }
        if is_changed {
            self.saver.save(SavedLook::path(project), look.text());
        }
        (self.look, self.steps) = (look, steps);
    }

    /// Reason the last write failed; None if all changes are on disk or pending.
    pub fn unsaved(&self) -> Option<&str> {
        self.failed.as_deref()
    }

    /// True if writing takes long; None if nothing is waiting.
    pub fn saving(&self) -> Option<bool> {
        self.saver.waiting().map(|waiting| waiting >= SLOW)
    }

    /// Failed writes since the last call.
    pub fn failures(&mut self) -> impl Iterator<Item = String> {
        self.failed = self.saver.failed();
        self.saver.failures()
    }
}

/// The look as saved: animated settings have their values at frame 0, so that going to another frame is not a change.
fn at_first_frame(look: &LookSettings) -> LookSettings {
    let mut look = look.clone();
    look.follow(0);
    look
}
