//! Parts of a shoot that a file or folder may be, when a person brings it: guessed by its name and by its brightness.

use super::lamp_list;
use super::round;
use super::scan::counted;
use super::takes::mean_light;
use base::error::Result;
use imaging::color::{linear_from_srgb, srgb_from_linear};
use imaging::resample::resize_area;
use imaging::{Encoded, Raster};
use movies::{Sequence, Source};
use std::path::{Path, PathBuf};

/// A part of a shoot that a file or folder may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Slot {
    /// The frames to relight.
    Interview,
    /// The mirror ball in the interview's light: one picture.
    InterviewBall,
    /// The mirror ball under each lamp, the lamps in the same order as in the poses.
    Balls,
    /// One pose, the lamps going round.
    Pose,
    /// Names and directions of the lamps.
    Lamps,
}

impl Slot {
    /// All of them, in the order in which they are shown.
    pub const ALL: [Self; 5] =
        [Self::Interview, Self::InterviewBall, Self::Balls, Self::Pose, Self::Lamps];

    /// Its name in the window.
    pub fn name(self) -> &'static str {
        match self {
            Self::Interview => "Interview",
            Self::InterviewBall => "Ball in its light",
            Self::Balls => "Mirror ball",
            Self::Pose => "Poses",
            Self::Lamps => "Lamps",
        }
    }

    /// Description of the footage that belongs there.
    pub fn wants(self) -> &'static str {
        match self {
            Self::Interview => "The frames to relight: a movie, or a folder of pictures",
            Self::InterviewBall => {
                "The mirror ball in the interview's light: one picture, or a movie whose middle frame counts"
            }
            Self::Balls => {
                "The mirror ball under each single lamp: a movie, or a folder of pictures, the lamps in the same order as in the poses"
            }
            Self::Pose => {
                "Each pose under each single lamp: a movie or a folder of pictures for each pose"
            }
            Self::Lamps => {
                "A list of lamps (.lp), if there is one: it names the lamps and says where they are"
            }
        }
    }
}

/// Frames that are looked at to guess what a movie is.
const LOOKED_AT: u64 = 48;
/// Frames that a round of lamps may have to be looked at whole.
const MOST_OF_ROUND: u64 = 600;
/// Pixels along a thumbnail's longer side.
const THUMBNAIL: usize = 192;
/// Half of all steps from frame to frame change the light by more than this factor while lamps go round.
const JUMPS: f32 = 1.15;
/// And by less than this one in an interview.
const STEADY: f32 = 1.05;

/// A file or folder that may be a part of a shoot.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The file, folder or pattern that was looked at.
    pub path: PathBuf,
    /// Its contents, in numbers; empty if it cannot be read.
    pub found: String,
    /// The part that it seems to be.
    pub guess: Option<Slot>,
    /// Reason for the guess; or the reason that it cannot be told.
    pub reason: String,
    /// Reason that it cannot be read.
    pub failure: Option<String>,
    /// Three of its frames: the first, middle and last, or three under one lamp each.
    pub thumbnails: Vec<Encoded>,
    /// Columns and rows.
    pub size: Option<(usize, usize)>,
    /// Number of its frames.
    pub frames: u64,
    /// Its brightness jumps from frame to frame, as while lamps go round; `None` if that is unclear.
    pub jumps: Option<bool>,
    /// Mean light of all frames, if lamps seem to go round.
    pub(super) light: Vec<f32>,
    /// The first frame's number.
    pub(super) first: u64,
    /// Lamps of a list.
    pub(super) lamps: Option<usize>,
}

impl Candidate {
    fn of(path: &Path) -> Self {
        Self {
            path: path.to_path_buf(),
            found: String::new(),
            guess: None,
            reason: String::new(),
            failure: None,
            thumbnails: vec![],
            size: None,
            frames: 0,
            jumps: None,
            light: vec![],
            first: 0,
            lamps: None,
        }
    }

    /// One that could not be looked at.
    pub fn failed(path: &Path, failure: String) -> Self {
        Self { failure: Some(failure), ..Self::of(path) }
    }

    /// Looks at a file, folder or pattern.
    pub fn look(path: &Path) -> Self {
        let mut candidate = Self::of(path);
        let looked = match has_extension(path, "lp") {
            true => candidate.look_at_list(),
            false => candidate.look_at_frames(),
        };
        candidate.failure = looked.err().map(|e| e.to_string());
        candidate
    }

    fn look_at_list(&mut self) -> Result<()> {
        self.guess = Some(Slot::Lamps);
        self.reason = "its name ends in .lp".to_owned();
        let lamps = lamp_list::read(&self.path)?.len();
        self.found = counted(lamps, "lamp");
        self.lamps = Some(lamps);
        Ok(())
    }

    fn look_at_frames(&mut self) -> Result<()> {
        let (named, why) = by_name(&self.path).unzip();
        self.guess = named;
        self.reason = why.map_or(String::new(), |why| format!("its name has “{why}” in it"));
        let source = movies::open(&self.path)?;
        (self.first, self.frames) = (source.first(), source.count()?);
        let (width, height) = source.size();
        self.size = Some((width, height));
        self.found = format!("{} of {width} × {height}", counted(self.frames as usize, "frame"));
        if let Some(rate) = source.frame_rate().filter(|_| self.frames > 1) {
            self.found += &format!(", {} a second", (1000.0 * rate).round() / 1000.0);
        }
        let mut places = vec![0, self.frames / 2, self.frames - 1];
        places.dedup();
        let places = places.into_iter().map(|place| self.first + place);
        self.thumbnails = thumbnails(&source, places)?;
        if self.frames == 1 {
            if self.guess != Some(Slot::InterviewBall) {
                self.guess = Some(Slot::InterviewBall);
                self.reason = "it is one picture".to_owned();
            }
            return Ok(());
        }
        self.look_at_light(&source)
    }

    /// Tells an interview from lamps that go round.
    fn look_at_light(&mut self, source: &Source) -> Result<()> {
        let some = self.frames.min(LOOKED_AT);
        let start = (self.frames - some) / 2;
        let read = |from: u64, count: u64| -> Result<Vec<f32>> {
            (from..from + count).map(|frame| mean_light(source, self.first + frame)).collect()
        };
        let light = read(start, some)?;
        let step = typical_step(&light);
        self.jumps = match step {
            step if step > JUMPS => Some(true),
            step if step < STEADY => Some(false),
            _ => None,
        };
        let by_light = match self.jumps {
            Some(false) => "its brightness hardly changes from frame to frame".to_owned(),
            None => String::new(),
            Some(true) if self.frames > MOST_OF_ROUND => {
                "its brightness jumps from frame to frame, as if lamps went round".to_owned()
            }
            Some(true) => {
                self.light = match some == self.frames {
                    true => light,
                    false => read(0, self.frames)?,
                };
                match round::find(&self.light, self.first, None) {
                    Ok(round) => {
                        // The first, middle and last frame may all be fully lit.
                        let lamps = &round.lamps;
                        let shown = [1, 2, 3].map(|quarter| lamps[quarter * lamps.len() / 4]);
                        self.thumbnails = thumbnails(source, shown)?;
                        let mut text =
                            counted(lamps.len(), "frame") + " look as if one lamp lit each";
                        if !round.tracking.is_empty() {
                            text += &format!(", {} fully lit", round.tracking.len());
                        }
                        text
                    }
                    Err(why) => why,
                }
            }
        };
        if self.guess.is_none() {
            self.guess = self.jumps.map(|jumps| if jumps { Slot::Pose } else { Slot::Interview });
        }
        let reasons = [std::mem::take(&mut self.reason), by_light];
        let reasons: Vec<String> =
            reasons.into_iter().filter(|reason| !reason.is_empty()).collect();
        self.reason = match reasons.is_empty() {
            true => "neither its name nor its brightness tells what it is".to_owned(),
            false => reasons.join("; "),
        };
        Ok(())
    }
}

/// The files, folders and patterns that a dropped path stands for: those in a folder of movies or of folders, the sequence of
/// a numbered picture, or itself.
pub fn expand(path: &Path) -> Vec<PathBuf> {
    if path.is_dir() {
        let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
        let is_part = |path: &PathBuf| {
            let hidden =
                path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
            !hidden && (path.is_dir() || movies::is_movie(path) || has_extension(path, "lp"))
        };
        let mut parts: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(is_part).collect();
        parts.sort();
        return match parts.is_empty() {
            true => vec![path.to_path_buf()],
            false => parts,
        };
    }
    let is_sequence = |pattern: &PathBuf| {
        movies::open(pattern).is_ok_and(|all| all.count().is_ok_and(|count| count > 1))
    };
    let pattern = (!movies::is_movie(path)).then(|| Sequence::of_first(path)).flatten();
    let pattern = pattern.map(|(pattern, _)| pattern).filter(is_sequence);
    vec![pattern.unwrap_or_else(|| path.to_path_buf())]
}

fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}

/// Guess by a name, and the word that gives it: the file's own name first, then its folder's.
fn by_name(path: &Path) -> Option<(Slot, &'static str)> {
    const WORDS: [(Slot, &[&str]); 3] = [
        (Slot::Balls, &["ball", "probe", "chrome", "mirror"]),
        (Slot::Pose, &["pose", "exemplar", "olat", "expression"]),
        (Slot::Interview, &["interview", "talk", "monologue", "speech"]),
    ];
    let names = [path.file_name(), path.parent().and_then(Path::file_name)];
    names.into_iter().flatten().find_map(|name| {
        let name = name.to_string_lossy().to_lowercase();
        let word = |words: &[&'static str]| words.iter().copied().find(|word| name.contains(word));
        let found = WORDS.map(|(slot, words)| word(words).map(|word| (slot, word)));
        match found {
            // `probes_interview.mov`
            [Some((_, word)), _, Some(_)] => Some((Slot::InterviewBall, word)),
            found => found.into_iter().flatten().next(),
        }
    })
}

/// The factor by which the light changes from frame to frame; half of all steps are larger.
fn typical_step(light: &[f32]) -> f32 {
    const BLACK: f32 = 1e-4;
    let change = |pair: &[f32]| (pair[0].max(BLACK) / pair[1].max(BLACK)).ln().abs();
    let mut steps: Vec<f32> = light.windows(2).map(change).collect();
    steps.sort_by(f32::total_cmp);
    steps.get(steps.len() / 2).map_or(1.0, |step| step.exp())
}

fn thumbnails(source: &Source, frames: impl IntoIterator<Item = u64>) -> Result<Vec<Encoded>> {
    let read = |frame| Ok(thumbnail(&source.frame(frame)?.encoded()));
    frames.into_iter().map(read).collect()
}

/// A small copy of a picture.
fn thumbnail(picture: &Encoded) -> Encoded {
    let (width, height) = picture.0.size();
    let longer = width.max(height);
    let side = |side: usize| (side * THUMBNAIL.min(longer) / longer).max(1);
    let light = picture.0.map(|pixel| pixel.map(linear_from_srgb));
    let small: Raster<[f32; 3]> = resize_area(&light, side(width), side(height));
    Encoded(small.map(|pixel| pixel.map(srgb_from_linear)))
}
