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
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Between two looks at whether the other worker has ended.
const LOOK: Duration = Duration::from_millis(200);
/// The folder of a movie's frames.
pub(crate) const FRAMES: &str = "frames";

/// What a worker made.
#[derive(Clone, Debug, Serialize)]
pub struct ChunkReport {
    #[serde(flatten)]
    pub record: Record,
    /// Where the frames are.
    pub output: String,
}

impl ChunkReport {
    /// What was made, in a sentence.
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
                format!(
                    "{} is not the movie that the job was written for",
                    file.display()
                ),
                "Bring back that movie, or write the job again: afterlight farm PROJECT --to DIR",
            ));
        }
    }
    let part = Part {
        frames: frames.within(work.frames.1),
        folder: folder.join(FRAMES),
    };
    let _lock = lock(folder, part.frames, progress)?;
    let begun = started.elapsed();
    let report = relight_part(&project, &work.settings, &part, progress)?;
    let seconds = started.elapsed().as_secs_f64();
    let relit = (report.frames - report.kept) as f64;
    let record = Record {
        frames: part.frames,
        kept: report.kept,
        seconds,
        start_seconds: (seconds - relit * report.ms_per_frame / 1e3).max(begun.as_secs_f64()),
        stages: report.stages,
        bytes: files(&work.settings.files.to, &part)?
            .filter_map(|file| file.metadata().ok())
            .map(|data| data.len())
            .sum(),
        device: report.device,
        machine: Machine::this(),
    };
    record.save(folder)?;
    Ok(ChunkReport {
        record,
        output: report.output,
    })
}

/// The files of a part's frames.
fn files(to: &str, part: &Part) -> Result<Box<dyn Iterator<Item = PathBuf>>> {
    let (first, last) = part.frames;
    let folder = part.folder.clone();
    Ok(match Destination::parse(to)? {
        Destination::Clip(_) => {
            Box::new((first..=last).map(move |frame| export::movie_frame(&folder, frame)))
        }
        stills => Box::new((first..=last).filter_map(move |f| stills.files(f, f).next())),
    })
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
