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

/// Writing that takes longer than this is shown.
const SLOW: Duration = Duration::from_millis(500);

/// The state that was saved last, and the thread that writes.
pub struct Autosave {
    preferences: Preferences,
    /// The layout was changed by a drag that is not over yet, or by a command.
    pub layout_edited: bool,
    look: SavedLook,
    /// Numbers of steps of undo and redo when the look was saved last.
    steps: [usize; 2],
    /// Reason the newest text of a file is not written.
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

    /// The headings that are folded.
    pub fn folded(&self) -> &BTreeSet<String> {
        self.preferences.folded()
    }

    /// Folds a heading or unfolds it.
    pub fn fold(&mut self, heading: String, folded: bool) {
        self.preferences.fold(heading, folded);
        self.save_preferences();
    }

    /// The environments that a person likes.
    pub fn favourites(&self) -> &Favourites {
        self.preferences.favourites()
    }

    /// Changes them.
    pub fn edit_favourites(&mut self, edit: impl FnOnce(&mut Favourites)) {
        edit(self.preferences.favourites_mut());
        self.save_preferences();
    }

    /// Gives a window that was just opened, and has the project's environments, what was saved of the project's look and of
    /// the steps to it. `mine` says whether this window may write there.
    ///
    /// # Errors
    /// When the look cannot be understood: if it is `mine`, it is renamed, and the look stays. When the steps do not lead to
    /// that look: there are none then.
    pub fn load_look(&mut self, project: &Project, mine: bool, state: &mut State) -> Result<()> {
        let look = &mut state.look;
        let loaded = match self.saver.unwritten(&SavedLook::path(project)) {
            Some(text) => Ok(SavedLook::of_text(&text)),
            None => SavedLook::load(project, mine),
        };
        let loaded = loaded.map(|saved| saved.into_iter().for_each(|saved| saved.apply(look)));
        self.look = SavedLook::of(&at_first_frame(look));
        let unwritten = self.saver.unwritten(&saved_history::path(project));
        let history = History::load(project, unwritten.as_deref(), look);
        let history = history.map(|history| state.remember(history));
        self.steps = state.history().map(<[_]>::len);
        loaded.and(history)
    }

    /// Saves a project's look and the steps to it if they changed. The steps come first: see [`saved_history`].
    pub fn save_look(&mut self, project: &Project, state: &State) {
        let present = at_first_frame(&state.look);
        let (look, history) = (SavedLook::of(&present), state.history());
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

    /// Reason a change is not on the disk: the last attempt to write it failed.
    pub fn unsaved(&self) -> Option<&str> {
        self.failed.as_deref()
    }

    /// True if writing takes long; None if nothing waits to be written.
    pub fn saving(&self) -> Option<bool> {
        self.saver.waiting().map(|waiting| waiting >= SLOW)
    }

    /// Failed writes since the last call.
    pub fn failures(&mut self) -> impl Iterator<Item = String> {
        self.failed = self.saver.failed();
        self.saver.failures()
    }
}

/// A look as it is saved: what has keys follows the frame, and another frame is no change.
fn at_first_frame(look: &LookSettings) -> LookSettings {
    let mut look = look.clone();
    look.follow(0);
    look
}
