//! Guess of the part of a shoot that a file or folder contains, from its name and its brightness.

use super::lamp_list;
use super::round;
use super::scan::counted;
use super::takes::{frame_light, mean_light};
use base::error::Result;
use base::has_extension;
use imaging::color::{linear_from_srgb, srgb_from_linear};
use imaging::resample::resize_area;
use imaging::{Encoded, Raster};
use movies::{Sequence, Series, Source};
use std::path::{Path, PathBuf};

/// Part of a shoot that a file or folder may contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Slot {
    /// The frames to relight.
    Interview,
    /// The mirror ball in the interview's light: one picture.
    InterviewBall,
    /// The mirror ball under each lamp, in the same lamp order as the poses.
    Balls,
    /// One pose during the lamp cycle.
    Pose,
    /// Names and directions of the lamps.
    Lamps,
}

impl Slot {
    /// All parts, in display order.
    pub const ALL: [Self; 5] = [Self::Interview, Self::InterviewBall, Self::Balls, Self::Pose, Self::Lamps];

    /// Name in the window.
    pub fn name(self) -> &'static str {
        match self {
            Self::Interview => "Interview",
            Self::InterviewBall => "Mirror ball, interview light",
            Self::Balls => "Mirror ball",
            Self::Pose => "Poses",
            Self::Lamps => "Lamps",
        }
    }

    /// Description of the matching footage.
    pub fn wants(self) -> &'static str {
        match self {
            Self::Interview => "The frames to relight: a movie, or a folder of pictures",
            Self::InterviewBall => {
                "The mirror ball in the interview's light: one picture, or a movie (its middle frame is used)"
            }
            Self::Balls => {
                "The mirror ball under each single lamp: a movie or a folder of pictures, in the same lamp order as the poses"
            }
            Self::Pose => "Each pose under each single lamp: a movie or a folder of pictures for each pose",
            Self::Lamps => "An optional list of lamps (.lp) with their names and directions",
        }
    }
}

/// Number of frames sampled to classify a movie.
const LOOKED_AT: u64 = 48;
/// Largest number of frames of a lamp cycle, all of which may be read.
const MOST_OF_ROUND: u64 = 600;
/// Longer side of a thumbnail in pixels.
const THUMBNAIL: usize = 192;
/// Smallest median brightness ratio between frames of a lamp cycle.
const JUMPS: f32 = 1.15;
/// Largest median brightness ratio between frames of an interview.
const STEADY: f32 = 1.05;
/// Smallest distance between the brightest spots of three in four pairs of consecutive pictures of a mirror ball under
/// single lamps, as a share of the longer side. A person sways by less from frame to frame.
const SPOT_MOVES: f32 = 0.01;

/// A file or folder that may contain a part of a shoot.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The inspected file, folder or pattern.
    pub path: PathBuf,
    /// Summary of its contents; empty if it cannot be read.
    pub found: String,
    /// Most likely part.
    pub guess: Option<Slot>,
    /// Reason for the guess, or for its absence.
    pub reason: String,
    /// Reading error.
    pub failure: Option<String>,
    /// Three of its frames: the first, middle and last, or three single-lamp frames.
    pub thumbnails: Vec<Encoded>,
    /// Width and height.
    pub size: Option<(usize, usize)>,
    /// Number of its frames.
    pub frames: u64,
    /// True if its brightness jumps from frame to frame, as in a lamp cycle; `None` if unclear.
    pub jumps: Option<bool>,
    /// Mean light of all frames of an apparent lamp cycle.
    pub(super) light: Vec<f32>,
    /// Number of the first frame.
    pub(super) first: u64,
    /// Number of lamps in a list.
    pub(super) lamps: Option<usize>,
    /// Layers of its first EXR, if that has several.
    pub layers: Vec<String>,
}

impl Candidate {
    fn from_path(path: &Path) -> Self {
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
            layers: vec![],
        }
    }

    /// A candidate that could not be read.
    pub fn failed(path: &Path, failure: String) -> Self {
        Self { failure: Some(failure), ..Self::from_path(path) }
    }

    /// Inspects a file, folder or pattern.
    pub fn look(path: &Path) -> Self {
        let mut candidate = Self::from_path(path);
        let looked = if has_extension(path, "lp") { candidate.look_at_list() } else { candidate.look_at_frames() };
        candidate.failure = looked.err().map(|e| e.to_string());
        candidate
    }

    fn look_at_list(&mut self) -> Result<()> {
        self.guess = Some(Slot::Lamps);
        self.reason = "the name ends in .lp".to_owned();
        let lamps = lamp_list::read(&self.path)?.len();
        self.found = counted(lamps, "lamp");
        self.lamps = Some(lamps);
        Ok(())
    }

    fn look_at_frames(&mut self) -> Result<()> {
        let (named, why) = by_name(&self.path).unzip();
        self.guess = named;
        self.reason = why.map_or(String::new(), |why| format!("the name contains “{why}”"));
        let series = self.path.is_dir().then(|| Series::find(&self.path)).transpose()?;
        let first = series.as_ref().and_then(|series| series.names.first());
        let first = first.map_or_else(|| self.path.clone(), |name| self.path.join(&**name));
        self.layers = imaging::picture::layers(&first).unwrap_or_default();
        let path = series.as_ref().map_or_else(|| self.path.clone(), Series::path);
        let source = movies::open(&path)?;
        (self.first, self.frames) = (source.first(), source.count()?);
        let (width, height) = source.size();
        self.size = Some((width, height));
        self.found = format!("{} of {width} × {height}", counted(self.frames as usize, "frame"));
        if let Some(rate) = source.frame_rate().filter(|_| self.frames > 1) {
            self.found += &format!(", {} a second", (1000.0 * rate).round() / 1000.0);
        }
        if let Some(note) = series.and_then(|series| series.left_out_note()) {
            self.found += &format!("; {note}");
        }
        let mut places = vec![0, self.frames / 2, self.frames - 1];
        places.dedup();
        let places = places.into_iter().map(|place| self.first + place);
        self.thumbnails = thumbnails(&source, places)?;
        if self.frames == 1 {
            if self.guess != Some(Slot::InterviewBall) {
                self.guess = Some(Slot::InterviewBall);
                self.reason = "a single picture".to_owned();
            }
            return Ok(());
        }
        self.look_at_light(&source)
    }

    /// Distinguishes an interview from a lamp cycle.
    fn look_at_light(&mut self, source: &Source) -> Result<()> {
        let some = self.frames.min(LOOKED_AT);
        let start = (self.frames - some) / 2;
        let read = |frame: u64| frame_light(source, self.first + frame);
        let sampled: Vec<_> = (start..start + some).map(read).collect::<Result<_>>()?;
        let (light, spots): (Vec<_>, Vec<_>) = sampled.into_iter().map(|light| (light.mean, light.spot)).unzip();
        let longer = source.size().0.max(source.size().1);
        let spot_moves = typical_distance(&spots) > SPOT_MOVES.max(1.5 / longer as f32);
        let step = typical_step(&light);
        self.jumps = match step {
            step if step > JUMPS => Some(true),
            step if step < STEADY => Some(false),
            _ => None,
        };
        let mut by_light = match (self.jumps, spot_moves) {
            (Some(true), _) => "the brightness jumps from frame to frame, as in a lamp cycle",
            (_, true) => "the highlight moves from frame to frame, as on a mirror ball",
            (Some(false), false) => "the brightness hardly changes from frame to frame",
            (None, false) => "",
        }
        .to_owned();
        if (self.jumps == Some(true) || spot_moves) && self.frames <= MOST_OF_ROUND {
            self.light = if some == self.frames {
                light
            } else {
                let all = 0..self.frames;
                all.map(|frame| mean_light(source, self.first + frame)).collect::<Result<_>>()?
            };
            let found = match round::find(&self.light, self.first, None) {
                Ok(round) => {
                    // The first, middle and last frame may all be fully lit.
                    let lamps = &round.lamps;
                    let shown = [1, 2, 3].map(|quarter| lamps[quarter * lamps.len() / 4]);
                    self.thumbnails = thumbnails(source, shown)?;
                    let mut text = counted(lamps.len(), "frame") + " each lit by one lamp";
                    if !round.tracking.is_empty() {
                        text += &format!(", {} fully lit", round.tracking.len());
                    }
                    text
                }
                Err(why) => why,
            };
            by_light = match self.jumps {
                Some(true) => found,
                _ => format!("{by_light}; {found}"),
            };
        }
        if self.guess.is_none() {
            self.guess = match (self.jumps, spot_moves) {
                (Some(true), _) => Some(Slot::Pose),
                (_, true) => Some(Slot::Balls),
                (Some(false), false) => Some(Slot::Interview),
                (None, false) => None,
            };
        }
        let reasons = [std::mem::take(&mut self.reason), by_light];
        let reasons: Vec<String> = reasons.into_iter().filter(|reason| !reason.is_empty()).collect();
        self.reason = if reasons.is_empty() {
            "neither name nor brightness is conclusive".to_owned()
        } else {
            reasons.join("; ")
        };
        Ok(())
    }
}

/// Expands a dropped path: the contents of a folder of movies or folders, the sequence of a numbered picture, or
/// the path itself.
pub fn expand(path: &Path) -> Vec<PathBuf> {
    if path.is_dir() {
        let names = base::files::sorted_names(path).unwrap_or_default();
        let is_part = |path: &PathBuf| path.is_dir() || movies::is_movie(path) || has_extension(path, "lp");
        let parts: Vec<PathBuf> = names.iter().map(|name| path.join(name)).filter(is_part).collect();
        return if parts.is_empty() { vec![path.to_path_buf()] } else { parts };
    }
    let is_sequence =
        |pattern: &PathBuf| movies::open(pattern).is_ok_and(|all| all.count().is_ok_and(|count| count > 1));
    let pattern = (!movies::is_movie(path)).then(|| Sequence::pattern_from_first(path)).flatten();
    let pattern = pattern.map(|(pattern, _)| pattern).filter(is_sequence);
    vec![pattern.unwrap_or_else(|| path.to_path_buf())]
}

/// Guess from a name, and the matching word: the file's own name first, then its folder's.
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

/// Median brightness ratio between consecutive frames.
fn typical_step(light: &[f32]) -> f32 {
    const BLACK: f32 = 1e-4;
    let change = |pair: &[f32]| (pair[0].max(BLACK) / pair[1].max(BLACK)).ln().abs();
    let mut steps: Vec<f32> = light.windows(2).map(change).collect();
    steps.sort_by(f32::total_cmp);
    steps.get(steps.len() / 2).map_or(1.0, |step| step.exp())
}

/// Distance between the brightest spots that three in four pairs of consecutive frames exceed, as a share of the longer
/// side. A frame without a spot counts as unmoved.
fn typical_distance(spots: &[Option<[f32; 2]>]) -> f32 {
    let distance = |pair: &[Option<[f32; 2]>]| {
        let ([ax, ay], [bx, by]) = (pair[0]?, pair[1]?);
        Some((ax - bx).hypot(ay - by))
    };
    let mut distances: Vec<f32> = spots.windows(2).map(|pair| distance(pair).unwrap_or(0.0)).collect();
    distances.sort_by(f32::total_cmp);
    distances.get(distances.len() / 4).copied().unwrap_or(0.0)
}

fn thumbnails(source: &Source, frames: impl IntoIterator<Item = u64>) -> Result<Vec<Encoded>> {
    let read = |frame| Ok(thumbnail(&source.frame(frame)?.encoded()));
    frames.into_iter().map(read).collect()
}

/// A reduced copy of a picture.
fn thumbnail(picture: &Encoded) -> Encoded {
    let (width, height) = picture.0.size();
    let longer = width.max(height);
    let side = |side: usize| (side * THUMBNAIL.min(longer) / longer).max(1);
    let light = picture.0.map(|pixel| pixel.map(linear_from_srgb));
    let small: Raster<[f32; 3]> = resize_area(&light, side(width), side(height));
    Encoded(small.map(|pixel| pixel.map(srgb_from_linear)))
}
