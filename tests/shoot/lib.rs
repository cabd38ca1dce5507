//! A small shoot of the virtual stage and its project, the start of end-to-end tests. This crate depends on
//! `calibration`; crates below that have their own shoots.

use base::progress::Progress;
use calibration::{CalibrateSettings, Calibration};
use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, WritableImage};
use footage::ImportSettings;
use imaging::Image;
use project::Project;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use virtual_stage::{StageSettings, write_shoot};

/// Sizes of the footage and of its project.
#[derive(Clone, Copy, Debug)]
pub struct TestShoot {
    /// Frames of the interview.
    pub frames: usize,
    pub lamps: usize,
    /// Width and height of the shoot's pictures in pixels.
    pub size: usize,
    /// Width and height of the project's pictures.
    pub working_size: usize,
}

/// Paths within a shoot, and their content.
type Files = BTreeMap<PathBuf, Vec<u8>>;

impl Default for TestShoot {
    fn default() -> Self {
        Self { frames: 3, lamps: 6, size: 32, working_size: 32 }
    }
}

impl TestShoot {
    /// The shoot in `folder/shoot`, written if it is not there yet.
    pub fn write(&self, folder: &Path) -> PathBuf {
        let shoot = folder.join("shoot");
        if !shoot.join("manifest.json").exists() {
            let files = self.files();
            // The manifest last: its presence means that the rest is complete.
            let manifest = Path::new("manifest.json");
            let (last, first): (Vec<_>, Vec<_>) = files.iter().partition(|(p, _)| *p == manifest);
            for (path, bytes) in first.into_iter().chain(last) {
                let path = shoot.join(path);
                std::fs::create_dir_all(path.parent().unwrap()).unwrap();
                std::fs::write(path, bytes).unwrap();
            }
        }
        shoot
    }

    /// Files of the shoot, rendered once in a process.
    fn files(&self) -> Arc<Files> {
        static RENDERED: Mutex<BTreeMap<[usize; 3], Arc<Files>>> = Mutex::new(BTreeMap::new());
        let key = [self.frames, self.size, self.lamps];
        let mut rendered = RENDERED.lock().unwrap_or_else(PoisonError::into_inner);
        rendered.entry(key).or_insert_with(|| Arc::new(self.render())).clone()
    }

    fn render(&self) -> Files {
        let settings =
            StageSettings { frames: self.frames, size: self.size, lamps: self.lamps, ..StageSettings::default() };
        let folder = tempfile::tempdir().unwrap();
        write_shoot(folder.path(), &settings, &Progress::silent()).unwrap();
        let read = |path: PathBuf| {
            let bytes = std::fs::read(&path).unwrap();
            (path.strip_prefix(folder.path()).unwrap().to_owned(), bytes)
        };
        test_support::files(folder.path()).into_iter().map(read).collect()
    }

    /// Imports the shoot as a project at `project`, relative to `folder` or outside of it.
    pub fn import(&self, folder: &Path, project: impl AsRef<Path>) -> Project {
        let settings = ImportSettings { size: self.working_size, seed: 5, layer: None };
        let (shoot, root) = (self.write(folder), folder.join(project));
        footage::import(&root, &shoot, &settings, &Progress::silent()).unwrap()
    }

    /// The same with a calibration.
    pub fn calibrate(&self, folder: &Path, project: impl AsRef<Path>) -> (Project, Calibration) {
        let mut project = self.import(folder, project);
        let settings = CalibrateSettings::default();
        let found = calibration::calibrate(&mut project, &settings, &Progress::silent()).unwrap();
        found.save(&project).unwrap();
        (project, found)
    }
}

/// Writes an EXR with the layers `albedo`, half the light, and `comp`.
pub fn write_layers(path: &Path, light: &Image) {
    let channel = |layer: &str, c: usize, factor: f32| {
        let values = light.pixels.iter().map(|pixel| factor * pixel[c]).collect();
        let name = format!("{layer}.{}", ["R", "G", "B"][c]);
        AnyChannel::new(&*name, FlatSamples::F32(values))
    };
    let layers = [("albedo", 0.5), ("comp", 1.0)].into_iter();
    let channels = layers.flat_map(|(layer, factor)| (0..3).map(move |c| channel(layer, c, factor)));
    let channels = AnyChannels::sort(channels.collect());
    exr::prelude::Image::from_channels(light.size(), channels).write().to_file(path).unwrap();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projects_of_one_folder_share_its_shoot() {
        let folder = tempfile::tempdir().unwrap();
        let shoot = TestShoot::default();
        let (first, found) = shoot.calibrate(folder.path(), "first");
        let manifest = folder.path().join("shoot/manifest.json");
        let written = std::fs::metadata(&manifest).unwrap().modified().unwrap();
        let second = shoot.import(folder.path(), "second");
        let now = std::fs::metadata(&manifest).unwrap().modified().unwrap();
        assert_eq!(written, now);
        assert_eq!(first.settings.shoot.lamps, second.settings.shoot.lamps);
        assert_eq!((first.settings.size, first.settings.shoot.frames.len()), (32, 3));
        assert_eq!(found.rig.lamps.len(), 6);
        assert!(first.calibration_path().exists() && !second.calibration_path().exists());
    }
}
