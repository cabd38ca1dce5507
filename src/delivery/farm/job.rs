//! `job.json`: the work, the program that wrote the job, and the checksums of its files.

use super::environment::KeptEnvironment;
use super::program::Program;
use base::error::{Error, Result};
use base::files::{self, write_beside};
use export::relight::RelightSettings;
use export::{check_files, hash_file};
use gpu::DeviceChoice;
use project::Project;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use training::TrainSettings;

/// Version of `job.json` that this program writes and reads.
const FORMAT: u32 = 1;
pub(crate) const NAME: &str = "job.json";
pub(crate) const SNAPSHOT: &str = "snapshot";
pub(crate) const ENVIRONMENT: &str = "snapshot/environment.f32";
pub(crate) const TABLE: &str = "snapshot/look.cube";
/// Folder of the files of a background.
pub(crate) const BACKGROUND: &str = "snapshot/background";
const REMEDY: &str = "Write the job again: afterlight farm PROJECT --to DIR";

/// A job for a farm.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Job {
    format: u32,
    /// Program that wrote the job; no other may run it.
    pub program: Program,
    /// The project's name.
    pub project: String,
    pub work: Work,
    /// Files of the snapshot.
    pub files: Vec<PinnedFile>,
}

/// Work of a job.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Work {
    /// An export, in chunks of frames.
    Relight(Box<RelightWork>),
    /// Trainings, one per task.
    Train(Vec<TrainTask>),
}

/// Export of a job.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RelightWork {
    /// First and last frame.
    pub frames: (usize, usize),
    /// Frames per chunk.
    pub chunk: usize,
    /// Measured milliseconds per frame that set the size of the chunks; None if the size was given.
    pub ms_per_frame: Option<f64>,
    pub environment: KeptEnvironment,
    /// Fingerprint of the interview's movie; None for stills, whose files are checked per frame.
    pub movie: Option<String>,
    pub settings: RelightSettings,
}

/// Training of a job.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TrainTask {
    /// The project's name.
    pub name: String,
    /// Original project.
    pub project: PathBuf,
    /// Folder of its copy within the job.
    pub folder: PathBuf,
    pub settings: TrainSettings,
}

/// File of the snapshot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PinnedFile {
    /// Path relative to the job's folder.
    pub name: PathBuf,
    pub bytes: u64,
    /// SHA-256 in hexadecimal digits.
    pub sha256: String,
}

/// Fields common to every version of `job.json`.
#[derive(Deserialize)]
struct Header {
    format: u32,
    program: Program,
}

impl Job {
    pub(crate) fn new(project: String, work: Work, files: Vec<PinnedFile>) -> Result<Self> {
        Ok(Self { format: FORMAT, program: Program::this()?, project, work, files })
    }

    /// Writes `job.json` into the job's folder.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn save(&self, folder: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).map_err(|e| Error::bug(format!("cannot write the job: {e}")))?;
        write_beside(&folder.join(NAME), |out| out.write_all(text.as_bytes()))
    }

    /// Opens the job in `folder`. This program must have written it, and its snapshot must be unchanged.
    ///
    /// # Errors
    /// When either check fails, or files cannot be read.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(NAME);
        let text = files::read_text(&path, files::MOST_TEXT).map_err(|e| {
            let remedy = "Give the folder of a completely written job: afterlight farm PROJECT --to DIR";
            Error::io("open", &path, e, remedy)
        })?;
        let broken = |e: serde_json::Error| Error::codec("read", &path, e, REMEDY);
        // Another version may have other settings, so the version is checked first.
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

    /// Export of the job in `folder`, with absolute paths in its settings, and its project. `shoot` overrides the folder
    /// of the footage.
    ///
    /// # Errors
    /// When the job is a training, or files cannot be read.
    pub(crate) fn export(self, folder: &Path, shoot: Option<&Path>) -> Result<(RelightWork, Project)> {
        let Work::Relight(mut work) = self.work else {
            return Err(Error::invalid(
                format!("{} trains networks and has no frames", folder.display()),
                "Run one of its tasks: afterlight farm-chunk JOB --task K",
            ));
        };
        let environment = work.environment.read(&folder.join(ENVIRONMENT))?;
        work.settings.read = Some(Arc::new(environment));
        work.settings.frames = Some(work.frames);
        if work.settings.files.lut.is_some() {
            work.settings.files.lut = Some(folder.join(TABLE));
        }
        let background = work.settings.look.background.file();
        if let Some(file) = background.filter(|_| work.settings.solo.is_empty()) {
            let file = inside(folder, file)?;
            work.settings.look.background = work.settings.look.background.with_file(file);
        }
        check_files(&work.settings.files, 1).map_err(|e| e.within(&folder.join(NAME)))?;
        let mut project = Project::open(&folder.join(SNAPSHOT))?;
        if let Some(shoot) = shoot {
            project.settings.shoot.folder =
                std::path::absolute(shoot).map_err(|e| Error::io("open", shoot, e, "Check the footage's folder"))?;
            project.choose_layer();
        }
        project.check_shoot()?;
        Ok((*work, project))
    }
}

impl TrainTask {
    /// Folder of this training, used by no other task of the job in `folder`.
    ///
    /// # Errors
    /// When it is outside the job.
    pub(crate) fn root(&self, folder: &Path) -> Result<PathBuf> {
        inside(folder, &self.folder)
    }

    /// Device for the network of all these trainings: one choice per job.
    pub(crate) fn device(tasks: &[Self]) -> DeviceChoice {
        tasks.first().map_or(DeviceChoice::Auto, |task| task.settings.device)
    }
}

/// Path of `name` within a job's `folder`.
///
/// # Errors
/// When it leads outside the folder.
fn inside(folder: &Path, name: &Path) -> Result<PathBuf> {
    let is_inside = |part| matches!(part, Component::Normal(_));
    if name.components().all(is_inside) {
        return Ok(folder.join(name));
    }
    Err(Error::codec("read", folder.join(NAME), format!("{name:?} is not in the job"), REMEDY))
}

impl PinnedFile {
    /// Current checksum of the file `name` in the job's folder.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(crate) fn new(folder: &Path, name: PathBuf) -> Result<Self> {
        let path = folder.join(&name);
        let (bytes, sha256) = hash_file(&path).map_err(|e| Error::io("read", &path, e, "Write the job again"))?;
        Ok(Self { name, bytes, sha256 })
    }

    fn check(&self, folder: &Path) -> Result<()> {
        let path = inside(folder, &self.name)?;
        let found = hash_file(&path).map_err(|e| Error::io("read", &path, e, REMEDY))?;
        if found == (self.bytes, self.sha256.clone()) {
            return Ok(());
        }
        Err(Error::codec("read", &path, "changed since the job was written (hash mismatch)", REMEDY))
    }
}
