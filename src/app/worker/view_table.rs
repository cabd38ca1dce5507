//! The display table of the pictures' codes, read again when its file changes.

use base::error::Result;
use imaging::Cube;
use scene::{Inspection, Scene};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The display table that was read last.
#[derive(Default)]
pub(super) struct ViewTable(Option<ReadTable>);

/// A table with its file and the time of the file's last change.
struct ReadTable {
    path: PathBuf,
    changed: Option<SystemTime>,
    table: Cube,
}

/// Modification time of a file, if known.
pub(super) fn changed(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|file| file.modified()).ok()
}

impl ViewTable {
    /// The table in a file, if the scene is shown through one. It reads codes of our own curves, so it does not
    /// apply to a configuration's view.
    pub fn read(&mut self, scene: &Scene, path: Option<&PathBuf>) -> Result<Option<&Cube>> {
        let is_picture = scene.effects.inspection == Inspection::Picture;
        let is_ours = scene.viewing.through.is_none();
        let Some(path) = path.filter(|_| is_picture && is_ours) else { return Ok(None) };
        let changed = changed(path);
        let is_known = |read: &ReadTable| read.path == *path && read.changed == changed;
        if !self.0.as_ref().is_some_and(is_known) {
            self.0 = Some(ReadTable { path: path.clone(), changed, table: Cube::read(path)? });
        }
        Ok(self.0.as_ref().map(|read| &read.table))
    }
}
