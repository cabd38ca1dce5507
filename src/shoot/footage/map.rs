//! A shoot as a TOML map: files and frames of interview, poses and mirror balls. See `docs/movies.md`.

use super::lamp_list;
use super::takes::{Rounds, series_path};
use base::error::{Error, Result};
use base::files;
use base::progress::Progress;
use glam::Vec3;
use project::{Clip, DamagedFrames, Still};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Content of the map.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Map {
    pub name: Option<String>,
    /// Base folder of all files, relative to the map's folder; the map's folder by default.
    pub folder: Option<PathBuf>,
    /// Frames per second of an interview of pictures; movies have their own.
    pub frame_rate: Option<f64>,
    pub lamps: Option<Lamps>,
    /// Stand-in for unreadable interview frames.
    #[serde(default)]
    pub damaged_frames: DamagedFrames,
    interview: Interview,
    #[serde(rename = "pose")]
    poses: Vec<Pose>,
    /// Movie of the balls; none with a list of lamps.
    balls: Option<Part>,
    /// Geometry of the balls; by default the ball is searched for and treated as far away.
    #[serde(default)]
    pub ball: Ball,
}

/// A number of lamps, or an `.lp` list.
#[derive(Clone, Deserialize)]
#[serde(untagged)]
pub enum Lamps {
    Count(usize),
    List(PathBuf),
}

/// Known facts of a mirror ball, as in a manifest.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    pub center_px: Option<[f32; 2]>,
    pub radius_px: Option<f32>,
    pub radius_m: Option<f32>,
    pub camera_distance_m: Option<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Interview {
    file: PathBuf,
    frames: Option<[u64; 2]>,
    ball: Option<BallFrame>,
}

/// One picture.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BallFrame {
    file: PathBuf,
    frame: Option<u64>,
}

/// A part of a movie with a lamp cycle.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Part {
    file: PathBuf,
    frames: Option<[u64; 2]>,
    #[serde(default)]
    lamps: Vec<u64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Pose {
    name: String,
    file: PathBuf,
    frames: Option<[u64; 2]>,
    #[serde(default)]
    lamps: Vec<u64>,
    #[serde(default)]
    tracking: Vec<u64>,
}

impl Map {
    /// Reads a map.
    ///
    /// # Errors
    /// When it cannot be read or is incomplete.
    pub fn read(path: &Path) -> Result<Self> {
        const REMEDY: &str =
            "Write it as in docs/movies.md: [interview], [balls] or a list of lamps, and a [[pose]] for each pose";
        let text = files::read_text(path, files::MOST_TEXT).map_err(|e| Error::io("open", path, e, REMEDY))?;
        let map: Self = toml::from_str(&text).map_err(|e| Error::codec("read", path, e.message(), REMEDY))?;
        let mut names: Vec<&String> = map.poses.iter().map(|pose| &pose.name).collect();
        names.sort();
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(Error::codec("read", path, format!("pose {} appears twice", pair[0]), REMEDY));
        }
        let has_list = matches!(map.lamps, Some(Lamps::List(_)));
        let fault = match (&map.balls, &map.interview.ball) {
            _ if map.poses.is_empty() => "it names no pose",
            (None, None) if !has_list => {
                "it has neither [balls] nor a list of the lamps' directions: lamps = \"FILE.lp\""
            }
            (None, Some(_)) => "it has the interview's ball, but no [balls] under the lamps",
            (Some(_), None) => "it has [balls], but no `ball` under the interview's light",
            _ => return Ok(map),
        };
        Err(Error::codec("read", path, fault, REMEDY))
    }

    /// Names and directions of the lamps. Directions are empty if unknown; both are empty if the number of lamps is
    /// unknown too.
    ///
    /// # Errors
    /// When the list cannot be read.
    pub fn lamps(&self, folder: &Path) -> Result<(Vec<String>, Vec<Vec3>)> {
        match &self.lamps {
            None => Ok((vec![], vec![])),
            Some(Lamps::Count(count)) => Ok((lamp_names((*count).min(100_000)), vec![])),
            Some(Lamps::List(path)) => Ok(lamp_list::read(&folder.join(path))?.into_iter().unzip()),
        }
    }

    /// Frames of the interview, and frames per second.
    ///
    /// # Errors
    /// When the movie cannot be read or the frames do not exist.
    pub fn interview(&self, folder: &Path, progress: &Progress) -> Result<(Clip, Option<f64>)> {
        let Interview { file, frames, .. } = &self.interview;
        let file = match frames {
            None => series_path(folder, file, progress)?,
            Some(_) => file.clone(),
        };
        let path = folder.join(&file);
        let source = movies::open(&path)?;
        let (first, count) = (source.first(), source.count()?);
        let end = first + count.saturating_sub(1);
        let [start, last] = frames.unwrap_or([first, end]);
        if start > last || start < first || last > end {
            return Err(Error::invalid(
                format!(
                    "the map gives frames {start} to {last} of {} as the interview; the movie has {first} to {end}",
                    path.display()
                ),
                "Correct `frames` of [interview]: the first frame and the last",
            ));
        }
        let clip = Clip { movie: file, first: start, count: last - start + 1, alpha: source.has_alpha() };
        Ok((clip, source.frame_rate()))
    }

    /// The mirror ball under the interview's light: the given frame, or the middle one. None without balls.
    ///
    /// # Errors
    /// When its movie cannot be read or the frame does not exist.
    pub fn interview_ball(&self, folder: &Path) -> Result<Option<Still>> {
        let ball = self.interview.ball.as_ref();
        ball.map(|BallFrame { file, frame }| still(folder, file, *frame)).transpose()
    }

    /// Movie of the balls, if there are any.
    pub fn balls(&self) -> Option<Rounds> {
        let Part { file, frames, lamps } = self.balls.as_ref()?;
        let (movie, lamps) = (file.clone(), lamps.clone());
        Some(Rounds { movie, range: *frames, lamps, tracking: vec![] })
    }

    /// Movies of the poses, by name.
    pub fn poses(&self) -> impl Iterator<Item = (&String, Rounds)> {
        self.poses.iter().map(|pose| {
            let rounds = Rounds {
                movie: pose.file.clone(),
                range: pose.frames,
                lamps: pose.lamps.clone(),
                tracking: pose.tracking.clone(),
            };
            (&pose.name, rounds)
        })
    }
}

/// One frame of a movie: `frame`, or the middle one.
///
/// # Errors
/// When the movie cannot be read or the frame does not exist.
pub fn still(folder: &Path, file: &Path, frame: Option<u64>) -> Result<Still> {
    let path = folder.join(file);
    let source = movies::open(&path)?;
    let (first, count) = (source.first(), source.count()?);
    let frame = frame.unwrap_or(first + count / 2);
    if frame < first || frame - first >= count {
        return Err(Error::invalid(
            format!(
                "the map gives frame {frame} of {} as the mirror ball; the movie has {count} from {first} on",
                path.display()
            ),
            "Correct the frame number",
        ));
    }
    Ok(Still { movie: file.to_path_buf(), frame })
}

/// Names of unnamed lamps, in the order of lighting.
pub fn lamp_names(count: usize) -> Vec<String> {
    (0..count).map(|lamp| format!("olat_{lamp:03}")).collect()
}
