//! Writes a job of an export.

use super::chunks::chunk_size;
use super::engine::Engine;
use super::job::{Job, RelightWork, Work};
use super::settings::{ChunkSettings, FarmSettings};
use super::snapshot;
use super::{open_job_description, slurm};
use base::error::{Error, Result};
use base::progress::Progress;
use export::relight::{Part, RelightSettings, frame_range, relight_part};
use export::{Destination, Existing, footage_print, untaken};
use project::{Picture, Project};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Frames that are relit to measure what one takes.
const MEASURED: usize = 3;

/// A job that was written.
#[derive(Clone, Debug, Serialize)]
pub struct JobReport {
    pub job: PathBuf,
    pub engine: Engine,
    /// Frames, or trainings.
    pub tasks: usize,
    /// Frames of a chunk; None of a job that trains.
    pub chunk: Option<usize>,
    pub chunks: usize,
    /// Milliseconds of a frame, if known.
    pub ms_per_frame: Option<f64>,
    /// Destination of the result; None of a job that trains.
    pub output: Option<String>,
    /// The command that submits it.
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
        let rate = self
            .ms_per_frame
            .map_or(String::new(), |ms| format!(" (a frame takes {ms:.0} ms here)"));
        format!(
            "The job for {} is in {}: {what}{rate}. Submit it: {}",
            self.engine.name(),
            self.job.display(),
            self.submit
        )
    }
}

/// Writes a job that relights `project` as `relight` would with `settings`. The frames are made by chunks on many machines,
/// the last step makes the movie. Later changes of the project do not affect it.
///
/// # Errors
/// When something of the project is missing, the settings cannot be, the job's folder holds something, or files cannot be
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
    settings.files = absolute_files(&settings, (first, last))?;
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
        Picture::Movie { file, .. } if file.is_file() => Some(
            footage_print(&file)
                .map_err(|e| Error::io("read", &file, e, "Check that the movie is there"))?,
        ),
        _ => None,
    };
    let depends = settings.goes_from_frame_to_frame();
    let (chunk, ms_per_frame) = match chunks.chunk {
        // Each frame depends on the one before it: chunks would begin with the first frame each.
        _ if depends => {
            progress.say(
                "Each frame depends on the one before it (--smoothing, --field compressed): all frames are one chunk",
            );
            (frames, None)
        }
        Some(chunk) => (chunk.min(frames), None),
        None => {
            let ms = rate(&copy, &settings, job, progress)?;
            (chunk_size(ms, chunks.chunk_minutes, frames), Some(ms))
        }
    };
    let output = settings.files.to.clone();
    let work =
        RelightWork { frames: (first, last), chunk, ms_per_frame, environment, movie, settings };
    let program = program(farm)?;
    let name = &project.settings.name;
    let submit = match farm.engine {
        Engine::OpenJobDescription => {
            open_job_description::write(job, name, &program, farm, &work)?
        }
        Engine::Slurm => slurm::write(job, name, &program, farm, &work)?,
    };
    let pinned = snapshot::pin(job)?;
    // Last: a job without it was not written to its end.
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

/// The files that are to be written, by full paths, under a name that is not taken if existing ones are to be kept.
fn absolute_files(settings: &RelightSettings, frames: (usize, usize)) -> Result<export::Files> {
    let mut files = settings.files.clone();
    files.to = full_destination(&files.to)?;
    if files.existing == Existing::Keep {
        files.to = untaken(&files.to, frames.0, frames.1)?;
        files.existing = Existing::Replace;
    }
    // Chunks always go on.
    files.resume = false;
    Ok(files)
}

/// A destination by its full path.
fn full_destination(to: &str) -> Result<String> {
    let destination = Destination::parse(to)?;
    let path = Path::new(to);
    if path.is_absolute() {
        return Ok(to.to_owned());
    }
    let here = std::env::current_dir().map_err(|e| Error::io("open", path, e, "Check the path"))?;
    let here = here.display().to_string();
    // There a percent sign begins the frame's number.
    let here = match destination {
        Destination::Stills(_) => here.replace('%', "%%"),
        Destination::Clip(_) => here,
    };
    Ok(Path::new(&here).join(path).display().to_string())
}

/// The job's folder, by its full path: it is made, and must be empty.
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

/// Empties the folder of a job that could not be written to its end, so that it can be written again.
pub(crate) fn clear(job: &Path) {
    for entry in std::fs::read_dir(job).into_iter().flatten().flatten() {
        let path = entry.path();
        // What cannot be removed is named when the job is written again.
        let _ = match path.is_dir() {
            true => std::fs::remove_dir_all(path),
            false => std::fs::remove_file(path),
        };
    }
}

/// The program on the workers, as the engine's files name it. A name alone is found by the workers' own `PATH`.
pub(crate) fn program(farm: &FarmSettings) -> Result<String> {
    let program = match &farm.program {
        Some(program) if program.components().count() > 1 => std::path::absolute(program)
            .map_err(|e| Error::io("find", program, e, "Give its full path: --program FILE"))?,
        Some(program) => program.clone(),
        None => std::env::current_exe().map_err(|e| {
            let remedy = "Say where Afterlight is on the workers: --program FILE";
            Error::io("find", "afterlight", e, remedy)
        })?,
    };
    Ok(program.display().to_string())
}

/// Milliseconds that the first frames take now, from the plate to the file.
fn rate(
    copy: &Project,
    settings: &RelightSettings,
    job: &Path,
    progress: &Progress,
) -> Result<f64> {
    progress.say("Relighting the first frames, to size the chunks");
    let (first, last) = frame_range(copy, settings.frames)?;
    let tried = job.join("tried");
    let part = Part { frames: (first, last.min(first + MEASURED - 1)), folder: tried.clone() };
    let mut settings = settings.clone();
    if let Destination::Stills(_) = Destination::parse(&settings.files.to)? {
        let ending = Path::new(&settings.files.to).extension().unwrap_or_default();
        // There a percent sign begins the frame number.
        let folder = tried.display().to_string().replace('%', "%%");
        settings.files.to = format!("{folder}/%d.{}", ending.display());
    }
    let report = relight_part(copy, &settings, &part, progress)?;
    std::fs::remove_dir_all(&tried)
        .map_err(|e| Error::io("remove", &tried, e, "Check that the folder can be written"))?;
    Ok(report.ms_per_frame)
}
