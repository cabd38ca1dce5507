//! Last step of an export made in parts: checks every frame, and joins the frames of a movie.

use super::codec::Codec;
use super::colors::Encoding;
use super::destination::{Destination, Stills};
use super::interview::Interview;
use super::look::Look;
use super::movie_frames::MovieFrames;
use super::provenance::provenance_of;
use super::relight::{RelightSettings, frame_range};
use super::scaled::fitted;
use super::whole::{check_whole, is_whole};
use super::writer::Writer;
use base::error::{Error, Result};
use base::files::remove_left_over;
use base::progress::Progress;
use footage::picture_size;
use project::Project;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Flaw of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Flaw {
    /// The file is missing.
    Missing,
    /// The file's provenance differs or is absent.
    MadeOfOther,
    /// The file is damaged or truncated.
    Broken,
}

/// Frame that has to be written again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlawedFrame {
    pub frame: usize,
    pub flaw: Flaw,
    pub file: PathBuf,
}

/// Number of frames checked between two safe points.
const AT_ONCE: usize = 256;

/// Checks every frame of an export that was [made in parts](super::relight::relight_part): the file must exist, have the
/// project's current provenance, and be complete to its last byte. `folder` holds the frames of a movie. Returns the flawed
/// frames in order.
///
/// # Errors
/// When the project or its look cannot be read, or the user stops.
pub fn flawed_frames(
    project: &Project,
    settings: &RelightSettings,
    folder: &Path,
    progress: &Progress,
) -> Result<Vec<FlawedFrame>> {
    let look = Look::open(project, settings, progress)?;
    let provenance = look.provenance()?;
    let files = FrameFiles::new(settings, &Interview::from_project(project)?, folder)?;
    let (first, last) = look.frames;
    let count = (last - first + 1) as u64;
    let mut found = Vec::new();
    for from in (first..=last).step_by(AT_ONCE) {
        progress.check("")?;
        progress.step("checking frames", (from - first) as u64, count, "");
        let to = last.min(from + AT_ONCE - 1);
        let flawed = (from..=to).into_par_iter().filter_map(|frame| {
            let file = files.path(frame);
            let scene = look.scene(frame);
            let wanted = match provenance.frame(project, &scene) {
                Ok(wanted) => wanted,
                Err(error) => return Some(Err(error)),
            };
            let flaw = flaw(&file, &wanted, settings.files.layers)?;
            Some(Ok(FlawedFrame { frame, flaw, file }))
        });
        found.extend(flawed.collect::<Result<Vec<_>>>()?);
    }
    progress.step("checking frames", count, count, "");
    Ok(found)
}

fn flaw(file: &Path, wanted: &str, has_layers: bool) -> Option<Flaw> {
    if !file.exists() {
        return Some(Flaw::Missing);
    }
    match provenance_of(file) {
        // A file truncated within its header has no provenance either.
        None if check_whole(file).is_err() => Some(Flaw::Broken),
        Some(made_of) if made_of == wanted => (!is_whole(file, has_layers)).then_some(Flaw::Broken),
        _ => Some(Flaw::MadeOfOther),
    }
}

/// Files of an export's frames.
enum FrameFiles {
    /// With the number of the interview's first frame.
    Stills(Stills, i64),
    Movie(MovieFrames),
}

impl FrameFiles {
    fn new(settings: &RelightSettings, interview: &Interview, folder: &Path) -> Result<Self> {
        let files = &settings.files;
        Ok(match &files.to {
            Destination::Clip(path) => {
                let codec = Codec::for_path(files.codec, path)?;
                Self::Movie(MovieFrames::new(folder, codec, files.movie_alpha))
            }
            Destination::Stills(stills) => Self::Stills(stills.clone(), files.numbers(interview, (0, 0)).0),
        })
    }

    fn path(&self, frame: usize) -> PathBuf {
        match self {
            Self::Stills(stills, start) => stills.path(start + frame as i64),
            Self::Movie(frames) => frames.path(frame),
        }
    }
}

/// Joins the frames in `folder` into the export's movie, with sound, time code and reel as in a single export. Removes
/// leftovers of killed workers beside the frames. Stills need no joining. Returns where the result is.
///
/// # Errors
/// When a frame cannot be read, the movie cannot be written, or the user stops. No movie remains then.
pub fn join_movie(
    project: &Project,
    settings: &RelightSettings,
    folder: &Path,
    progress: &Progress,
) -> Result<Destination> {
    let (first, last) = frame_range(project, settings.frames)?;
    let interview = Interview::from_project(project)?;
    let files = FrameFiles::new(settings, &interview, folder)?;
    let mut cleaned = PathBuf::new();
    for file in (first..=last).map(|frame| files.path(frame)) {
        if let Some(folder) = file.parent().filter(|folder| **folder != *cleaned) {
            remove_left_over(folder);
            cleaned = folder.to_path_buf();
        }
    }
    let FrameFiles::Movie(frames) = files else { return Ok(settings.files.to.clone()) };
    let size = picture_size(project, settings.files.at)?;
    let written = (settings.files.size).map_or(size, |longest| fitted(size, longest));
    let encoding = Encoding::for_files(&settings.files)?;
    let mut writer = Writer::open(&settings.files, &encoding, (first, last), size, &interview, None, progress)?;
    let count = (last - first + 1) as u64;
    let mut join = || {
        for frame in first..=last {
            progress.check("")?;
            let note = format!("frame {frame}");
            progress.step("joining the movie", (frame - first) as u64, count, note);
            writer.feed(frames.read(frame, written)?, progress)?;
        }
        writer.finish(progress)
    };
    join().map_err(|e| match e {
        Error::Cancelled { .. } => Error::Cancelled { kept: "all frames are kept, no movie was written".to_owned() },
        other => other,
    })?;
    progress.step("joining the movie", count, count, "");
    Ok(writer.files.to)
}
