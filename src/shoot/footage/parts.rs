//! Parts found by an import: in a shoot's folder, possibly as movies, or through a TOML map.

use super::lamp_list;
use super::map::{self, Map};
use super::shoot::{Camera, Listing, Manifest, Probes, file_name, lamp_lists, movie_named, several};
use super::takes::Rounds;
use base::error::{Error, Result};
use base::has_extension;
use base::progress::Progress;
use glam::Vec3;
use imaging::picture;
use project::{Frames, Takes};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A shoot before its pictures are read.
pub struct Parts {
    /// Base folder of all names.
    pub folder: PathBuf,
    /// The manifest or map.
    pub said_in: PathBuf,
    pub manifest: Manifest,
    pub listing: Listing,
    pub takes: Takes,
    /// Directions of the lamps from an `.lp` list of all; empty without one.
    pub directions: Vec<Vec3>,
    /// Lamps that an `.lp` list of some names; empty without one.
    pub named: Vec<String>,
}

impl Parts {
    /// Finds the parts of the shoot at `shoot`: a folder with a manifest, or a TOML map. Its EXR files are read by `layer`.
    ///
    /// # Errors
    /// When a part is missing or cannot be read, or a movie's number of lamps differs.
    pub fn find(shoot: &Path, layer: Option<&str>, progress: &Progress) -> Result<Self> {
        if has_extension(shoot, "toml") && shoot.is_file() {
            return Self::from_map(shoot, layer, progress);
        }
        let folder = if shoot.is_file() { shoot.parent() } else { Some(shoot) };
        picture::choose_layer(folder.unwrap_or(shoot), layer);
        if shoot.is_file() {
            return Self::from_interview(shoot, progress);
        }
        check_parts(shoot)?;
        Self::from_folder(shoot, Manifest::read(shoot)?, Listing::read(shoot)?, progress)
    }

    /// A movie is the interview of the shoot in its folder.
    fn from_interview(movie: &Path, progress: &Progress) -> Result<Self> {
        let parent = movie.parent().filter(|parent| !parent.as_os_str().is_empty());
        let folder = parent.unwrap_or(Path::new("."));
        let beside = Listing::present(folder);
        let lacks = [
            (beside.poses.is_empty(), "exemplars/ with each pose under each single lamp"),
            (
                beside.ball_movie.is_none() && !folder.join("probes").is_dir(),
                "probes.mov or probes/ with the mirror ball under each lamp",
            ),
        ];
        let lacks: Vec<&str> = lacks.into_iter().filter_map(|(lacks, what)| lacks.then_some(what)).collect();
        if !lacks.is_empty() {
            return Err(Error::missing(
                format!("{} alone is not a shoot; missing beside it: {}", movie.display(), lacks.join("; ")),
                "Add that to its folder, drop all files on the studio's page New project, or give files and frames in \
                 a TOML map: docs/movies.md has one to start from",
            ));
        }
        // A camera's folder has none.
        let manifest =
            if folder.join(super::shoot::MANIFEST).exists() { Manifest::read(folder)? } else { Manifest::default() };
        let listing = Listing::with_interview(folder, movie)?;
        Self::from_folder(folder, manifest, listing, progress)
    }

    fn from_folder(shoot: &Path, manifest: Manifest, mut listing: Listing, progress: &Progress) -> Result<Self> {
        let mut takes = std::mem::take(&mut listing.takes);
        let list = read_lamp_list(shoot)?;
        let known = (!listing.lamps.is_empty()).then_some(listing.lamps.len());
        let mut expected = known.or(list.as_ref().map(Vec::len)).or(manifest.olat_conditions);
        let mut names: Vec<String> = list.iter().flatten().map(|(name, _)| name.clone()).collect();
        let name_lamps = |listing: &mut Listing, count: usize| {
            if listing.lamps.is_empty() {
                listing.lamps = if names.len() == count { names.clone() } else { map::lamp_names(count) };
            }
        };
        if let Some(movie) = listing.ball_movie.clone() {
            let rounds = Rounds::from_movie(movie);
            let found = rounds.find(shoot, expected, &names, progress)?;
            expected = Some(found.0.lamps.len());
            name_lamps(&mut listing, found.0.lamps.len());
            takes.balls = Some(rounds.take(found, &listing.lamps));
        }
        if let Some(file) = &listing.interview_ball {
            takes.interview_ball = Some(map::still(shoot, file, None)?);
        }
        for (pose, movie) in listing.pose_movies.clone() {
            let rounds = Rounds::from_movie(movie);
            let found = rounds.find(shoot, expected, &names, progress)?;
            expected = Some(found.0.lamps.len());
            name_lamps(&mut listing, found.0.lamps.len());
            takes.poses.insert(pose, rounds.take(found, &listing.lamps));
        }
        let in_order: Vec<Vec3> = list.iter().flatten().map(|(_, direction)| *direction).collect();
        let by_name: HashMap<String, Vec3> = list.into_iter().flatten().collect();
        let mut directions: Option<Vec<Vec3>> = listing.lamps.iter().map(|lamp| by_name.get(lamp).copied()).collect();
        let is_other = !names.iter().any(|name| listing.lamps.contains(name));
        if listing.without_balls && is_other && in_order.len() == listing.lamps.len() {
            progress.say(format!(
                "The .lp list's names differ from the lamps': matched by order, from {} for {}",
                names[0], listing.lamps[0]
            ));
            names.clone_from(&listing.lamps);
            directions = Some(in_order);
        }
        let unknown = names.iter().find(|name| !listing.lamps.contains(name));
        let mut named = Vec::new();
        match (&directions, unknown) {
            (None, Some(unknown)) => progress.say(format!(
                "The names in the .lp list differ from the lamps' names; the list is not used. It has {unknown}, the \
                 pictures have {}",
                listing.lamps.first().map_or("none", String::as_str)
            )),
            (None, None) if !names.is_empty() => {
                progress.say(format!(
                    "The .lp list names {} of {} lamps: the network learns these, the calibration uses all",
                    names.len(),
                    listing.lamps.len()
                ));
                named = names;
            }
            _ => {}
        }
        Ok(Self {
            folder: shoot.to_path_buf(),
            said_in: shoot.join(super::shoot::MANIFEST),
            manifest,
            listing,
            takes,
            directions: directions.unwrap_or_default(),
            named,
        })
    }

    fn from_map(path: &Path, layer: Option<&str>, progress: &Progress) -> Result<Self> {
        let map = Map::read(path)?;
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let folder = parent.unwrap_or(Path::new("."));
        let folder = map.folder.as_ref().map_or(folder.to_path_buf(), |other| folder.join(other));
        picture::choose_layer(&folder, layer);
        let (mut lamps, directions) = map.lamps(&folder)?;
        let mut takes = Takes { interview_ball: map.interview_ball(&folder)?, ..Takes::default() };
        if let Some(balls) = map.balls() {
            let balls = balls.with_series(&folder, progress)?;
            let expected = (!lamps.is_empty()).then_some(lamps.len());
            let found = balls.find(&folder, expected, &lamps, progress)?;
            if lamps.is_empty() {
                lamps = map::lamp_names(found.0.lamps.len());
            }
            takes.balls = Some(balls.take(found, &lamps));
        }
        let without_balls = takes.balls.is_none();
        let mut poses = Vec::new();
        for (pose, rounds) in map.poses() {
            let rounds = rounds.with_series(&folder, progress)?;
            let found = rounds.find(&folder, Some(lamps.len()), &lamps, progress)?;
            takes.poses.insert(pose.clone(), rounds.take(found, &lamps));
            poses.push(pose.clone());
        }
        let (clip, frame_rate) = map.interview(&folder, progress)?;
        let probes = Probes {
            ball_center_px: map.ball.center_px,
            ball_radius_px: map.ball.radius_px,
            ball_radius_m: map.ball.radius_m,
            ball_position_m: None,
        };
        let camera = map.ball.camera_distance_m.map(|distance| Camera { position: [0.0, 0.0, distance] });
        let manifest = Manifest {
            name: map.name.or_else(|| Some(file_name(&path.with_extension("")))),
            frame_rate: map.frame_rate,
            damaged_frames: map.damaged_frames,
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
                without_balls,
                ..Listing::default()
            },
            takes,
            directions,
            named: Vec::new(),
        })
    }
}

/// Lamps of the `.lp` list in a shoot's folder; `None` without one.
/// Refuses a folder that lacks several parts, with all of them and the cost of each.
fn check_parts(shoot: &Path) -> Result<()> {
    let has = |name: &str| shoot.join(name).is_dir() || !matches!(movie_named(shoot, name, ""), Ok(None));
    let has_list = lamp_lists(shoot).is_ok_and(|lists| !lists.is_empty());
    let lacks = [
        (!has("interview"), "interview/ or interview.mov: nothing to relight"),
        (!has("exemplars"), "exemplars/ with each pose under each single lamp: the effect of the lamps is unknown"),
        (
            !has("probes") && !has_list,
            "probes/ with the mirror balls, or a list of the lamps (.lp): their directions are unknown",
        ),
    ];
    let lacks: Vec<&str> = lacks.into_iter().filter_map(|(lacks, part)| lacks.then_some(part)).collect();
    if lacks.len() < 2 || !shoot.is_dir() {
        return Ok(());
    }
    Err(Error::missing(
        format!("{} lacks {}", shoot.display(), lacks.join("; ")),
        "Choose the shoot's folder, or add these parts",
    ))
}

fn read_lamp_list(shoot: &Path) -> Result<Option<Vec<(String, Vec3)>>> {
    let lists = lamp_lists(shoot)?;
    match &lists[..] {
        [] => Ok(None),
        [name] => lamp_list::read(&shoot.join(name)).map(Some),
        _ => Err(several(shoot, "list of lamps", &lists, "Keep one of them in the shoot's folder")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_a_folder_lacks_is_listed_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let find = || match Parts::find(folder.path(), None, &Progress::silent()) {
            Err(e) => e.to_string(),
            Ok(_) => panic!("no shoot"),
        };
        let all = find();
        for part in ["interview/ or interview.mov", "exemplars/", "probes/", "(.lp)", "nothing to relight"] {
            assert!(all.contains(part), "{part}: {all}");
        }
        std::fs::create_dir(folder.path().join("interview")).unwrap();
        std::fs::write(folder.path().join("dome.lp"), "a 0 0 1\n").unwrap();
        // One part is named by its own reader.
        let one = find();
        assert!(one.contains("exemplars") && !one.contains("probes"), "{one}");
    }
}
