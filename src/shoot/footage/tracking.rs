//! Tracking frames: the fully lit subject, repeatedly during the lamp cycle.

use super::shoot::{MANIFEST, Manifest, picture_names};
use base::error::Result;
use imaging::file::with_ending;
use project::{Picture, Project};

/// Tracking frames of one pose: those of its movie, or the files in `tracking/` with the pose's name, in the
/// order of their names.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackingFrames {
    pub pictures: Vec<Picture>,
    /// Time of each frame, from 0 (before the first lamp) to 1 (after the last).
    pub times: Vec<f32>,
}

impl TrackingFrames {
    /// Tracking frames of a pose; `None` if it has fewer than two.
    ///
    /// # Errors
    /// When the manifest or the folder cannot be read.
    pub fn new(project: &Project, pose: usize) -> Result<Option<Self>> {
        let shoot = &project.settings.shoot;
        let lamps = shoot.all_lamps().len().max(1);
        let in_movie = project.tracking_pictures(pose);
        if in_movie.len() > 1 {
            let time = |before: usize| before as f32 / lamps as f32;
            let (pictures, times) = in_movie.into_iter().map(|(picture, before)| (picture, time(before))).unzip();
            return Ok(Some(Self { pictures, times }));
        }
        let folder = project.shoot_path(format!("tracking/{}", shoot.poses[pose]));
        let names = if folder.is_dir() { picture_names(&folder)? } else { vec![] };
        if names.len() < 2 {
            return Ok(None);
        }
        let root = project.shoot_path("");
        let said = if root.join(MANIFEST).is_file() { Manifest::read(&root)?.tracking } else { None };
        let before = said.map_or_else(Vec::new, |tracking| tracking.before_lamp);
        let rises = before.windows(2).all(|pair| pair[0] < pair[1]);
        let times = if before.len() == names.len() && rises {
            (before.iter()).map(|&lamp| lamp.min(lamps) as f32 / lamps as f32).collect()
        } else {
            (0..names.len()).map(|i| i as f32 / (names.len() - 1) as f32).collect()
        };
        let file = |name: &String| Picture::File(with_ending(&folder.join(name)));
        Ok(Some(Self { pictures: names.iter().map(file).collect(), times }))
    }
}
