//! The newest picture of the demo's shoot while it is traced.

use super::hero::picture_ui;
use base::error::{Error, Result};
use base::files::sorted_names;
use egui::{ColorImage, TextureHandle, TextureOptions, Ui};
use imaging::file::codes_from_memory;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use worker::Query;

/// Time in seconds between two looks at the folder.
const EVERY_S: f64 = 0.5;

/// The folder of the demo being made, and its picture.
#[derive(Default)]
pub struct Traced {
    folder: Option<PathBuf>,
    query: Query<(PathBuf, u64), Option<(PathBuf, ColorImage)>>,
    /// File and contents of the picture shown.
    shown: Option<(PathBuf, TextureHandle)>,
}

impl Traced {
    /// Follows the demo in `folder`.
    pub fn from_folder(folder: PathBuf) -> Self {
        Self { folder: Some(folder), ..Self::default() }
    }

    /// Draws the newest picture, at most `height` points high.
    pub fn ui(&mut self, ui: &mut Ui, height: f32) {
        let Some(folder) = &self.folder else { return };
        let time = ui.input(|input| input.time);
        let ctx = ui.ctx().clone();
        let mut last = None;
        let look = move |(folder, _): &(PathBuf, u64)| newest(folder, &mut last);
        let key = (folder.join("shoot"), (time / EVERY_S) as u64);
        self.query.ask(key, move || ctx.request_repaint(), |_| look);
        ui.request_repaint_after(Duration::from_secs_f64(EVERY_S));
        // A file that is still being written is read at the next look.
        let answers = self.query.answers().filter_map(|(_, found)| found.ok().flatten());
        if let Some((file, picture)) = answers.last() {
            let texture = ui.ctx().load_texture("traced", picture, TextureOptions::LINEAR);
            self.shown = Some((file, texture));
        }
        let Some((file, texture)) = &self.shown else { return };
        let name = file.strip_prefix(folder).unwrap_or(file).display().to_string();
        picture_ui(ui, texture, height, &name).on_hover_text(name);
    }
}

/// The newest frame or OLAT of a shoot, unless it is the `last`.
fn newest(shoot: &Path, last: &mut Option<PathBuf>) -> Result<Option<(PathBuf, ColorImage)>> {
    let inside = |folder: PathBuf| -> Vec<PathBuf> {
        let names = sorted_names(&folder).unwrap_or_default();
        names.into_iter().map(|name| folder.join(name)).collect()
    };
    let poses = inside(shoot.join("exemplars")).into_iter().flat_map(inside);
    let written = poses.chain(inside(shoot.join("interview"))).filter_map(|file| {
        let written: SystemTime = file.metadata().ok()?.modified().ok()?;
        file.extension().is_some_and(|end| end == "png").then_some((written, file))
    });
    let Some((_, file)) = written.max().filter(|(_, file)| last.as_ref() != Some(file)) else { return Ok(None) };
    let bytes = std::fs::read(&file).map_err(|e| Error::io("read", &file, e, "Check that the disk is there"))?;
    let (size, rgb) = codes_from_memory(&bytes)?;
    *last = Some(file.clone());
    Ok(Some((file, ColorImage::from_rgb(size.into(), &rgb))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_whole_picture_is_shown_once() {
        let folder = tempfile::tempdir().unwrap();
        let mut last = None;
        assert!(newest(folder.path(), &mut last).unwrap().is_none(), "nothing is traced yet");
        let picture = imaging::Encoded(imaging::Image::filled(3, 2, [0.5; 3]));
        let files = ["exemplars/pose00/olat_00.png", "interview/frame_0000.png"];
        for (file, minutes) in files.into_iter().zip(1..) {
            let file = folder.path().join(file);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            imaging::file::write_png(&file, &picture).unwrap();
            let written = SystemTime::now() + Duration::from_secs(60 * minutes);
            std::fs::File::options().write(true).open(&file).unwrap().set_modified(written).unwrap();
            let (found, shown) = newest(folder.path(), &mut last).unwrap().unwrap();
            assert_eq!((found, shown.size), (file, [3, 2]));
            assert!(newest(folder.path(), &mut last).unwrap().is_none());
        }
        let half = folder.path().join("interview/frame_0001.png");
        std::fs::write(&half, b"\x89PNG").unwrap();
        let later = SystemTime::now() + Duration::from_secs(600);
        std::fs::File::options().write(true).open(&half).unwrap().set_modified(later).unwrap();
        assert!(newest(folder.path(), &mut last).is_err());
        imaging::file::write_png(&half, &picture).unwrap();
        std::fs::File::options().write(true).open(&half).unwrap().set_modified(later).unwrap();
        assert_eq!(newest(folder.path(), &mut last).unwrap().unwrap().0, half);
    }
}
