//! The ground truth of a rendered shoot: some interview frames as they really look under the shoot's
//! environments and under each lamp. For evaluation only; nothing is ever fitted to it.
//!
//! ```text
//! truth/FRAME_relit_ENVIRONMENT.exr     linear light
//! truth/FRAME_olat/LAMP.exr             linear light, of some frames only
//! ```

use base::error::{Error, Result};
use footage::{PictureSize, read_linear};
use imaging::{Image, resample::resize_area};
use project::{Framings, NamedEnvironment, Project};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// The truth of a project, found by file names. Pictures are read on demand.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    folder: PathBuf,
    size: usize,
    framing: Framings,
    frame_names: Vec<String>,
    lamps: Vec<String>,
    /// Frames of the project with relit truth, ascending.
    pub frames: Vec<usize>,
    /// The environments that they are relit under; `file` is relative to the shoot's folder.
    pub environments: Vec<NamedEnvironment>,
}

impl Truth {
    /// Finds the truth for `project` in `folder`: the `truth` folder itself or the shoot that has one.
    ///
    /// # Errors
    /// When there is no truth, or a frame is relit under one environment and not under another.
    pub fn open(project: &Project, folder: &Path) -> Result<Self> {
        let shoot = &project.settings.shoot;
        let inside = folder.join("truth");
        let mut truth = Self {
            folder: if inside.is_dir() {
                inside
            } else {
                folder.to_path_buf()
            },
            size: project.settings.size,
            framing: project.settings.framing.clone(),
            frame_names: shoot.frames.names().map(Into::into).collect(),
            lamps: shoot.lamps.clone(),
            frames: Vec::new(),
            environments: Vec::new(),
        };
        let there = |frame: usize, name: &str| truth.relit_path(frame, name).is_file();
        let every = 0..shoot.frames.len();
        let environments: Vec<NamedEnvironment> = shoot
            .environments
            .iter()
            .filter(|e| every.clone().any(|f| there(f, &e.name)))
            .cloned()
            .collect();
        let frames: Vec<usize> = every
            .filter(|&f| environments.iter().any(|e| there(f, &e.name)))
            .collect();
        let missing = frames
            .iter()
            .flat_map(|&f| environments.iter().map(move |e| (f, e)))
            .find(|&(f, e)| !there(f, &e.name));
        if let Some((frame, environment)) = missing {
            let path = truth.relit_path(frame, &environment.name);
            let remedy = "Complete the truth, or remove that frame from it";
            return Err(Error::missing(
                format!(
                    "{} is missing, but other environments have this frame",
                    path.display()
                ),
                remedy,
            ));
        }
        if frames.is_empty() {
            return Err(Error::missing(
                format!(
                    "{} holds no relit truth such as frame_005_relit_pisa.exr for an environment of the shoot",
                    truth.folder.display()
                ),
                "Give the shoot's folder or its truth folder with --truth DIR",
            ));
        }
        (truth.frames, truth.environments) = (frames, environments);
        Ok(truth)
    }

    /// A frame under an environment, linear, at the working size.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn relit(&self, frame: usize, environment: &str) -> Result<Image> {
        self.relit_at(frame, environment, PictureSize::Square)
    }

    /// A frame under an environment, linear, as a picture of that size shows it.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn relit_at(&self, frame: usize, environment: &str, at: PictureSize) -> Result<Image> {
        self.read(&self.relit_path(frame, environment), at)
    }

    /// Whether the frame's OLATs are known.
    pub fn has_olats(&self, frame: usize) -> bool {
        self.olat_folder(frame).is_dir()
    }

    /// A frame under each lamp alone, linear, at the working size.
    ///
    /// # Errors
    /// When one cannot be read.
    pub fn olats(&self, frame: usize) -> Result<Vec<Image>> {
        self.olats_at(frame, PictureSize::Square)
    }

    /// A frame under each lamp alone, linear, as pictures of that size show it.
    ///
    /// # Errors
    /// When one cannot be read.
    pub fn olats_at(&self, frame: usize, at: PictureSize) -> Result<Vec<Image>> {
        let folder = self.olat_folder(frame);
        self.lamps
            .par_iter()
            .map(|lamp| self.read(&folder.join(format!("{lamp}.exr")), at))
            .collect()
    }

    fn relit_path(&self, frame: usize, environment: &str) -> PathBuf {
        self.folder.join(format!(
            "{}_relit_{environment}.exr",
            self.frame_names[frame]
        ))
    }

    fn olat_folder(&self, frame: usize) -> PathBuf {
        self.folder
            .join(format!("{}_olat", self.frame_names[frame]))
    }

    fn read(&self, path: &Path, at: PictureSize) -> Result<Image> {
        Ok(match at {
            PictureSize::Plate => imaging::file::read_linear(path)?,
            PictureSize::Box => read_linear(path, &self.framing)?,
            PictureSize::Square => {
                let truth = read_linear(path, &self.framing)?;
                resize_area(&truth, self.size, self.size)
            }
        })
    }
}
