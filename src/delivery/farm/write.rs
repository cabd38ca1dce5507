//! Writer of export jobs.

use super::chunks::chunk_size;
use super::engine::Engine;
use super::job::{Job, RelightWork, Work};
use super::settings::{ChunkSettings, FarmSettings};
use super::snapshot;
use super::{open_job_description, slurm};
use base::error::{Error, Result};
use base::progress::Progress;
use export::relight::{Part, RelightSettings, frame_range, relight_part};
use export::{Destination, Existing, Interview, footage_print};
use project::{Picture, Project};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Frames relit to measure the time per frame.
const MEASURED: usize = 3;

/// A written job.
#[derive(Clone, Debug, Serialize)]
pub struct JobReport {
    pub job: PathBuf,
    pub engine: Engine,
    /// Number of frames or trainings.
    pub tasks: usize,
    /// Frames per chunk; None for a training job.
    pub chunk: Option<usize>,
    pub chunks: usize,
    /// Milliseconds per frame, if known.
    pub ms_per_frame: Option<f64>,
    /// Destination of the result; None for a training job.
    pub output: Option<Destination>,
    /// Command that submits the job.
    pub submit: String,
}

impl JobReport {
    /// Summary of the job: its folder, and the command that submits it.
    pub fn sentence(&self) -> String {
        let what = match self.chunk {
            Some(_) if self.tasks == 1 => "1 frame".to_owned(),
            Some(_) if self.chunks == 1 => format!("{} frames in one chunk", self.tasks),
            Some(chunk) => format!("{} frames in {} chunks of {chunk}", self.tasks, self.chunks),
            None if self.tasks == 1 => "1 training".to_owned(),
            None => format!("{} trainings", self.tasks),
        };
        let rate = self.ms_per_frame.map_or(String::new(), |ms| format!(" (a frame takes {ms:.0} ms here)"));
        format!(
            "The job for {} is in {}: {what}{rate}. Submit it: {}",
            self.engine.name(),
            self.job.display(),
            self.submit
        )
    }
}

/// Writes a job that relights `project` like `relight` with `settings`. Chunks on many machines make the frames,
/// the last step joins the movie. Later changes of the project do not affect the job.
///
/// # Errors
/// When a part of the project is missing, the settings conflict, the job's folder is not empty, or files cannot be
/// written.
pub fn write_job(
    project: &Project,
    settings: &RelightSettings,
    farm: &FarmSettings,
    chunks: &ChunkSettings,
    progress: &Progress,
) -> Result<JobReport> {
    project.check_shoot()?;
    project.check_parts()?;
    let mut settings = settings.clone();
    let (first, last) = frame_range(project, settings.frames)?;
    let frames = last - first + 1;
    settings.frames = Some((first, last));
    let interview = Interview::from_project(project)?;
    settings.files.first_number = Some(settings.files.numbers(&interview, (0, 0)).0);
    settings.files = absolute_files(&settings, settings.files.numbers(&interview, (first, last)))?;
    export::check_files(&settings.files, frames)?;
    settings.check()?;
    handover::check(project, &settings)?;
    let job = new_folder(&farm.job)?;
    fill(&job, project, settings, farm, chunks, progress).inspect_err(|_| clear(&job))
}

/// Writes the job into its folder.
fn fill(
    job: &Path,
    project: &Project,
    mut settings: RelightSettings,
    farm: &FarmSettings,
    chunks: &ChunkSettings,
    progress: &Progress,
) -> Result<JobReport> {
    let (first, last) = frame_range(project, settings.frames)?;
    let frames = last - first + 1;
    let (copy, environment) = snapshot::take(project, &mut settings, job, progress)?;
    let movie = match copy.frame_picture(first) {
        Picture::Movie { file, .. } if file.is_file() => {
            Some(footage_print(&file).map_err(|e| Error::io("read", &file, e, "Check that the movie exists"))?)
        }
        _ => None,
    };
    let depends = settings.goes_from_frame_to_frame();
    let (chunk, ms_per_frame) = match chunks.chunk {
        // Each frame depends on the one before it: every chunk would have to start at the first frame.
        _ if depends => {
            progress
                .say("Each frame depends on the one before it (--smoothing, --field compressed): the job is one chunk");
            (frames, None)
        }
        Some(chunk) => (chunk.min(frames), None),
        None => {
            let ms = rate(&copy, &settings, job, progress)?;
            (chunk_size(ms, chunks.chunk_minutes, frames), Some(ms))
        }
    };
    let output = settings.files.to.clone();
    let work = RelightWork { frames: (first, last), chunk, ms_per_frame, environment, movie, settings };
    let program = program(farm)?;
    let name = &project.settings.name;
    let submit = match farm.engine {
        Engine::OpenJobDescription => open_job_description::write(job, name, &program, farm, &work)?,
        Engine::Slurm => slurm::write(job, name, &program, farm, &work)?,
    };
    let pinned = snapshot::pin(job)?;
    // Written last: a job without it is incomplete.
    Job::new(name.clone(), Work::Relight(Box::new(work)), pinned)?.save(job)?;
    Ok(JobReport {
        job: job.to_path_buf(),
        engine: farm.engine,
        tasks: frames,
        chunk: Some(chunk),
        chunks: frames.div_ceil(chunk),
        ms_per_frame,
        output: Some(output),
        submit,
    })
}

/// File settings with absolute paths, under a free name if existing files are kept.
fn absolute_files(settings: &RelightSettings, numbers: (i64, i64)) -> Result<export::Files> {
    let mut files = settings.files.clone();
    files.to = full_destination(&files.to)?;
    if files.existing == Existing::Keep {
        files.to = files.to.untaken(numbers.0, numbers.1)?;
        files.existing = Existing::Replace;
    }
    // Chunks always resume.
    files.resume = false;
    Ok(files)
}

/// Destination as an absolute path.
fn full_destination(to: &Destination) -> Result<Destination> {
    let text = to.to_string();
    let path = Path::new(&text);
    if path.is_absolute() {
        return Ok(to.clone());
    }
    let here = std::env::current_dir().map_err(|e| Error::io("open", path, e, "Check the path"))?;
    let here = here.display().to_string();
    // In a destination a percent sign starts the frame number.
    let here = match to {
        Destination::Stills(_) => here.replace('%', "%%"),
        Destination::Clip(_) => here,
    };
    Destination::parse(&Path::new(&here).join(path).display().to_string())
}

/// Absolute path of the job's folder: created if missing, and must be empty.
pub(crate) fn new_folder(folder: &Path) -> Result<PathBuf> {
    let fail = |e| Error::io("write", folder, e, "Check that the folder can be written");
    std::fs::create_dir_all(folder).map_err(fail)?;
    if std::fs::read_dir(folder).map_err(fail)?.next().is_some() {
        return Err(Error::invalid(
            format!("{} is not empty", folder.display()),
            "Choose a new folder for the job: nothing is overwritten",
        ));
    }
    let full = folder.canonicalize().map_err(fail)?;
    if full.to_str().is_none() {
        return Err(Error::invalid(
            format!("the path {} is not UTF-8", full.display()),
            "Choose another folder: the engines' files are text",
        ));
    }
    Ok(full)
}

/// Empties the folder of an incomplete job, so that the job can be written again.
pub(crate) fn clear(job: &Path) {
    for entry in std::fs::read_dir(job).into_iter().flatten().flatten() {
        let path = entry.path();
        // The next attempt reports files that cannot be removed.
        let _ = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
    }
}

/// Program on the workers, as the engine's files name it. A bare name is resolved by the workers' own `PATH`.
pub(crate) fn program(farm: &FarmSettings) -> Result<String> {
    let program = match &farm.program {
        Some(program) if program.components().count() > 1 => std::path::absolute(program)
            .map_err(|e| Error::io("find", program, e, "Give its full path: --program FILE"))?,
        Some(program) => program.clone(),
        None => std::env::current_exe().map_err(|e| {
            let remedy = "Give the path of Afterlight on the workers: --program FILE";
            Error::io("find", "afterlight", e, remedy)
        })?,
    };
    Ok(program.display().to_string())
}

/// Measured milliseconds per frame over the first frames, from the plate to the file.
fn rate(copy: &Project, settings: &RelightSettings, job: &Path, progress: &Progress) -> Result<f64> {
    progress.say("Relighting the first frames, to size the chunks");
    let (first, last) = frame_range(copy, settings.frames)?;
    let tried = job.join("tried");
    let part = Part { frames: (first, last.min(first + MEASURED - 1)), folder: tried.clone() };
    let mut settings = settings.clone();
    if let Some(file) = settings.look.background.file().filter(|_| settings.solo.is_empty()) {
        let file = job.join(file);
        settings.look.background = settings.look.background.with_file(file);
    }
    if let Destination::Stills(stills) = &settings.files.to {
        let file = stills.path(0);
        let ending = file.extension().unwrap_or_default();
        // In a destination a percent sign starts the frame number.
        let folder = tried.display().to_string().replace('%', "%%");
        settings.files.to = Destination::parse(&format!("{folder}/%d.{}", ending.display()))?;
    }
    let report = relight_part(copy, &settings, &part, progress)?;
    std::fs::remove_dir_all(&tried)
        .map_err(|e| Error::io("remove", &tried, e, "Check that the folder can be written"))?;
    Ok(report.ms_per_frame)
}
