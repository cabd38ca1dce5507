//! The way to a project: the recent ones, the one that is planned, and the one that a job makes.

use super::autosave::Autosave;
use crate::recents::Recents;
use crate::wizard::Wizard;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use worker::Latest;

pub struct ProjectPicker {
    pub recents: Recents,
    pub wizard: Wizard,
    /// The folder of a project that a job has made.
    pub made: Arc<Latest<PathBuf>>,
}

impl ProjectPicker {
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            recents: Recents::default(),
            wizard: Wizard::default(),
            made: Arc::new(Latest::new(wake)),
        }
    }

    /// A project was opened: none is planned, and the recent ones are others.
    pub fn opened(&mut self) {
        self.recents.invalidate();
        self.wizard.set(None);
    }

    /// Looks at the folders on the disk.
    pub fn ask(&mut self, saved: &Autosave, wake: impl Fn() + Clone + Send + 'static) {
        let opened = |project: &Path| saved.opened_at(project);
        self.recents.look(saved.recent(), opened, wake.clone());
        self.wizard.look(wake);
    }
}
