//! The projects that were opened lately, as they are on the disk now.

use project::Project;
use std::path::PathBuf;
use worker::Lookup;

/// A project that was opened before.
#[derive(Clone, Debug, PartialEq)]
pub struct Recent {
    pub folder: PathBuf,
    /// What it is called; its folder's name where that cannot be read.
    pub name: String,
    /// Why it cannot be opened.
    pub trouble: Option<String>,
}

impl Recent {
    fn look(folder: PathBuf) -> Self {
        let called = folder
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let opened = if folder.is_dir() {
            Project::open(&folder).map_err(|e| e.to_string())
        } else {
            Err(
                "The folder is not there any more: it was moved, or its disk is not connected"
                    .to_owned(),
            )
        };
        let (name, trouble) = match opened {
            Ok(project) => (project.settings.name, None),
            Err(sentence) => (called, Some(sentence)),
        };
        Self {
            folder,
            name,
            trouble,
        }
    }
}

/// The list, and the thread that looks at it.
#[derive(Default)]
pub struct Recents {
    list: Vec<Recent>,
    asked: Option<Vec<PathBuf>>,
    clerk: Option<Lookup<Vec<PathBuf>, Vec<Recent>>>,
}

impl Recents {
    /// The newest first; empty until it was looked at.
    pub fn list(&self) -> &[Recent] {
        &self.list
    }

    /// Looks again when it is asked next.
    pub fn renew(&mut self) {
        self.asked = None;
    }

    /// Looks at `folders`, where they are others than before, and takes in what was found.
    pub fn look(&mut self, folders: &[PathBuf], wake: impl Fn() + Send + 'static) {
        if self.asked.as_deref() != Some(folders) {
            let clerk = self.clerk.get_or_insert_with(|| {
                Lookup::start(wake, |folders: Vec<PathBuf>| {
                    folders.into_iter().map(Recent::look).collect()
                })
            });
            clerk.ask(folders.to_vec());
            self.asked = Some(folders.to_vec());
            self.list.retain(|recent| folders.contains(&recent.folder));
        }
        if let Some(list) = self.clerk.iter().flat_map(Lookup::answers).last() {
            self.list = list;
        }
    }
}
