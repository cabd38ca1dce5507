//! Project selection: recent projects, the planned project, and a project made by a job.

use crate::app::Autosave;
use crate::panels::project::plan::Wizard;
use crate::panels::project::recents::Recents;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use worker::Latest;

pub struct ProjectPicker {
    pub recents: Recents,
    pub wizard: Wizard,
    /// Folder of a project that a job has made.
    pub made: Arc<Latest<PathBuf>>,
}

impl ProjectPicker {
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self { recents: Recents::default(), wizard: Wizard::default(), made: Arc::new(Latest::new(wake)) }
    }

    /// Ends the plan and rereads the recent projects, after a project was opened.
    pub fn opened(&mut self) {
        self.recents.invalidate();
        self.wizard.set(None);
    }

    /// Looks at the folders on disk.
    pub fn ask(&mut self, saved: &Autosave, wake: impl Fn() + Clone + Send + 'static) {
        let opened = |project: &Path| saved.opened_at(project);
        self.recents.look(saved.recent(), opened, wake.clone());
        self.wizard.look(wake);
    }
}
