//! A chunk: what a worker does. It can be run again at any time, by two workers at once too.

use super::chunks::FrameSpan;
use super::job::Job;
use super::record::{self, Record};
use base::error::{Error, Result};
use base::files::open_own;
use base::machine::Machine;
use base::progress::Progress;
use export::relight::{Part, relight_part};
use export::{Destination, footage_print};
use gpu::DeviceChoice;
use project::Picture;
use serde::Serialize;
use std::fs::{File, OpenOptions, TryLockError};
use std::path::Path;
use std::time::{Duration, Instant};

/// Between two looks at whether the other worker has ended.
const LOOK: Duration = Duration::from_millis(200);
/// The folder of a movie's frames.
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
    /// Result of the chunk, in a sentence.
    pub fn sentence(&self) -> String {
        let (first, last) = self.record.frames;
        format!(
            "Frames {first} to {last} are there ({} were before), after {:.1} s: {}",
            self.record.kept, self.record.seconds, self.output
        )
    }
}

/// Relights the frames `frames` of the job in `folder`. Frames that are there, whole and made of the same, are kept, so
/// it goes on where a killed worker stopped. `device` is where the network runs, if not where the job says; `shoot` is
/// where the footage is, if not where it was.
///
/// # Errors
/// When the job is another program's, its snapshot or the footage has changed, it has no such frames, a file cannot be
/// written, or a stop was asked for: finished frames are kept.
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
        let now = footage_print(&file)
            .map_err(|e| Error::io("read", &file, e, "Check that the worker sees the footage"))?;
        if now != *print {
            return Err(Error::invalid(
                format!("{} is not the movie that the job was written for", file.display()),
                "Bring back that movie, or write the job again: afterlight farm PROJECT --to DIR",
            ));
        }
    }
    let part = Part { frames: frames.within(work.frames.1), folder: folder.join(FRAMES) };
    let begun = started.elapsed();
    let _lock = lock(folder, part.frames, progress)?;
    // Waiting for another worker is no work.
    let waited = started.elapsed() - begun;
    let report = relight_part(&project, &work.settings, &part, progress)?;
    let seconds = (started.elapsed() - waited).as_secs_f64();
    let relit = (report.frames - report.kept) as f64;
    let record = Record {
        frames: part.frames,
        kept: report.kept,
        seconds,
        start_seconds: (seconds - relit * report.ms_per_frame / 1e3).max(begun.as_secs_f64()),
        stages: report.stages,
        bytes: frame_bytes(&work.settings.files.to, part.frames, folder)?,
        device: report.device,
        machine: Machine::this(),
    };
    // What the frames took when they were made stays told.
    if relit > 0.0 || !record::path(folder, part.frames, "json").exists() {
        record.save(folder)?;
    }
    Ok(ChunkReport { record, output: report.output })
}

/// Bytes of frames `first` to `last` of the job in `folder`, as far as they are there.
pub(crate) fn frame_bytes(to: &str, (first, last): (usize, usize), folder: &Path) -> Result<u64> {
    let destination = Destination::parse(to)?;
    let frames = folder.join(FRAMES);
    let file = |frame| match &destination {
        Destination::Clip(_) => Some(export::movie_frame(&frames, frame)),
        stills => stills.files(frame, frame).next(),
    };
    let files = (first..=last).filter_map(file);
    let found = files.filter_map(|file| file.metadata().ok());
    Ok(found.map(|data| data.len()).sum())
}

/// Waits until no other worker is at these frames, where the disk can tell: what it has finished is kept then. Where it
/// cannot, both write each frame beside and rename it, and the same bytes come out.
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
                    progress.say(format!(
                        "Another worker is at frames {first} to {last}: waiting until it has ended"
                    ));
                    is_told = true;
                }
                progress.check("no frame was begun")?;
                std::thread::sleep(LOOK);
            }
        }
    }
}
