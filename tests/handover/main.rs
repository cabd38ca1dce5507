//! Handover of a shot: Nuke's and Blender's scripts rebuild the picture, and editors read the timeline.

mod blender;
mod exr_file;
mod light_layers;
mod nuke;
mod nuke_script;
mod numbers;
#[path = "../program/mod.rs"]
mod program;
mod refusals;
mod timeline;

use program::succeed;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tempfile::TempDir;

/// Folder with a trained project of four frames and six lamps, `film`.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    for command in [
        "stage shoot --size 32 --frames 4 --lamps 6 --json",
        "import film --shoot shoot --size 32 --json",
        "calibrate film --json",
        "train film --epochs 1 --device cpu --json",
    ] {
        let arguments: Vec<&str> = command.split(' ').collect();
        succeed(folder.path(), &arguments);
    }
    folder
});

/// File name of a shot that is hard to quote; each shot has its own folder.
const HARD_NAME: &str = "it's \"é\" {1}.%04d.exr";

/// Relights the project and hands it over in its own folder; returns the figures and that folder.
fn handed_over(folder: &str, to: &str, options: &str) -> (Value, PathBuf) {
    let at = FOLDER.path();
    let to = format!("{folder}/{to}");
    let mut arguments = vec!["relight", "film", "--device", "cpu", "--json", "--to", &to];
    arguments.extend(options.split(' '));
    let figures = succeed(at, &arguments);
    (figures, at.join(folder))
}

/// The picture channels of a frame in the shot.
fn picture(folder: &Path, frame: usize) -> exr_file::Channels {
    exr_file::read(&folder.join(HARD_NAME.replace("%04d", &format!("{frame:04}"))))
}
