//! Ground truth of a rendered shoot: some interview frames as they really look under the shoot's environments and under
//! each lamp. For evaluation only; nothing is ever fitted to it.
//!
//! ```text
//! truth/FRAME_relit_ENVIRONMENT.exr     linear light
//! truth/FRAME_olat/LAMP.exr             linear light, of some frames only
//! ```
//!
//! Pictures may be smaller than the interview's frames; the same aspect ratio means the same framing.

use base::error::{Error, Result};
use footage::{PictureSize, cut_picture, dimensions};
use imaging::resample::{resize, resize_area};
use imaging::{Image, file};
use project::{Framing, Framings, NamedEnvironment, Project};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// The truth of a project, found by file names. Pictures are read on demand.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    folder: PathBuf,
    size: usize,
    framings: Framings,
    /// Square of the interview's frames that the network sees; None if there is no frame.
    framing: Option<Framing>,
    frame_names: Vec<String>,
    lamps: Vec<String>,
    /// Project frames with relit truth, ascending.
    pub frames: Vec<usize>,
    /// Environments of the relit truth; `file` is relative to the shoot's folder.
    pub environments: Vec<NamedEnvironment>,
}

impl Truth {
    /// Finds the truth for `project` in `folder`: the `truth` folder itself, or a shoot that contains one.
    ///
    /// # Errors
    /// When there is no truth, or a frame lacks one of the environments.
    pub fn open(project: &Project, folder: &Path) -> Result<Self> {
        let shoot = &project.settings.shoot;
        let inside = folder.join("truth");
        let mut truth = Self {
            folder: if inside.is_dir() { inside } else { folder.to_path_buf() },
            size: project.settings.size,
            framing: (!shoot.frames.is_empty())
                .then(|| dimensions(&project.frame_picture(0)).ok())
                .flatten()
                .map(|size| project.settings.framing.for_size(size)),
            framings: project.settings.framing.clone(),
            frame_names: shoot.frames.names().map(Into::into).collect(),
            lamps: shoot.lamps.clone(),
            frames: Vec::new(),
            environments: Vec::new(),
        };
        let there = |frame: usize, name: &str| truth.relit_path(frame, name).is_file();
        let every = 0..shoot.frames.len();
        let environments: Vec<NamedEnvironment> =
            shoot.environments.iter().filter(|e| every.clone().any(|f| there(f, &e.name))).cloned().collect();
        let frames: Vec<usize> = every.filter(|&f| environments.iter().any(|e| there(f, &e.name))).collect();
        let missing =
            frames.iter().flat_map(|&f| environments.iter().map(move |e| (f, e))).find(|&(f, e)| !there(f, &e.name));
        if let Some((frame, environment)) = missing {
            let path = truth.relit_path(frame, &environment.name);
            let remedy = "Complete the truth, or remove that frame from it";
            return Err(Error::missing(
                format!("{} is missing, but other environments have this frame", path.display()),
                remedy,
            ));
        }
        if frames.is_empty() {
            return Err(Error::missing(
                format!(
                    "{} holds no relit truth such as frame_005_relit_pisa.exr for an environment of the shoot",
                    truth.folder.display()
                ),
                ("Give the shoot's folder or its truth folder", "--truth DIR"),
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

    /// A frame under an environment, linear, with the framing of `at` and the truth's own resolution.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn relit_at(&self, frame: usize, environment: &str, at: PictureSize) -> Result<Image> {
        self.read(&self.relit_path(frame, environment), at)
    }

    /// True if the frame has true OLATs.
    pub fn has_olats(&self, frame: usize) -> bool {
        self.olat_folder(frame).is_dir()
    }

    /// A frame under each lamp alone, linear, at the working size.
    ///
    /// # Errors
    /// When a picture cannot be read.
    pub fn olats(&self, frame: usize) -> Result<Vec<Image>> {
        self.olats_at(frame, PictureSize::Square)
    }

    /// A frame under each lamp alone, linear, with the framing of `at` and the truth's own resolution.
    ///
    /// # Errors
    /// When a picture cannot be read.
    pub fn olats_at(&self, frame: usize, at: PictureSize) -> Result<Vec<Image>> {
        let folder = self.olat_folder(frame);
        self.lamps.par_iter().map(|lamp| self.read(&folder.join(format!("{lamp}.exr")), at)).collect()
    }

    fn relit_path(&self, frame: usize, environment: &str) -> PathBuf {
        self.folder.join(format!("{}_relit_{environment}.exr", self.frame_names[frame]))
    }

    fn olat_folder(&self, frame: usize) -> PathBuf {
        self.folder.join(format!("{}_olat", self.frame_names[frame]))
    }

    fn read(&self, path: &Path, at: PictureSize) -> Result<Image> {
        let truth = file::read_linear(path)?;
        Ok(match at {
            PictureSize::Plate => truth,
            PictureSize::Box => self.square(truth),
            PictureSize::Square => resize_area(&self.square(truth), self.size, self.size),
        })
    }

    /// Square that the network sees.
    fn square(&self, truth: Image) -> Image {
        let same_shape = |framing: &Framing| {
            let [width, height] = framing.source;
            truth.width * height == truth.height * width
        };
        let Some(framing) = self.framing.filter(same_shape) else {
            let framing = self.framings.for_size(truth.size());
            return cut_picture(truth, &framing);
        };
        match framing.scaled(truth.size()) {
            Some(framing) => cut_picture(truth, &framing),
            None => {
                let [width, height] = framing.source;
                cut_picture(resize(&truth, width, height), &framing)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base::progress::Progress;
    use footage::{ImportSettings, import};
    use virtual_stage::{StageSettings, write_shoot};

    #[test]
    fn a_truth_in_fewer_pixels_shows_the_same_square() -> Result<()> {
        let folder = tempfile::tempdir().unwrap();
        let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
        let stage = StageSettings { frames: 1, size: 48, plate: Some((24, 48)), lamps: 4, ..StageSettings::default() };
        write_shoot(&shoot, &stage, &silent)?;
        let settings = ImportSettings { size: 16, seed: 0, layer: None };
        let root = folder.path().join("project");
        import(&root, &shoot, &settings, &silent)?;
        let shown = |framing: Framing| -> Result<Image> {
            Project::change(&root, |project| project.frame(framing))?;
            let truth = Truth::open(&Project::open(&root)?, &shoot)?;
            let plate = truth.relit_at(0, "nave", PictureSize::Plate)?;
            assert_eq!(plate.size(), (24, 48));
            truth.relit(0, "nave")
        };
        let alike = shown(Framing::whole((24, 48)))?;
        assert_eq!(alike.size(), (16, 16));
        // Frames of twice the size; then a square whose edges fall inside the truth's pixels, at two frame sizes.
        let odd = |(width, height): (usize, usize), side| Framing { side, ..Framing::whole((width, height)) };
        let squares = [Framing::whole((48, 96)), odd((30, 60), 53), odd((60, 120), 106)];
        let mut seen = vec![];
        for framing in squares {
            let [width, height] = framing.source.map(|side| side as u32);
            for name in ["interview/frame_000.png", "interview_masks/frame_000.png"] {
                let path = shoot.join(name);
                let picture = image::open(&path).unwrap();
                let resized = picture.resize_exact(width, height, image::imageops::FilterType::Nearest);
                resized.save(path).unwrap();
            }
            seen.push(shown(framing)?);
        }
        let off = |a: &Image, b: &Image| -> f32 {
            let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
            let errors: f32 = pairs.map(|(a, b)| (a - b).abs()).sum();
            errors / a.pixels.iter().flatten().sum::<f32>()
        };
        assert_eq!(off(&alike, &seen[0]), 0.0);
        assert!(off(&seen[1], &seen[2]) < 0.05, "{}", off(&seen[1], &seen[2]));
        assert!(off(&alike, &seen[1]) > 0.1);
        Ok(())
    }
}
