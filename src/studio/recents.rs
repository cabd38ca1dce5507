//! The recent projects, as they are on the disk now.

use project::Project;
use std::path::PathBuf;
use worker::Lookup;

/// A recent project.
#[derive(Clone, Debug, PartialEq)]
pub struct Recent {
    pub folder: PathBuf,
    /// Its name; the folder's name if it cannot be read.
    pub name: String,
    /// Why it cannot be opened.
    pub trouble: Option<String>,
}

impl Recent {
    fn look(folder: PathBuf) -> Self {
        let opened = if folder.is_dir() {
            Project::open(&folder).map_err(|e| e.to_string())
        } else {
            Err("The folder is missing: it was moved, or its disk is not connected".to_owned())
        };
        match opened {
            Ok(project) => Self {
                folder,
                name: project.settings.name,
                trouble: None,
            },
            Err(sentence) => Self::unreadable(folder, sentence),
        }
    }

    fn unreadable(folder: PathBuf, sentence: String) -> Self {
        let called = folder.file_name().unwrap_or_default();
        Self {
            name: called.to_string_lossy().into_owned(),
            folder,
            trouble: Some(sentence),
        }
    }
}

/// The list, and the thread that reads it.
#[derive(Default)]
pub struct Recents {
    list: Vec<Recent>,
    asked: Option<Vec<PathBuf>>,
    lookup: Option<Lookup<Vec<PathBuf>, Vec<Recent>>>,
}

impl Recents {
    /// The newest first; empty until it is read.
    pub fn list(&self) -> &[Recent] {
        &self.list
    }

    /// The next [`Self::look`] reads the list again.
    pub fn invalidate(&mut self) {
        self.asked = None;
    }

    /// Reads the projects in `folders`, if they changed, and takes in what was read.
    pub fn look(&mut self, folders: &[PathBuf], wake: impl Fn() + Send + 'static) {
        if self.asked.as_deref() != Some(folders) {
            let lookup = self.lookup.get_or_insert_with(|| {
                Lookup::start(wake, |folders: &Vec<PathBuf>| {
                    Ok(folders.iter().cloned().map(Recent::look).collect())
                })
            });
            lookup.ask(folders.to_vec());
            self.asked = Some(folders.to_vec());
            self.list.retain(|recent| folders.contains(&recent.folder));
        }
        if let Some((folders, list)) = self.lookup.iter().flat_map(Lookup::answers).last() {
            self.list = list.unwrap_or_else(|e| {
                let untold = |folder| Recent::unreadable(folder, e.to_string());
                folders.into_iter().map(untold).collect()
            });
        }
    }
}
