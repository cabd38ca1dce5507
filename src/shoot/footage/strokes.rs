//! Brush strokes on interview frames that mark the person or the background, stored in the project.

use super::movement::Movement;
use base::error::{Error, Result};
use base::files;
use matte::{Seeds, Side};
use project::Project;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// All strokes of a project, in painting order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Strokes {
    #[serde(default, rename = "stroke")]
    pub strokes: Vec<Stroke>,
}

/// One stroke of a brush.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stroke {
    /// Interview frame, from 0.
    pub frame: usize,
    /// Side of the pixels: the person (`keep`) or the background (`remove`).
    pub side: BrushSide,
    /// Radius of the brush in pixels of the plate, 0.5 to 2000.
    pub radius: f32,
    /// Path of the brush: columns and rows in pixels of the plate, from its upper left corner. At least one point.
    pub points: Vec<[f32; 2]>,
}

/// Effect of a brush.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BrushSide {
    Keep,
    Remove,
}

impl From<BrushSide> for Side {
    fn from(side: BrushSide) -> Self {
        match side {
            BrushSide::Keep => Self::Keep,
            BrushSide::Remove => Self::Remove,
        }
    }
}

/// Range of brush radii in pixels of the plate.
pub const RADII: std::ops::RangeInclusive<f32> = 0.5..=2000.0;
/// Largest coordinate of a point in pixels, far beyond every plate.
pub const FARTHEST: f32 = 1e5;
/// Number of frames on each side that a stroke affects.
pub const REACH: usize = 8;
/// Factor on a stroke's weight per frame.
const FADE: f32 = 0.92;

impl Strokes {
    /// Path of a project's strokes.
    pub fn path(project: &Project) -> PathBuf {
        project.root.join("mattes/strokes.toml")
    }

    /// Reads the project's strokes; empty without a file.
    ///
    /// # Errors
    /// When the file cannot be read, or holds an invalid stroke.
    pub fn load(project: &Project) -> Result<Self> {
        const REMEDY: &str = "Correct the file, or remove it and paint again";
        let path = Self::path(project);
        if !path.exists() {
            return Ok(Self::default());
        }
        let text = files::read_text(&path, files::MOST_TEXT).map_err(|e| Error::io("open", &path, e, REMEDY))?;
        let strokes: Self = toml::from_str(&text).map_err(|e| Error::codec("read", &path, e.message(), REMEDY))?;
        let frames = project.settings.shoot.frames.len();
        for (i, stroke) in strokes.strokes.iter().enumerate() {
            if let Some(problem) = stroke.problem(frames) {
                let problem = format!("stroke {} {problem}", i + 1);
                return Err(Error::codec("read", &path, problem, REMEDY));
            }
        }
        Ok(strokes)
    }

    /// Saves the strokes atomically in the project; without strokes the file is removed.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self, project: &Project) -> Result<()> {
        let path = Self::path(project);
        if self.strokes.is_empty() {
            return match std::fs::remove_file(&path) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                    Err(Error::io("remove", &path, e, "Make the folder writable"))
                }
                _ => Ok(()),
            };
        }
        project::save_toml(&path, self)
    }

    /// Painted frames, ascending.
    pub fn frames(&self) -> Vec<usize> {
        let mut frames: Vec<usize> = self.strokes.iter().map(|stroke| stroke.frame).collect();
        frames.sort_unstable();
        frames.dedup();
        frames
    }

    /// True if a frame has strokes of both sides.
    pub fn tell_both(&self, frame: usize) -> bool {
        [BrushSide::Keep, BrushSide::Remove].iter().all(|side| {
            let mut all = self.strokes.iter();
            all.any(|stroke| stroke.frame == frame && stroke.side == *side)
        })
    }

    /// Seeds painted on a frame of this size.
    pub fn seeds(&self, frame: usize, size: (usize, usize)) -> Seeds {
        let mut seeds = Seeds::none(size);
        for stroke in self.strokes.iter().filter(|stroke| stroke.frame == frame) {
            seeds.paint(stroke.side.into(), stroke.radius, &stroke.points);
        }
        seeds
    }

    /// Seeds for a frame from the strokes on nearby frames. Each is carried along the motion. Its weight falls with
    /// every frame and with uncertain motion, and ends [`REACH`] frames away. At the size used for motion; None
    /// without nearby strokes. `size` is that of the frames.
    pub(super) fn carried(&self, frame: usize, size: (usize, usize), movement: &mut Movement) -> Option<Seeds> {
        let near = self.frames().into_iter();
        let near = near.filter(|&other| other != frame && other.abs_diff(frame) <= REACH);
        let mut all: Option<Seeds> = None;
        for other in near {
            // An unreadable frame is reported when its own matte is made.
            let Ok(Some(flow)) = movement.between(frame, other) else { continue };
            let there = self.seeds(other, size);
            let small = there.resized(flow.trust().size());
            let fade = FADE.powi(frame.abs_diff(other) as i32);
            let mut here = flow.warped_mask(small.values());
            for (value, trust) in here.pixels.iter_mut().zip(&flow.trust().pixels) {
                // Carried seeds are never as certain as painted ones.
                *value *= fade * trust;
            }
            let here = Seeds::from_values(here);
            match &mut all {
                Some(all) => all.join(&here),
                None => all = Some(here),
            }
        }
        all.filter(|all| !all.is_empty())
    }
}

impl Stroke {
    /// Fault of the stroke; None if it is valid.
    fn problem(&self, frames: usize) -> Option<String> {
        if self.frame >= frames {
            return Some(format!("is on frame {}, but the interview has {frames} frames, counted from 0", self.frame));
        }
        if !RADII.contains(&self.radius) {
            return Some(format!(
                "has a radius of {} pixels, outside {} to {}",
                self.radius,
                RADII.start(),
                RADII.end()
            ));
        }
        if self.points.is_empty() {
            return Some("has no points".to_owned());
        }
        let is_near = |v: &f32| v.abs() <= FARTHEST;
        (!self.points.iter().flatten().all(is_near))
            .then(|| "has a point that is NaN or too far outside the picture".to_owned())
    }
}

/// True if strokes can affect a frame: the shoot's own mattes are never changed.
pub fn is_own_matte(project: &Project, frame: usize) -> bool {
    match project.frame_matte(frame) {
        project::Matte::Alpha(_) => false,
        project::Matte::Grey(picture) => {
            let own: &Path = &project.frame_matte_path(frame);
            picture.file() == own || !picture.file().is_file()
        }
    }
}
