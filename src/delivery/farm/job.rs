//! `job.json`: what is to be made, by which program and of which files.

use super::environment::KeptEnvironment;
use super::program::{Program, sha256};
use base::error::{Error, Result};
use base::files::{self, write_beside};
use export::relight::RelightSettings;
use gpu::DeviceChoice;
use project::Project;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use training::TrainSettings;

/// The version of `job.json` that this program writes and reads.
const FORMAT: u32 = 1;
pub(crate) const NAME: &str = "job.json";
pub(crate) const SNAPSHOT: &str = "snapshot";
pub(crate) const ENVIRONMENT: &str = "snapshot/environment.f32";
pub(crate) const TABLE: &str = "snapshot/look.cube";
const REMEDY: &str = "Write the job again: afterlight farm PROJECT --to DIR";

/// A job for a farm.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Job {
    format: u32,
    /// The program that wrote it, which alone may run it.
    pub program: Program,
    /// The project's name.
    pub project: String,
    pub work: Work,
    /// The snapshot's files.
    pub files: Vec<PinnedFile>,
}

/// Work of a job.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Work {
    /// An export, in chunks of frames.
    Relight(Box<RelightWork>),
    /// Trainings, one task each.
    Train(Vec<TrainTask>),
}

/// An export.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RelightWork {
    /// First and last frame.
    pub frames: (usize, usize),
    /// Frames of a chunk.
    pub chunk: usize,
    /// Measured milliseconds of a frame, by which the chunks were sized; None if their size was given.
    pub ms_per_frame: Option<f64>,
    pub environment: KeptEnvironment,
    /// A print of the interview's movie; None if it is stills, which each frame's file is checked by.
    pub movie: Option<String>,
    pub settings: RelightSettings,
}

/// A training.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TrainTask {
    /// The project's name.
    pub name: String,
    /// The project that it is a copy of.
    pub project: PathBuf,
    /// Its folder within the job.
    pub folder: PathBuf,
    pub settings: TrainSettings,
}

/// A file of the snapshot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PinnedFile {
    /// Relative to the job's folder.
    pub name: PathBuf,
    pub bytes: u64,
    /// In hexadecimal digits.
    pub sha256: String,
}

/// Fields that every version of `job.json` has.
#[derive(Deserialize)]
struct Header {
    format: u32,
    program: Program,
}

impl Job {
    pub(crate) fn new(project: String, work: Work, files: Vec<PinnedFile>) -> Result<Self> {
        Ok(Self { format: FORMAT, program: Program::this()?, project, work, files })
    }

    /// Writes it into the job's folder.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn save(&self, folder: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self)
            .map_err(|e| Error::bug(format!("the job cannot be written: {e}")))?;
        write_beside(&folder.join(NAME), |out| out.write_all(text.as_bytes()))
    }

    /// Opens the job in `folder`: this program has to be the one that wrote it, and its snapshot as it was.
    ///
    /// # Errors
    /// When it is not so, or the files cannot be read.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(NAME);
        let text = files::read_text(&path, files::MOST_TEXT).map_err(|e| {
            let remedy = "Give the folder of a job that was written to its end: afterlight farm PROJECT --to DIR";
            Error::io("open", &path, e, remedy)
        })?;
        let broken = |e: serde_json::Error| Error::codec("read", &path, e, REMEDY);
        // Another version may have other settings: it is told before these are read.
        let header: Header = serde_json::from_str(&text).map_err(broken)?;
        Program::this()?.check(&header.program, folder)?;
        if header.format != FORMAT {
            let problem = format!("its format is {}, not {FORMAT}", header.format);
            return Err(Error::codec("read", &path, problem, REMEDY));
        }
        let job: Self = serde_json::from_str(&text).map_err(broken)?;
        job.files.iter().try_for_each(|file| file.check(folder))?;
        Ok(job)
    }

    /// Its export, with what its settings name in the job's `folder`, and the project that it is of. `shoot` is where the
    /// footage is, if not where it was.
    ///
    /// # Errors
    /// When it is a training, or files cannot be read.
    pub(crate) fn export(
        self,
        folder: &Path,
        shoot: Option<&Path>,
    ) -> Result<(RelightWork, Project)> {
        let Work::Relight(mut work) = self.work else {
            return Err(Error::invalid(
                format!("{} trains networks, it has no frames", folder.display()),
                "Run one of its tasks: afterlight farm-chunk JOB --task K",
            ));
        };
        let environment = work.environment.read(&folder.join(ENVIRONMENT))?;
        work.settings.read = Some(Arc::new(environment));
        work.settings.frames = Some(work.frames);
        if work.settings.files.lut.is_some() {
            work.settings.files.lut = Some(folder.join(TABLE));
        }
        let mut project = Project::open(&folder.join(SNAPSHOT))?;
        if let Some(shoot) = shoot {
            project.settings.shoot.folder = std::path::absolute(shoot)
                .map_err(|e| Error::io("open", shoot, e, "Check the footage's folder"))?;
        }
        project.check_shoot()?;
        Ok((*work, project))
    }
}

impl TrainTask {
    /// Folder of this training, in which nothing else of the job in `folder` is trained.
    ///
    /// # Errors
    /// When it is not within the job.
    pub(crate) fn root(&self, folder: &Path) -> Result<PathBuf> {
        inside(folder, &self.folder)
    }

    /// Device for the network of all these trainings: they are written with one choice.
    pub(crate) fn device(tasks: &[Self]) -> DeviceChoice {
        tasks.first().map_or(DeviceChoice::Auto, |task| task.settings.device)
    }
}

/// Path of `name` within a job's `folder`.
///
/// # Errors
/// When it leads out of it.
fn inside(folder: &Path, name: &Path) -> Result<PathBuf> {
    let is_inside = |part| matches!(part, Component::Normal(_));
    if name.components().all(is_inside) {
        return Ok(folder.join(name));
    }
    Err(Error::codec("read", folder.join(NAME), format!("{name:?} is no file of the job"), REMEDY))
}

impl PinnedFile {
    /// Of the file `name` in the job's folder, as it is now.
    ///
    /// # Errors
    /// When it cannot be read.
    pub(crate) fn of(folder: &Path, name: PathBuf) -> Result<Self> {
        let path = folder.join(&name);
        let (bytes, sha256) =
            sha256(&path).map_err(|e| Error::io("read", &path, e, "Write the job again"))?;
        Ok(Self { name, bytes, sha256 })
    }

    fn check(&self, folder: &Path) -> Result<()> {
        let path = inside(folder, &self.name)?;
        let found = sha256(&path).map_err(|e| Error::io("read", &path, e, REMEDY))?;
        if found == (self.bytes, self.sha256.clone()) {
            return Ok(());
        }
        Err(Error::codec(
            "read",
            &path,
            "changed since the job was written (hash mismatch)",
            REMEDY,
        ))
    }
}
