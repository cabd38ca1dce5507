//! A shoot's folder: its manifest and its files.

use base::error::{Error, Result};
use base::{files, has_extension};
use glam::Vec3;
use project::{Ball, Clip, DamagedFrames, Frames, NamedEnvironment, SecondBall, Shoot};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// File name of a shoot's manifest.
pub const MANIFEST: &str = "manifest.json";
/// Folder of a second mirror ball's photographs.
pub const SECOND_PROBES: &str = "probes_2";
/// Remedy for a folder that is not a shoot.
pub const NO_SHOOT: &str = "Check that this is a shoot folder and is complete";

/// Contents of a shoot's `manifest.json`: facts that the pictures alone do not show.
#[derive(Default, Deserialize)]
pub struct Manifest {
    #[serde(default)]
    pub name: Option<String>,
    #[serde(default)]
    pub frame_rate: Option<f64>,
    /// Camera; by default it is treated as infinitely far.
    #[serde(default)]
    pub camera: Option<Camera>,
    #[serde(default)]
    pub dome_radius_m: Option<f32>,
    #[serde(default)]
    pub probes: Probes,
    /// A second ball, if present: [`SECOND_PROBES`], or in the same photographs.
    #[serde(default)]
    pub second_probes: Option<Probes>,
    #[serde(default)]
    pub hdris: Vec<NamedEnvironment>,
    /// Directions from the subject to the lamps, in the order of the OLATs' numbers. Any value is accepted, so that
    /// a shoot with invalid directions can still be imported.
    #[serde(default)]
    pub bank_directions: Option<serde_json::Value>,
    /// Times of the tracking frames; evenly spaced by default.
    #[serde(default)]
    pub tracking: Option<TrackingTimes>,
    #[serde(default)]
    pub exemplar_poses: Option<usize>,
    #[serde(default)]
    pub olat_conditions: Option<usize>,
    #[serde(default)]
    pub frames: Option<usize>,
    /// Stand-in for unreadable interview frames: `stop`, `hold` or `black`.
    #[serde(default)]
    pub damaged_frames: DamagedFrames,
}

/// Times of the fully lit photographs during the lamp cycle.
#[derive(Deserialize)]
pub struct TrackingTimes {
    /// For each frame the index of the next lamp, from 0; the number of lamps at the end.
    #[serde(default)]
    pub before_lamp: Vec<usize>,
}

#[derive(Deserialize)]
pub struct Camera {
    pub position: [f32; 3],
}

/// A mirror ball in the manifest; unknown values are omitted.
#[derive(Default, Deserialize)]
pub struct Probes {
    /// Centre of the ball; without centre and radius, the calibration detects the ball in its photographs.
    #[serde(default)]
    pub ball_center_px: Option<[f32; 2]>,
    #[serde(default)]
    pub ball_radius_px: Option<f32>,
    /// Radius of the ball; by default its size is unknown, and the camera is treated as infinitely far.
    #[serde(default)]
    pub ball_radius_m: Option<f32>,
    /// Centre of the ball in metres from the subject: right, up, towards the camera.
    #[serde(default)]
    pub ball_position_m: Option<[f32; 3]>,
}

impl Manifest {
    /// Reads the manifest of the shoot in folder `shoot`.
    ///
    /// # Errors
    /// When it is missing or invalid.
    pub fn read(shoot: &Path) -> Result<Self> {
        let path = shoot.join(MANIFEST);
        let text = files::read_text(&path, files::MOST_TEXT).map_err(|e| {
            Error::io(
                "open",
                &path,
                e,
                "Choose the folder with a shoot's manifest.json. If the shoot has none, write one with \
                 only {}: camera and mirror ball then count as far away, and the ball is detected",
            )
        })?;
        serde_json::from_str(&text).map_err(|e| {
            Error::codec(
                "read",
                &path,
                e,
                ("Correct the manifest", "afterlight stage writes an example"),
            )
        })
    }

    /// Refuses a folder whose numbers of poses, lamps or frames differ from the manifest's.
    ///
    /// # Errors
    /// When they differ.
    pub fn check_counts(&self, shoot: &Path, listing: &Listing) -> Result<()> {
        // Lamps of movies are counted when the movies are read.
        let is_known = !listing.lamps.is_empty() || listing.pose_movies.is_empty();
        let lamps = self.olat_conditions.filter(|_| is_known);
        let counts = [
            ("exemplar_poses", self.exemplar_poses, listing.poses.len()),
            ("olat_conditions", lamps, listing.lamps.len()),
            ("frames", self.frames, listing.frames.len()),
        ];
        match counts.into_iter().find(|(_, said, found)| said.is_some_and(|said| said != *found)) {
            Some((key, Some(said), found)) => Err(Error::invalid(
                format!(
                    "{} gives {said} for `{key}`, but the folder has {found}",
                    shoot.join(MANIFEST).display()
                ),
                "Add the missing pictures, or correct the manifest",
            )),
            _ => Ok(()),
        }
    }

    /// Frames per second of the interview, if given.
    pub fn frame_rate(&self) -> Option<f64> {
        (self.frame_rate).filter(|rate| Shoot::FRAME_RATES.contains(rate))
    }

    /// The mirror ball, seen from the camera.
    pub fn ball(&self) -> Ball {
        self.ball_of(&self.probes)
    }

    /// The second mirror ball; `None` if the shoot in folder `shoot` has none.
    pub fn second_ball(&self, shoot: &Path) -> Option<SecondBall> {
        let own = shoot.join(SECOND_PROBES).is_dir();
        if !own && self.second_probes.is_none() {
            return None;
        }
        let unknown = Probes::default();
        let second = self.second_probes.as_ref().unwrap_or(&unknown);
        let first = self.probes.ball_position_m.map(Vec3::from_array);
        let position = second.ball_position_m.map(Vec3::from_array);
        let positions_m = position
            .map(|second| [first.unwrap_or(Vec3::ZERO), second])
            .filter(|[first, second]| first.is_finite() && second.is_finite() && first != second);
        Some(SecondBall {
            folder: if own { SECOND_PROBES } else { "probes" }.into(),
            ball: self.ball_of(second),
            positions_m,
        })
    }

    fn ball_of(&self, probes: &Probes) -> Ball {
        let found = match (probes.ball_center_px, probes.ball_radius_px) {
            (Some(center), Some(radius)) => Ball::far(center, radius),
            _ => Ball::unknown(),
        };
        match (&self.camera, probes.ball_radius_m) {
            (Some(camera), Some(radius_m)) => Ball {
                radius_m,
                camera_distance_m: Vec3::from_array(camera.position).length(),
                ..found
            },
            _ => found,
        }
    }
}

/// Contents of a shoot: names, sorted, without extensions.
#[derive(Default)]
pub struct Listing {
    pub poses: Vec<String>,
    /// Every lamp of any pose or probe. A missing file is reported when it is read.
    pub lamps: Vec<String>,
    pub frames: Frames,
    /// Frames per second of a movie interview, if the movie has them.
    pub frame_rate: Option<f64>,
    /// Movies of poses under `exemplars/`, by pose name; relative to the shoot's folder.
    pub pose_movies: BTreeMap<String, PathBuf>,
    /// Movie of the mirror balls, relative to the shoot's folder.
    pub ball_movie: Option<PathBuf>,
    /// Movie of the mirror ball under the interview's light, if it is a movie.
    pub interview_ball: Option<PathBuf>,
}

impl Listing {
    /// Lists the shoot in folder `shoot`.
    ///
    /// # Errors
    /// When one of its folders or movies cannot be read.
    pub fn read(shoot: &Path) -> Result<Self> {
        Self::list(shoot, None, true)
    }

    /// Lists the shoot in folder `shoot` with the movie `interview` in it as its interview.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn with_interview(shoot: &Path, interview: &Path) -> Result<Self> {
        Self::list(shoot, Some(name_of(interview).into()), true)
    }

    /// Lists a shoot that may lack folders.
    pub fn present(shoot: &Path) -> Self {
        Self::list(shoot, None, false).unwrap_or_default()
    }

    /// With `all`, an unreadable folder is an error; otherwise it counts as empty.
    fn list(shoot: &Path, interview: Option<PathBuf>, all: bool) -> Result<Self> {
        let judged = |names: Result<Vec<String>>| match names {
            Err(_) if !all => Ok(vec![]),
            names => names,
        };
        let exemplars = shoot.join("exemplars");
        let folder = |path: &Path| path.is_dir().then(|| name_of(path));
        let mut poses = judged(entries(&exemplars, folder))?;
        let mut lamps = BTreeSet::new();
        for pose in &poses {
            lamps.extend(judged(png_names(&exemplars.join(pose)))?);
        }
        let movie = |path: &Path| movies::is_movie(path).then(|| name_of(path));
        let mut pose_movies = BTreeMap::new();
        for movie in judged(entries(&exemplars, movie))? {
            let movie = Path::new("exemplars").join(movie);
            let pose = name_of(&movie.with_extension(""));
            if poses.contains(&pose) || pose_movies.contains_key(&pose) {
                let problem = format!("{} has more than one pose {pose}", exemplars.display());
                return Err(Error::invalid(problem, "Give each pose one folder or one movie"));
            }
            pose_movies.insert(pose, movie);
        }
        poses.extend(pose_movies.keys().cloned());
        poses.sort();
        let ball_movie = movie_named(shoot, "probes");
        // With a movie of the balls, the folder holds at most the interview's ball.
        let probes = match &ball_movie {
            Some(_) => vec![],
            None => judged(png_names(&shoot.join("probes")))?,
        };
        lamps.extend(probes.into_iter().filter(|name| name != "interview"));
        let interview = interview.or_else(|| clip_named(shoot, "interview"));
        let (frames, frame_rate) = match interview.map(|movie| clip(shoot, movie)) {
            Some(Ok((clip, rate))) => (Frames::Clip(clip), rate),
            Some(Err(e)) if all => return Err(e),
            _ => (judged(png_names(&shoot.join("interview")))?.into(), None),
        };
        Ok(Self {
            poses,
            lamps: lamps.into_iter().collect(),
            frames,
            frame_rate,
            pose_movies,
            ball_movie,
            interview_ball: movie_named(shoot, "probes_interview"),
        })
    }
}

/// The movie `name.mov` (or another extension) in a shoot's folder, or the folder `name` of pictures other than
/// PNG; `None` without either.
fn clip_named(shoot: &Path, name: &str) -> Option<PathBuf> {
    movie_named(shoot, name).or_else(|| {
        let folder = shoot.join(name);
        let is_other = png_names(&folder).is_ok_and(|names| names.is_empty());
        let has_pictures = || movies::open(&folder).is_ok();
        (folder.is_dir() && is_other && has_pictures()).then(|| name.into())
    })
}

/// All frames of a movie or sequence in a shoot's folder, with its frames per second if known.
fn clip(shoot: &Path, movie: PathBuf) -> Result<(Clip, Option<f64>)> {
    let source = movies::open(&shoot.join(&movie))?;
    let clip =
        Clip { movie, first: source.first(), count: source.count()?, alpha: source.has_alpha() };
    Ok((clip, source.frame_rate()))
}

/// The movie `name.mov`, or with another extension, in a shoot's folder.
fn movie_named(shoot: &Path, name: &str) -> Option<PathBuf> {
    let is_named = |path: &Path| path.file_stem().is_some_and(|stem| stem == name);
    let movie = |path: &Path| (is_named(path) && movies::is_movie(path)).then(|| name_of(path));
    Some(entries(shoot, movie).ok()?.first()?.into())
}

/// Names that `pick` returns for a folder's entries, sorted.
pub fn entries(folder: &Path, pick: impl Fn(&Path) -> Option<String>) -> Result<Vec<String>> {
    let listing = std::fs::read_dir(folder).map_err(|e| Error::io("open", folder, e, NO_SHOOT))?;
    let mut names: Vec<String> =
        listing.flatten().filter_map(|entry| pick(&entry.path())).collect();
    names.sort();
    Ok(names)
}

pub fn png_names(folder: &Path) -> Result<Vec<String>> {
    entries(folder, |path| {
        (has_extension(path, "png") && !name_of(path).starts_with('.'))
            .then(|| path.with_extension(""))
            .map(|p| name_of(&p))
    })
}

pub fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(|| "shoot".to_owned(), |n| n.to_string_lossy().into_owned())
}
