//! Preferences of a person: window layouts and recent projects, in one file.

use super::favourites::Favourites;
use super::layout::Layout;
use super::saver::Saver;
use base::files;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// Most recent projects.
const RECENT: usize = 8;

/// Contents of the file.
#[derive(Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
struct PreferencesFile {
    /// Newest first.
    recent: Vec<PathBuf>,
    /// Last opening of each, in seconds since 1970.
    opened: BTreeMap<PathBuf, u64>,
    favourites: Favourites,
    /// Folders whose panoramas are listed in every project.
    watched: BTreeSet<PathBuf>,
    /// Folded headings.
    folded: BTreeSet<String>,
    layout: Layout,
}

/// The preferences, and their file.
#[derive(Default)]
pub struct Preferences {
    saved: PreferencesFile,
    /// Their file; None in a window without preferences.
    file: Option<PathBuf>,
}

impl Preferences {
    /// Preferences of the current user: `afterlight/window.json` in the settings folder. A file that cannot be parsed
    /// is renamed to `window.json.old`, and the defaults are used.
    pub fn of_user() -> Self {
        let folder = dirs::config_dir();
        folder.map_or(Self::default(), |folder| Self::from_file(&folder.join("afterlight").join("window.json")))
    }

    /// Preferences in `file`, which need not exist.
    pub fn from_file(file: &Path) -> Self {
        // Left over from windows that were killed.
        file.parent().into_iter().for_each(files::remove_left_over);
        let saved = match files::read_text(file, files::MOST_TEXT) {
            Err(e) if e.kind() == ErrorKind::NotFound => PreferencesFile::default(),
            text => {
                (text.ok().and_then(|text| serde_json::from_str(&text).ok())).unwrap_or_else(|| {
                    // Kept for inspection, if it can be renamed.
                    let _ = std::fs::rename(file, file.with_extension("json.old"));
                    PreferencesFile::default()
                })
            }
        };
        let layout = saved.layout.mended();
        Self { saved: PreferencesFile { layout, ..saved }, file: Some(file.to_path_buf()) }
    }

    /// Folder of the person's settings; None in a window without preferences.
    pub fn folder(&self) -> Option<&Path> {
        self.file.as_ref()?.parent()
    }

    /// The favourite environments.
    pub fn favourites(&self) -> &Favourites {
        &self.saved.favourites
    }

    pub fn favourites_mut(&mut self) -> &mut Favourites {
        &mut self.saved.favourites
    }

    /// Folders whose panoramas are listed in every project.
    pub fn watched(&self) -> &BTreeSet<PathBuf> {
        &self.saved.watched
    }

    /// Watches a folder, named in UTF-8, in place of those below it.
    pub fn watch(&mut self, folder: &Path) {
        let watched = &mut self.saved.watched;
        if !watched.iter().any(|known| folder.starts_with(known)) {
            watched.retain(|known| !known.starts_with(folder));
            watched.insert(folder.to_path_buf());
        }
    }

    /// Stops watching the folder that holds `folder`.
    pub fn unwatch(&mut self, folder: &Path) {
        self.saved.watched.retain(|known| !folder.starts_with(known));
    }

    /// The folded headings.
    pub fn folded(&self) -> &BTreeSet<String> {
        &self.saved.folded
    }

    /// Folds or unfolds a heading.
    pub fn fold(&mut self, heading: String, folded: bool) {
        if folded {
            self.saved.folded.insert(heading)
        } else {
            self.saved.folded.remove(&heading)
        };
    }

    /// The layouts of panes.
    pub fn layout(&mut self) -> &mut Layout {
        &mut self.saved.layout
    }

    /// The recent projects, newest first.
    pub fn recent(&self) -> &[PathBuf] {
        &self.saved.recent
    }

    /// Last opening of a recent project, in seconds since 1970.
    pub fn opened_at(&self, project: &Path) -> Option<u64> {
        self.saved.opened.get(project).copied()
    }

    /// Puts a project first among the recent projects, with the current time.
    pub fn opened(&mut self, project: &Path) {
        let project = std::path::absolute(project).unwrap_or_else(|_| project.to_path_buf());
        // A path that is not UTF-8 would make the whole file invalid.
        if project.to_str().is_none() {
            return;
        }
        self.saved.recent.retain(|one| *one != project);
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let now = now.map_or(0, |now| now.as_secs());
        self.saved.opened.insert(project.clone(), now);
        self.saved.recent.insert(0, project);
        self.saved.recent.truncate(RECENT);
        self.keep_times();
    }

    /// Removes a project from the recent ones.
    pub fn forget(&mut self, project: &Path) {
        self.saved.recent.retain(|one| one != project);
        self.keep_times();
    }

    /// Drops the times of projects that are no longer recent.
    fn keep_times(&mut self) {
        let PreferencesFile { recent, opened, .. } = &mut self.saved;
        opened.retain(|project, _| recent.contains(project));
    }

    /// Saves the preferences.
    pub fn save(&self, saver: &Saver) {
        if let (Some(file), Ok(text)) = (&self.file, serde_json::to_string_pretty(&self.saved)) {
            saver.save(file.clone(), text);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::layout::{Pane, Workspace};
    use super::*;

    #[test]
    fn what_is_kept_comes_back_and_a_broken_file_is_put_aside() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("settings/window.json");
        let mut preferences = Preferences::from_file(&file);
        for i in 0..=RECENT {
            preferences.opened(&folder.path().join(format!("p{i}")));
        }
        preferences.opened(&folder.path().join("p3"));
        preferences.layout().open(Workspace::Relight, Pane::Gamma);
        for (heading, folded) in [("Lights", true), ("Grade", true), ("Grade", false)] {
            preferences.fold(heading.to_owned(), folded);
        }
        let saver = Saver::start(|| {});
        preferences.save(&saver);
        drop(saver);
        let mut read = Preferences::from_file(&file);
        assert!(read.saved == preferences.saved);
        assert_eq!(read.recent().len(), RECENT);
        assert!(read.recent()[0].ends_with("p3"));
        let times = read.recent().iter().map(|one| read.opened_at(one));
        assert!(times.flatten().all(|time| time > 1_000_000_000));
        assert_eq!(read.saved.opened.len(), RECENT);
        assert!(*read.layout() != Layout::default());
        assert!(read.folded().iter().eq(["Lights"]));

        // A path that is not UTF-8 would make the whole file invalid.
        #[cfg(unix)]
        {
            use std::os::unix::ffi::OsStrExt;
            read.opened(Path::new(std::ffi::OsStr::from_bytes(b"/caf\xe9")));
            assert!(read.recent()[0].ends_with("p3"));
        }

        std::fs::write(&file, b"{ no settings").unwrap();
        assert!(Preferences::from_file(&file).saved == PreferencesFile::default());
        let aside = std::fs::read(file.with_extension("json.old")).unwrap();
        assert_eq!(aside, b"{ no settings");
    }
}
