//! A project: a folder with a versioned `project.toml`, the results beside it, and relative paths to the shoot.
//! Pictures are not copied.
//!
//! ```text
//! PROJECT/
//!   project.toml        the user's settings and the shoot's contents
//!   calibration.toml    lamps, weights and camera response        (afterlight calibrate)
//!   checkpoint/         the network, the optimiser and its state  (afterlight train)
//!   training.csv        losses of every step                      (afterlight train)
//!   held_out.csv        scores on the held-out pose               (afterlight train --hold-out)
//!   checkpoints/        checkpoints to go back to, with their logs (afterlight checkpoints)
//!   measured.json       scores of every predicted OLAT            (afterlight review)
//!   review.toml         a reviewer's marks and notes              (the studio)
//!   mattes/             mattes that the shoot lacks               (afterlight matte)
//!     interview/FRAME.png   of each frame of the interview
//!     exemplars/POSE.png    of each pose
//!   aside-N/            results under an earlier framing          (afterlight frame)
//!   .lock               the current writer of the project
//! ```

mod clip;
mod corrections;
mod environments;
mod framing;
mod lock;
mod picture;
mod pictures;
mod sealed;
mod shoot;

pub use clip::{Clip, DamagedFrames, Frames, Still, Take, Takes};
pub use corrections::{Axis, Corrections};
pub use environments::{EnvironmentChange, KnownEnvironment, NamedEnvironment, free_name};
pub use framing::{Framing, Framings, Padding};
pub use lock::{Lock, host_name};
pub use picture::{Matte, Picture};
pub use sealed::{read_sealed, save_sealed};
pub use shoot::{Ball, SecondBall, Shoot};

use base::error::{Error, Result};
use base::files::{self, write_beside};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Version of `project.toml` in this program.
pub const FORMAT: u32 = 1;

/// An open project: its folder and its settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Project {
    /// The project's folder.
    pub root: PathBuf,
    /// Folder of calibration, network and logs, if not [`Self::root`]: that of a [variant](Self::variant).
    pub results: Option<PathBuf>,
    /// The contents of `project.toml`.
    pub settings: Settings,
}

/// The contents of `project.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Version of this file, [`FORMAT`].
    pub format: u32,
    /// The project's name.
    pub name: String,
    /// Working size: pictures are averaged down to `size × size` pixels. A power of two.
    pub size: usize,
    /// Seed of every random draw of this project.
    pub seed: u64,
    /// The OpenColorIO configuration: relative to the project's folder, absolute, or a built-in one such as `ocio://default`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color_config: Option<PathBuf>,
    /// Place of the pictures.
    pub shoot: Shoot,
    /// Environments added by the user. Files below the project's or the shoot's folder are relative to the
    /// project's, others absolute.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub environments: Vec<NamedEnvironment>,
    /// Square crop of the subject's pictures. Photographs of mirror balls are not cropped.
    #[serde(default, skip_serializing_if = "Framings::is_empty")]
    pub framing: Framings,
}

impl Project {
    /// A project in folder `root` whose shoot has no pictures yet, for tests. Writes no file.
    pub fn without_shoot(root: &Path) -> Self {
        Self {
            root: root.to_path_buf(),
            results: None,
            settings: Settings {
                format: FORMAT,
                name: "empty".to_owned(),
                size: 16,
                seed: 1,
                color_config: None,
                shoot: Shoot {
                    folder: PathBuf::from("."),
                    frame_rate: 24.0,
                    poses: vec![],
                    lamps: vec![],
                    other_lamps: vec![],
                    frames: vec![].into(),
                    damaged_frames: DamagedFrames::Stop,
                    takes: Takes::default(),
                    ball: Ball { center_px: [8.0; 2], radius_px: 6.0, radius_m: 0.1, camera_distance_m: 3.0 },
                    second_ball: None,
                    dome_radius_m: None,
                    environments: vec![],
                    lamp_layout: vec![],
                    without_balls: false,
                    layer: None,
                    corrections: Corrections::default(),
                },
                environments: vec![],
                framing: Framings::default(),
            },
        }
    }

    /// Opens the project in folder `root`.
    ///
    /// # Errors
    /// When `project.toml` is missing, cannot be parsed or has another format version.
    pub fn open(root: &Path) -> Result<Self> {
        let path = root.join("project.toml");
        let text = files::read_text(&path, files::MOST_TEXT).map_err(|e| {
            Error::io(
                "open",
                &path,
                e,
                ("Choose a project's folder, or make a project", "afterlight import PROJECT --shoot DIR"),
            )
        })?;
        let settings: Settings = toml::from_str(&text)
            .map_err(|e| Error::codec("read", &path, e.message(), "Correct the line, or import the shoot again"))?;
        if settings.format != FORMAT {
            return Err(Error::invalid(
                format!(
                    "{} has format {}, but this version of Afterlight reads format {FORMAT}",
                    path.display(),
                    settings.format
                ),
                "Open it with the version of Afterlight that wrote it, or import the shoot again",
            ));
        }
        check_size(settings.size)
            .and_then(|()| settings.framing.check())
            .and_then(|()| settings.shoot.check())
            .map_err(|e| e.within(&path))?;
        let project = Self { root: root.to_path_buf(), results: None, settings };
        project.choose_layer();
        Ok(project)
    }

    /// Lets this process read the shoot's EXR files by the project's layer.
    pub fn choose_layer(&self) {
        let shoot = &self.settings.shoot;
        imaging::picture::choose_layer(&self.shoot_path(""), shoot.layer.as_deref());
    }

    /// The same project with its own results in `folder`, to try other settings beside it. It shares the
    /// project's pictures and is never saved.
    #[must_use]
    pub fn variant(&self, folder: PathBuf) -> Self {
        Self { results: Some(folder), ..self.clone() }
    }

    /// The file or folder `name` among the results.
    pub fn result_path(&self, name: &str) -> PathBuf {
        self.results.as_ref().unwrap_or(&self.root).join(name)
    }

    /// Writes `project.toml`.
    ///
    /// # Errors
    /// When it cannot be written, or a path in it is not UTF-8.
    pub fn save(&self) -> Result<()> {
        if self.results.is_some() {
            return Err(Error::bug("a variant of a project must not be saved in its place"));
        }
        let shoot = &self.settings.shoot;
        let environments = self.settings.environments.iter();
        let mut paths = (environments.map(|one| &one.file).chain([&shoot.folder])).chain(&self.settings.color_config);
        if let Some(path) = paths.find(|path| path.to_str().is_none()) {
            return Err(Error::invalid(
                format!("project.toml cannot hold the path {}, because it is not UTF-8", path.display()),
                "Rename the file or folder",
            ));
        }
        save_toml(&self.root.join("project.toml"), &self.settings)
    }

    /// Reads the project in folder `root` again, changes it, and writes `project.toml` if anything changed. Other
    /// changes made this way, in this process or another, wait, so that none is lost. (Between processes only if
    /// the file system can lock a folder.)
    ///
    /// # Errors
    /// As [`Self::open`], [`Self::save`] and `change`, and when another process has been changing it for ten
    /// seconds; no file is written then.
    pub fn change<T>(root: &Path, change: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        static ONE: Mutex<()> = Mutex::new(());
        let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = File::open(root).ok();
        if let Some(folder) = &folder {
            lock::wait_for(folder, root)?;
        }
        let before = Self::open(root)?;
        let mut project = before.clone();
        let made = change(&mut project)?;
        if project != before {
            project.save()?;
        }
        Ok(made)
    }

    /// Path of the project's OpenColorIO configuration, or the name of a built-in one. None if it has none.
    pub fn color_config(&self) -> Option<PathBuf> {
        let config = self.settings.color_config.as_ref()?;
        Some(if is_built_in(config) { config.clone() } else { self.root.join(config) })
    }

    /// Chooses an OpenColorIO configuration, or none. For [`Self::change`].
    ///
    /// # Errors
    /// When its file does not exist.
    pub fn set_color_config(&mut self, config: Option<&Path>) -> Result<()> {
        let remedy = "Choose the file config.ocio";
        let full = |p: &Path| p.canonicalize().map_err(|e| Error::io("open", p, e, remedy));
        self.settings.color_config = match config {
            Some(file) if !is_built_in(file) => {
                let (file, root) = (full(file)?, full(&self.root)?);
                Some(file.strip_prefix(root).map_or(file.clone(), PathBuf::from))
            }
            other => other.map(PathBuf::from),
        };
        Ok(())
    }

    /// Checks that the shoot is in its place.
    ///
    /// # Errors
    /// When it is not; the sentence has the remedy.
    pub fn check_shoot(&self) -> Result<()> {
        let folder = self.shoot_path("");
        if folder.is_dir() {
            return Ok(());
        }
        Err(Error::missing(
            format!("the shoot's folder {} is missing", files::plain(&folder)),
            "If it was moved, choose its new folder; if it is on another disk, connect the disk",
        ))
    }

    /// Rejects a shoot that lacks poses, lamps or frames.
    ///
    /// # Errors
    /// When it lacks one of these.
    pub fn check_parts(&self) -> Result<()> {
        let shoot = &self.settings.shoot;
        for (what, count) in
            [("poses", shoot.poses.len()), ("lamps", shoot.lamps.len()), ("frames", shoot.frames.len())]
        {
            if count == 0 {
                return Err(Error::missing(
                    format!("{} lists no {what}", self.root.join("project.toml").display()),
                    "Import a shoot that has exemplars, probes and an interview",
                ));
            }
        }
        Ok(())
    }

    /// Points the project at the shoot's new folder. For [`Self::change`].
    ///
    /// # Errors
    /// When it is a different shoot: a pose, or the first or last frame, is missing.
    pub fn locate(&mut self, folder: &Path) -> Result<()> {
        let mut moved = self.clone();
        moved.settings.shoot.folder = relative(&self.root, folder)?;
        let shoot = &moved.settings.shoot;
        let frames = [0, shoot.frames.len().saturating_sub(1)].map(|frame| moved.frame_picture(frame));
        let poses = (0..shoot.poses.len()).map(|pose| {
            if shoot.lamps.is_empty() { moved.exemplar_matte(pose).picture().clone() } else { moved.first_olat(pose) }
        });
        let mut needed = frames.into_iter().chain(poses);
        if let Some(missing) = needed.find(|picture| !picture.is_there()) {
            return Err(Error::missing(
                format!("there is no file {}", missing.display()),
                "Choose the folder of this project's shoot, which holds its manifest.json",
            ));
        }
        *self = moved;
        Ok(())
    }

    /// Changes the square crop of the pictures. A calibration and a network made with the old framing are moved
    /// into a new folder, which is returned. For [`Self::change`].
    ///
    /// # Errors
    /// When the square does not overlap the pictures, or the folder cannot be written.
    pub fn frame(&mut self, framing: Framing) -> Result<Option<PathBuf>> {
        framing.check()?;
        let mut framed = self.clone();
        framed.settings.framing.set(framing);
        if framed == *self {
            return Ok(None);
        }
        let aside = self.put_aside()?;
        *self = framed;
        Ok(aside)
    }

    /// Takes over the working size and the lamps of `variant`. A calibration and a network made with others are
    /// moved into a new folder, which is returned. For [`Self::change`].
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn reshape(&mut self, variant: &Self) -> Result<Option<PathBuf>> {
        let mut shaped = self.clone();
        shaped.settings.size = variant.settings.size;
        let (to, from) = (&mut shaped.settings.shoot, &variant.settings.shoot);
        to.lamps.clone_from(&from.lamps);
        to.other_lamps.clone_from(&from.other_lamps);
        to.lamp_layout.clone_from(&from.lamp_layout);
        if shaped == *self {
            return Ok(None);
        }
        let aside = self.put_aside()?;
        *self = shaped;
        Ok(aside)
    }

    /// Moves all results into a new folder `aside-N`; `None` if there are none.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn put_aside(&self) -> Result<Option<PathBuf>> {
        const COMPUTED: [&str; 6] =
            ["calibration.toml", "checkpoint", "checkpoints", "training.csv", "held_out.csv", "measured.json"];
        let there = COMPUTED.map(|name| self.root.join(name));
        let mut there = there.iter().filter(|path| path.exists()).peekable();
        if there.peek().is_none() {
            return Ok(None);
        }
        let aside =
            (1..).map(|n| self.root.join(format!("aside-{n}"))).find(|folder| !folder.exists()).unwrap_or_default();
        let refuse = |path: &Path, e: std::io::Error| {
            Error::io("move", path, e, "Check that the project's folder can be written")
        };
        std::fs::create_dir(&aside).map_err(|e| refuse(&aside, e))?;
        for path in there {
            let to = aside.join(path.file_name().unwrap_or_default());
            std::fs::rename(path, to).map_err(|e| refuse(path, e))?;
        }
        Ok(Some(aside))
    }

    /// A path inside the shoot's folder.
    pub fn shoot_path(&self, inside: impl AsRef<Path>) -> PathBuf {
        self.root.join(&self.settings.shoot.folder).join(inside)
    }

    /// Path of the calibration.
    pub fn calibration_path(&self) -> PathBuf {
        self.result_path("calibration.toml")
    }

    /// Path of a review's figures.
    pub fn measured_path(&self) -> PathBuf {
        self.result_path("measured.json")
    }

    /// Path of a reviewer's marks.
    pub fn marks_path(&self) -> PathBuf {
        self.root.join("review.toml")
    }

    /// The folder of the trained network.
    pub fn checkpoint_path(&self) -> PathBuf {
        self.result_path("checkpoint")
    }
}

/// The relative path from folder `from` to folder `to`; both must exist.
///
/// # Errors
/// When one of them does not exist.
pub fn relative(from: &Path, to: &Path) -> Result<PathBuf> {
    let full = |p: &Path| p.canonicalize().map_err(|e| Error::io("open", p, e, "Check that the folder exists"));
    let (from, to) = (full(from)?, full(to)?);
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    Ok(up.chain(to.components().skip(shared)).collect())
}

/// True if the configuration is built into OpenColorIO.
fn is_built_in(config: &Path) -> bool {
    config.to_str().is_some_and(|name| name.starts_with("ocio://"))
}

/// Rejects a working size that the network cannot halve down to one pixel.
pub fn check_size(size: usize) -> Result<()> {
    if size.is_power_of_two() && (16..=1024).contains(&size) {
        return Ok(());
    }
    Err(Error::invalid(
        format!("a working size of {size} pixels is not a power of two from 16 to 1024"),
        "Choose 128 for a quick look or 512 for the paper's size",
    ))
}

/// Writes `value` as TOML beside `path` and renames it.
pub fn save_toml(path: &Path, value: &impl Serialize) -> Result<()> {
    let text =
        toml::to_string_pretty(value).map_err(|e| Error::bug(format!("cannot write {}: {e}", path.display())))?;
    write_beside(path, |out| std::io::Write::write_all(out, text.as_bytes()))
}

#[cfg(test)]
mod tests;
