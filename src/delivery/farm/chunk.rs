//! Chunk of a job, as a worker runs it. It can run again at any time, even in two workers at once.

use super::chunks::FrameSpan;
use super::job::Job;
use super::record::{self, Record};
use base::error::{Error, Result};
use base::files::open_own;
use base::machine::Machine;
use base::progress::Progress;
use export::relight::{Part, relight_part};
use export::{Destination, Files, footage_print};
use gpu::DeviceChoice;
use project::Picture;
use serde::Serialize;
use std::fs::{File, OpenOptions, TryLockError};
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between two checks for the end of another worker.
const LOOK: Duration = Duration::from_millis(200);
/// Folder of a movie's frames.
pub(crate) const FRAMES: &str = "frames";

/// Report on a worker's frames.
#[derive(Clone, Debug, Serialize)]
pub struct ChunkReport {
    #[serde(flatten)]
    pub record: Record,
    /// Destination of the frames.
    pub output: String,
}

impl ChunkReport {
    /// Result of the chunk in one sentence.
    pub fn sentence(&self) -> String {
        let (first, last) = self.record.frames;
        format!(
            "Frames {first} to {last} are done ({} existed before) after {:.1} s: {}",
            self.record.kept, self.record.seconds, self.output
        )
    }
}

/// Relights the frames `frames` of the job in `folder`. Complete frames with the same provenance are kept, so
/// the chunk continues where a killed worker stopped. `device` overrides the job's device of the network, `shoot` the
/// footage's folder.
///
/// # Errors
/// When another program wrote the job, its snapshot or the footage has changed, it lacks such frames, a file cannot be
/// written, or the user stops: finished frames are kept.
pub fn run_chunk(
    folder: &Path,
    frames: FrameSpan,
    device: Option<DeviceChoice>,
    shoot: Option<&Path>,
    progress: &Progress,
) -> Result<ChunkReport> {
    let started = Instant::now();
    let (mut work, project) = Job::open(folder)?.export(folder, shoot)?;
    if let Some(device) = device {
        work.settings.device = device;
    }
    if let (Some(print), Picture::Movie { file, .. }) = (&work.movie, project.frame_picture(0)) {
        let now =
            footage_print(&file).map_err(|e| Error::io("read", &file, e, "Check that the worker sees the footage"))?;
        if now != *print {
            return Err(Error::invalid(
                format!("{} is not the movie of this job", file.display()),
                "Restore that movie, or write the job again: afterlight farm PROJECT --to DIR",
            ));
        }
    }
    let part = Part { frames: frames.within(work.frames.1), folder: folder.join(FRAMES) };
    let begun = started.elapsed();
    let _lock = lock(folder, part.frames, progress)?;
    // Waiting for another worker does not count as work.
    let waited = started.elapsed() - begun;
    let report = relight_part(&project, &work.settings, &part, progress)?;
    let output = match report.output {
        Destination::Clip(_) => part.folder.display().to_string(),
        stills => stills.to_string(),
    };
    let seconds = (started.elapsed() - waited).as_secs_f64();
    let relit = (report.frames - report.kept) as f64;
    let record = Record {
        frames: part.frames,
        kept: report.kept,
        seconds,
        start_seconds: (seconds - relit * report.ms_per_frame / 1e3).max(begun.as_secs_f64()),
        stages: report.stages,
        bytes: frame_bytes(&work.settings.files, part.frames, folder),
        device: report.device,
        machine: Machine::this(),
    };
    // A record of the run that made the frames stays valid.
    if relit > 0.0 || !record::path(folder, part.frames, "json").exists() {
        record.save(folder)?;
    }
    Ok(ChunkReport { record, output })
}

/// Bytes of the existing files among frames `first` to `last` of the job in `folder`.
pub(crate) fn frame_bytes(files: &Files, (first, last): (usize, usize), folder: &Path) -> u64 {
    let frames = folder.join(FRAMES);
    // The job holds its first number.
    let start = files.first_number.unwrap_or(0);
    let file = |frame| match &files.to {
        Destination::Clip(_) => export::movie_frame(&frames, frame),
        Destination::Stills(stills) => stills.path(start + frame as i64),
    };
    let found = (first..=last).filter_map(|frame| file(frame).metadata().ok());
    found.map(|data| data.len()).sum()
}

/// Waits until no other worker has these frames, if the disk supports locks: the other worker's frames are kept then.
/// Without locks both write each frame beside its file and rename it, with identical bytes.
fn lock(folder: &Path, frames: (usize, usize), progress: &Progress) -> Result<Option<File>> {
    let path = record::path(folder, frames, "lock");
    let fail = |e| {
        let remedy = "Check that the worker may write into the job's folder and the disk has room";
        Error::io("write", &path, e, remedy)
    };
    std::fs::create_dir_all(folder.join("records")).map_err(fail)?;
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false);
    let file = open_own(&path, &options).map_err(fail)?;
    let mut is_told = false;
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(Some(file)),
            Err(TryLockError::Error(_)) => return Ok(None),
            Err(TryLockError::WouldBlock) => {
                if !is_told {
                    let (first, last) = frames;
                    progress.say(format!("Another worker has frames {first} to {last}: waiting for its end"));
                    is_told = true;
                }
                progress.check("no frame was started")?;
                std::thread::sleep(LOOK);
            }
        }
    }
}
