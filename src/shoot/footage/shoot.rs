//! A shoot's folder: its manifest and its files.

use base::error::{Error, Result};
use base::files::{self, natural_order, sorted_names};
use base::{FileFormat, has_extension};
use glam::Vec3;
use movies::Series;
use project::{Ball, Clip, DamagedFrames, Frames, NamedEnvironment, SecondBall, Shoot, Take, Takes};
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
    /// Reads the manifest of the shoot in folder `shoot`; a shoot without mirror balls needs none.
    ///
    /// # Errors
    /// When it is missing or invalid.
    pub fn read(shoot: &Path) -> Result<Self> {
        let path = shoot.join(MANIFEST);
        // The manifest's facts are about the balls.
        if !path.exists() && is_without_balls(shoot) {
            return Ok(Self::default());
        }
        let text = files::read_text(&path, files::MOST_TEXT).map_err(|e| {
            Error::io(
                "open",
                &path,
                e,
                "Choose the folder with a shoot's manifest.json. If the shoot has none, write one with \
                 only {}: camera and mirror ball then count as far away, and the ball is detected",
            )
        })?;
        serde_json::from_str(&text)
            .map_err(|e| Error::codec("read", &path, e, ("Correct the manifest", "afterlight stage writes an example")))
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
                format!("{} gives {said} for `{key}`, but the folder has {found}", shoot.join(MANIFEST).display()),
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
            (Some(camera), Some(radius_m)) => {
                Ball { radius_m, camera_distance_m: Vec3::from_array(camera.position).length(), ..found }
            }
            _ => found,
        }
    }
}

/// Contents of a shoot: names in natural order, without extensions.
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
    /// True if the shoot has a list of lamps (`.lp`) and no mirror balls.
    pub without_balls: bool,
    /// Movie of the interview's mattes, and pictures of poses and balls that have other names than the lamps and follow
    /// their order.
    pub takes: Takes,
    /// Sentences on pictures that are left out, missing, or matched by order.
    pub notes: Vec<String>,
    /// Parts with several candidates, in a listing of what is [present](Self::present).
    pub faults: Vec<(Part, Error)>,
}

/// Parts of a shoot that may have several candidates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Exemplars,
    Balls,
    Interview,
    Mattes,
}

/// A folder of pictures under single lamps.
struct LampFolder {
    /// Pose; `None` for the mirror balls.
    pose: Option<String>,
    /// Relative to the shoot's folder.
    inside: PathBuf,
    names: Vec<String>,
}

impl Listing {
    /// Lists the shoot in folder `shoot`.
    ///
    /// # Errors
    /// When one of its folders or movies cannot be read, or a part has several candidates.
    pub fn read(shoot: &Path) -> Result<Self> {
        Self::list(shoot, None, true)
    }

    /// Lists the shoot in folder `shoot` with the movie `interview` in it as its interview.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn with_interview(shoot: &Path, interview: &Path) -> Result<Self> {
        Self::list(shoot, Some(file_name(interview).into()), true)
    }

    /// Lists a shoot that may lack folders.
    pub fn present(shoot: &Path) -> Self {
        Self::list(shoot, None, false).unwrap_or_default()
    }

    /// With `all`, a missing or ambiguous part is an error; otherwise it counts as empty.
    fn list(shoot: &Path, interview: Option<PathBuf>, all: bool) -> Result<Self> {
        let mut listing = Self::default();
        let mut folders = Vec::new();
        let found = [
            (Part::Exemplars, listing.find_poses(shoot, &mut folders)),
            (Part::Balls, listing.find_balls(shoot, &mut folders)),
            (Part::Exemplars, listing.match_lamps(shoot, folders)),
            (Part::Interview, listing.find_interview(shoot, interview)),
            (Part::Mattes, listing.find_mattes(shoot)),
        ];
        for (part, found) in found {
            match found {
                Err(e) if all => return Err(e),
                Err(e @ Error::Invalid { .. }) => listing.faults.push((part, e)),
                // A message on the part follows.
                Err(_) | Ok(()) => {}
            }
        }
        Ok(listing)
    }

    /// Lamps whose pictures single poses lack, by pose, where other poses have them. The shoot can do without: a pose that has
    /// less than half of the lamps is a fault.
    pub fn lacking(&self, shoot: &Path) -> BTreeMap<String, BTreeSet<String>> {
        let is_folder = |pose: &&String| !self.pose_movies.contains_key(*pose) && !self.takes.poses.contains_key(*pose);
        let folders: BTreeMap<&String, Vec<String>> = (self.poses.iter().filter(is_folder))
            .map(|pose| {
                let folder = shoot.join("exemplars").join(pose);
                (pose, picture_names(&folder).unwrap_or_default())
            })
            .collect();
        let others = self.poses.len() > folders.len();
        let is_somewhere = |lamp: &String| others || folders.values().any(|has| has.contains(lamp));
        let lacking = folders.iter().filter_map(|(pose, has)| {
            let lacks = self.lamps.iter().filter(|lamp| !has.contains(lamp) && is_somewhere(lamp));
            let lacks: BTreeSet<String> = lacks.cloned().collect();
            let is_fault = lacks.is_empty() || 2 * lacks.len() > self.lamps.len();
            (!is_fault).then(|| ((*pose).clone(), lacks))
        });
        lacking.collect()
    }

    fn find_poses(&mut self, shoot: &Path, folders: &mut Vec<LampFolder>) -> Result<()> {
        let exemplars = shoot.join("exemplars");
        let folder = |path: &Path| path.is_dir().then(|| file_name(path));
        self.poses = entries(&exemplars, folder)?;
        for pose in &self.poses {
            let inside = Path::new("exemplars").join(pose);
            let names = picture_names(&shoot.join(&inside))?;
            folders.push(LampFolder { pose: Some(pose.clone()), inside, names });
        }
        let movie = |path: &Path| movies::is_movie(path).then(|| file_name(path));
        for movie in entries(&exemplars, movie)? {
            let pose = file_name(&Path::new(&movie).with_extension(""));
            let other = match self.pose_movies.get(&pose) {
                Some(other) => Some(file_name(other)),
                None => self.poses.contains(&pose).then(|| format!("{pose}/")),
            };
            if let Some(other) = other {
                let problem = format!("{} has more than one pose {pose}: {other} and {movie}", exemplars.display());
                return Err(Error::invalid(problem, "Give each pose one folder or one movie"));
            }
            self.pose_movies.insert(pose, Path::new("exemplars").join(movie));
        }
        self.poses.extend(self.pose_movies.keys().cloned());
        self.poses.sort_by(|a, b| natural_order(a, b));
        Ok(())
    }

    fn find_balls(&mut self, shoot: &Path, folders: &mut Vec<LampFolder>) -> Result<()> {
        const KEEP: &str = "Keep one of them in the shoot's folder";
        self.ball_movie = movie_named(shoot, "probes", KEEP)?;
        self.interview_ball = movie_named(shoot, "probes_interview", KEEP)?;
        self.without_balls = is_without_balls(shoot) && self.ball_movie.is_none();
        if self.without_balls {
            return Ok(());
        }
        // With a movie of the balls, the folder holds at most the interview's ball.
        if self.ball_movie.is_none() {
            let mut names = picture_names(&shoot.join("probes"))?;
            names.retain(|name| name != "interview");
            folders.push(LampFolder { pose: None, inside: "probes".into(), names });
        }
        Ok(())
    }

    /// Finds the lamps by their names. A folder that has as many pictures as the first pose, and no name in common with
    /// it, follows the order of its names.
    fn match_lamps(&mut self, shoot: &Path, mut folders: Vec<LampFolder>) -> Result<()> {
        for at in 0..folders.len() {
            // A picture beside the series of one folder is no lamp.
            let Ok(series) = Series::find(&shoot.join(&folders[at].inside)) else { continue };
            let is_stray = |name: &String| {
                let is_left = series.left_out.iter().any(|file| stem(file) == name);
                let others = folders.iter().enumerate().filter(|(other, _)| *other != at);
                is_left && !others.into_iter().any(|(_, other)| other.names.contains(name))
            };
            let strays: Vec<String> = folders[at].names.iter().filter(|name| is_stray(name)).cloned().collect();
            if !strays.is_empty() {
                folders[at].names.retain(|name| !strays.contains(name));
                let inside = folders[at].inside.display();
                self.notes.push(format!(
                    "{} in {inside} is left out: no other folder has a lamp of that name",
                    strays.join(", ")
                ));
            }
        }
        let mut lamps = Vec::new();
        let first = folders.iter().find(|folder| folder.pose.is_some());
        let first = first.map(|folder| folder.names.clone()).unwrap_or_default();
        for LampFolder { pose, inside, names } in folders {
            let is_other =
                !first.is_empty() && names.len() == first.len() && !names.iter().any(|name| first.contains(name));
            if !is_other {
                lamps.extend(names);
                continue;
            }
            self.notes.push(format!(
                "{}: names differ from the lamps'; pictures are matched by order, from {} for {} to {} for {}",
                inside.display(),
                names[0],
                first[0],
                names[names.len() - 1],
                first[first.len() - 1]
            ));
            let take = in_order(shoot, &inside, &names, &first)?;
            match pose {
                Some(pose) => drop(self.takes.poses.insert(pose, take)),
                None => self.takes.balls = Some(take),
            }
        }
        lamps.sort_by(|a, b| natural_order(a, b));
        lamps.dedup();
        self.lamps = lamps;
        Ok(())
    }

    fn find_interview(&mut self, shoot: &Path, movie: Option<PathBuf>) -> Result<()> {
        let folder = shoot.join("interview");
        let movie = match movie {
            Some(movie) => Some(movie),
            None => {
                let chosen = "Keep one of them, or import the movie that is the interview";
                let movie = movie_named(shoot, "interview", chosen)?;
                let is_both = movies::pictures(&folder).is_ok_and(|all| !all.is_empty());
                if let Some(movie) = movie.as_ref().filter(|_| is_both) {
                    let candidates = [movie.display().to_string(), "interview/".to_owned()];
                    return Err(several(shoot, "interview", &candidates, chosen));
                }
                movie
            }
        };
        if let Some(movie) = movie {
            return self.film(shoot, movie);
        }
        let series = Series::find(&folder)?;
        self.notes.extend(series.left_out_note());
        let is_png = |name: &str| has_extension(Path::new(name), "png");
        if series.names.iter().all(|name| is_png(name)) {
            self.notes.extend(series.missing_note());
            let names: Vec<String> = series.with_missing();
            self.frames = names.iter().map(|name| stem(name).to_owned()).collect::<Vec<_>>().into();
            return Ok(());
        }
        match &series.pattern {
            Some(pattern) => self.film(shoot, Path::new("interview").join(pattern)),
            None => {
                self.notes.extend(series.missing_note());
                self.film(shoot, "interview".into())
            }
        }
    }

    /// All frames of a movie or sequence in a shoot's folder, with its frames per second if known.
    fn film(&mut self, shoot: &Path, movie: PathBuf) -> Result<()> {
        let source = movies::open(&shoot.join(&movie))?;
        let (first, count, alpha) = (source.first(), source.count()?, source.has_alpha());
        self.frames = Frames::Clip(Clip { movie, first, count, alpha });
        self.frame_rate = source.frame_rate();
        Ok(())
    }

    fn find_mattes(&mut self, shoot: &Path) -> Result<()> {
        const KEEP: &str = "Keep one of them in the shoot's folder";
        const MATTES: &str = "interview_masks";
        let movie = movie_named(shoot, MATTES, KEEP)?;
        if let Some(movie) = movie.as_ref().filter(|_| shoot.join(MATTES).is_dir()) {
            let candidates = [movie.display().to_string(), format!("{MATTES}/")];
            return Err(several(shoot, MATTES, &candidates, KEEP));
        }
        self.takes.interview_mattes = movie;
        Ok(())
    }
}

/// Lists of lamps (`.lp`) in a shoot's folder.
///
/// # Errors
/// When the folder cannot be read.
pub fn lamp_lists(shoot: &Path) -> Result<Vec<String>> {
    entries(shoot, |path| has_extension(path, "lp").then(|| file_name(path)))
}

/// True if a shoot's folder has a list of lamps and no folder of mirror balls.
fn is_without_balls(shoot: &Path) -> bool {
    !shoot.join("probes").exists() && lamp_lists(shoot).is_ok_and(|lists| !lists.is_empty())
}

/// Pictures of a folder under these lamps, in the same order as their names.
fn in_order(shoot: &Path, inside: &Path, names: &[String], lamps: &[String]) -> Result<Take> {
    let folder = shoot.join(inside);
    let files = movies::pictures(&folder)?;
    let place = |name: &String| files.iter().position(|file| stem(file) == name);
    let places = names.iter().map(|name| place(name).unwrap_or_default() as u64);
    // A pattern still holds after pictures are added.
    let series = Series::find(&folder)
        .ok()
        .filter(|series| series.missing.is_empty() && series.names.iter().map(|name| stem(name)).eq(names));
    let pattern = series.and_then(|series| series.pattern);
    let (movie, frames) = match pattern {
        Some(pattern) => {
            let movie = inside.join(pattern);
            let first = movies::open(&shoot.join(&movie))?.first();
            (movie, (first..).take(names.len()).collect::<Vec<_>>())
        }
        None => (inside.to_path_buf(), places.collect()),
    };
    let lamps = lamps.iter().cloned().zip(frames).collect();
    Ok(Take { movie, alpha: false, tracking: vec![], lamps })
}

/// The movie `name.mov`, or with another extension, in a shoot's folder; None without one.
///
/// # Errors
/// When there are several.
pub fn movie_named(shoot: &Path, name: &str, remedy: &str) -> Result<Option<PathBuf>> {
    let is_named = |path: &Path| path.file_stem().is_some_and(|stem| stem == name);
    let movie = |path: &Path| (is_named(path) && movies::is_movie(path)).then(|| file_name(path));
    let found = entries(shoot, movie).unwrap_or_default();
    match &found[..] {
        [] => Ok(None),
        [one] => Ok(Some(one.into())),
        _ => Err(several(shoot, name, &found, remedy)),
    }
}

/// Error of several candidates for a part.
pub fn several(shoot: &Path, part: &str, candidates: &[String], remedy: &str) -> Error {
    let problem = format!("{} has more than one {part}: {}", shoot.display(), candidates.join(" and "));
    match part {
        "interview" => {
            let one = shoot.join(&candidates[0]);
            let how = format!("afterlight import PROJECT --shoot {}", one.display());
            Error::invalid(problem, remedy).with_how(how)
        }
        _ => Error::invalid(problem, remedy),
    }
}

/// Names that `pick` returns for a folder's entries, in natural order.
pub fn entries(folder: &Path, pick: impl Fn(&Path) -> Option<String>) -> Result<Vec<String>> {
    let names = sorted_names(folder).map_err(|e| Error::io("open", folder, e, NO_SHOOT))?;
    Ok(names.iter().filter_map(|name| pick(&folder.join(name))).collect())
}

/// Names of a folder's pictures, in natural order, without their endings.
///
/// # Errors
/// When the folder cannot be read, or two pictures differ only in their endings.
pub fn picture_names(folder: &Path) -> Result<Vec<String>> {
    let files = entries(folder, |path| {
        let is_picture = FileFormat::from_path(path).is_some_and(FileFormat::is_picture);
        is_picture.then(|| file_name(path))
    })?;
    if let Some(pair) = files.windows(2).find(|pair| stem(&pair[0]) == stem(&pair[1])) {
        let remedy = "Keep one of them in the folder";
        return Err(several(folder, &format!("picture {}", stem(&pair[0])), pair, remedy));
    }
    Ok(files.iter().map(|file| stem(file).to_owned()).collect())
}

/// Verb and contents of a folder that lacks something.
pub fn contents(folder: &Path) -> String {
    let Ok(names) = sorted_names(folder) else { return "does not exist".to_owned() };
    let mut kinds = BTreeMap::new();
    for name in &names {
        let path = folder.join(name);
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let kind = if path.is_dir() { "folder".to_owned() } else { format!(".{ending}") };
        *kinds.entry(kind).or_insert(0) += 1;
    }
    let kinds: Vec<String> = kinds.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
    if kinds.is_empty() {
        "is empty".to_owned()
    } else {
        format!("has {}; PNG, JPEG, TIFF and EXR are read", kinds.join(", "))
    }
}

/// A file name without its ending.
pub fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

pub fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| "shoot".to_owned(), |n| n.to_string_lossy().into_owned())
}
