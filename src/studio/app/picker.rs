//! The way to a project: the recent ones, the one that is planned, and the one that a job makes.

use crate::recents::Recents;
use crate::wizard::Wizard;
use std::path::PathBuf;
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
    pub fn ask(&mut self, recent: &[PathBuf], wake: impl Fn() + Clone + Send + 'static) {
        self.recents.look(recent, wake.clone());
        self.wizard.look(wake);
    }
}
