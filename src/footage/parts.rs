//! What an import finds: in a shoot's folder, whose parts may be movies, or by a TOML map.

use super::lamp_list;
use super::map::{self, Map};
use super::shoot::{Camera, Listing, Manifest, Probes, entries, name_of};
use super::takes::Rounds;
use base::error::{Error, Result};
use base::progress::Progress;
use glam::Vec3;
use project::{Frames, Takes};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A shoot, before its pictures are looked at.
pub struct Parts {
    /// The folder to which all names are relative.
    pub folder: PathBuf,
    /// The file that says what the pictures do not show.
    pub said_in: PathBuf,
    pub manifest: Manifest,
    pub listing: Listing,
    pub takes: Takes,
    /// Directions of the lamps by an `.lp` list; empty if there is none.
    pub directions: Vec<Vec3>,
}

impl Parts {
    /// Finds the parts of the shoot at `shoot`: a folder with a manifest, or a TOML map.
    ///
    /// # Errors
    /// When something is missing or cannot be read, or a movie shows another number of lamps.
    pub fn find(shoot: &Path, progress: &Progress) -> Result<Self> {
        let is_map = shoot
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        if is_map && shoot.is_file() {
            return Self::of_map(shoot, progress);
        }
        if shoot.is_file() {
            return Err(Error::invalid(
                format!("{} alone is no shoot", shoot.display()),
                "A shoot also has poses under single lamps and mirror balls. If they are all in this movie, say which \
                 frames are what in a TOML map, and give that: docs/movies.md has one to start from",
            ));
        }
        Self::of_folder(shoot, progress)
    }

    fn of_folder(shoot: &Path, progress: &Progress) -> Result<Self> {
        let manifest = Manifest::read(shoot)?;
        let mut listing = Listing::read(shoot)?;
        let mut takes = Takes::default();
        let list = lamp_list_of(shoot)?;
        let known = (!listing.lamps.is_empty()).then_some(listing.lamps.len());
        let mut expected = known
            .or(list.as_ref().map(Vec::len))
            .or(manifest.olat_conditions);
        let name_lamps = |listing: &mut Listing, count: usize| {
            if listing.lamps.is_empty() {
                let names = list.as_ref().filter(|list| list.len() == count);
                listing.lamps = match names {
                    Some(list) => list.iter().map(|(name, _)| name.clone()).collect(),
                    None => map::lamp_names(count),
                };
            }
        };
        if let Some(movie) = listing.ball_movie.clone() {
            let rounds = Rounds::of(movie);
            let found = rounds.find(shoot, expected, progress)?;
            expected = Some(found.0.lamps.len());
            name_lamps(&mut listing, found.0.lamps.len());
            takes.balls = Some(rounds.take(found, &listing.lamps));
        }
        if let Some(file) = &listing.interview_ball {
            takes.interview_ball = Some(map::still(shoot, file, None)?);
        }
        for (pose, movie) in listing.pose_movies.clone() {
            let rounds = Rounds::of(movie);
            let found = rounds.find(shoot, expected, progress)?;
            expected = Some(found.0.lamps.len());
            name_lamps(&mut listing, found.0.lamps.len());
            takes.poses.insert(pose, rounds.take(found, &listing.lamps));
        }
        let by_name: HashMap<String, Vec3> = list.into_iter().flatten().collect();
        let directions: Option<_> = listing
            .lamps
            .iter()
            .map(|lamp| by_name.get(lamp).copied())
            .collect();
        if directions.is_none() && !by_name.is_empty() {
            progress.say(
                "The names in the .lp list are not those of the lamps, so the list is not used",
            );
        }
        Ok(Self {
            folder: shoot.to_path_buf(),
            said_in: shoot.join(super::shoot::MANIFEST),
            manifest,
            listing,
            takes,
            directions: directions.unwrap_or_default(),
        })
    }

    fn of_map(path: &Path, progress: &Progress) -> Result<Self> {
        let map = Map::read(path)?;
        let parent = path
            .parent()
            .filter(|parent| !parent.as_os_str().is_empty());
        let folder = parent.unwrap_or(Path::new(".")).to_path_buf();
        let (mut lamps, directions) = map.lamps(&folder)?;
        let balls = map.balls();
        let expected = (!lamps.is_empty()).then_some(lamps.len());
        let found = balls.find(&folder, expected, progress)?;
        if lamps.is_empty() {
            lamps = map::lamp_names(found.0.lamps.len());
        }
        let mut takes = Takes {
            balls: Some(balls.take(found, &lamps)),
            interview_ball: Some(map.interview_ball(&folder)?),
            ..Takes::default()
        };
        let mut poses = Vec::new();
        for (pose, rounds) in map.poses() {
            let found = rounds.find(&folder, Some(lamps.len()), progress)?;
            takes.poses.insert(pose.clone(), rounds.take(found, &lamps));
            poses.push(pose.clone());
        }
        let (clip, frame_rate) = map.interview(&folder)?;
        let probes = Probes {
            ball_center_px: map.ball.center_px,
            ball_radius_px: map.ball.radius_px,
            ball_radius_m: map.ball.radius_m,
            ball_position_m: None,
        };
        let camera = map.ball.camera_distance_m.map(|distance| Camera {
            position: [0.0, 0.0, distance],
        });
        let manifest = Manifest {
            name: map.name.or_else(|| Some(name_of(&path.with_extension("")))),
            frame_rate: map.frame_rate,
            camera,
            probes,
            ..Manifest::default()
        };
        Ok(Self {
            folder,
            said_in: path.to_path_buf(),
            manifest,
            listing: Listing {
                poses,
                lamps,
                frames: Frames::Clip(clip),
                frame_rate,
                ..Listing::default()
            },
            takes,
            directions,
        })
    }
}

/// The lamps of the `.lp` list in a shoot's folder; `None` if it has none.
fn lamp_list_of(shoot: &Path) -> Result<Option<Vec<(String, Vec3)>>> {
    let is_list = |path: &Path| {
        path.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("lp"))
    };
    let lists = entries(shoot, |path| is_list(path).then(|| name_of(path)))?;
    lists
        .first()
        .map(|name| lamp_list::read(&shoot.join(name)))
        .transpose()
}
