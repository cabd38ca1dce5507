//! Import: find out what a shoot folder holds, check it, and make a project that points at it.

use crate::error::{Error, Result};
use crate::imaging::file::dimensions;
use crate::progress::Progress;
use crate::project::{self, Ball, FORMAT, NamedEnvironment, Project, Settings, Shoot};
use glam::Vec3;
use rayon::prelude::*;
use serde::Deserialize;
use std::path::{Component, Path, PathBuf};

/// What a person chooses at import.
#[derive(Clone, Debug)]
pub struct ImportSettings {
    /// Working size, a power of two.
    pub size: usize,
    /// Seed of every random draw of the project.
    pub seed: u64,
}

/// The part of a shoot's `manifest.json` that no picture can tell.
#[derive(Deserialize)]
struct Manifest {
    #[serde(default)]
    name: Option<String>,
    #[serde(default)]
    frame_rate: Option<f64>,
    camera: Camera,
    #[serde(default)]
    dome_radius_m: Option<f32>,
    probes: Probes,
    #[serde(default)]
    hdris: Vec<NamedEnvironment>,
    /// Directions from the subject to the lamps, in the order of the OLATs' numbers. Any value, because a
    /// shoot that says it otherwise can be imported all the same.
    #[serde(default)]
    bank_directions: Option<serde_json::Value>,
    #[serde(default)]
    exemplar_poses: Option<usize>,
    #[serde(default)]
    olat_conditions: Option<usize>,
    #[serde(default)]
    frames: Option<usize>,
}

#[derive(Deserialize)]
struct Camera {
    position: [f32; 3],
}

#[derive(Deserialize)]
struct Probes {
    ball_center_px: [f32; 2],
    ball_radius_px: f32,
    ball_radius_m: f32,
}

/// Makes a project in folder `root` for the shoot in folder `shoot`. Reads every picture's header,
/// copies nothing, and stores the shoot's place relative to the project's.
///
/// # Errors
/// When the manifest is not understood; a pose lacks a lamp that others have; a probe or a matte is
/// missing; pictures that belong together differ in size; a file cannot be read; or there is a
/// project already. The error names the file.
pub fn import(
    root: &Path,
    shoot: &Path,
    settings: &ImportSettings,
    progress: &Progress,
) -> Result<Project> {
    project::check_size(settings.size)?;
    let manifest_path = shoot.join("manifest.json");
    let text = std::fs::read_to_string(&manifest_path).map_err(|e| {
        Error::file(
            "open",
            &manifest_path,
            e,
            "Name the folder that holds a shoot's manifest.json",
        )
    })?;
    let manifest: Manifest = serde_json::from_str(&text).map_err(|e| {
        Error::file(
            "read",
            &manifest_path,
            e,
            "Mend the manifest; `afterlight stage` writes an example",
        )
    })?;
    let project_file = root.join("project.toml");
    if project_file.exists() {
        return Err(Error::unexpected(
            project_file.display(),
            "no project there yet",
            "one",
            "Choose another folder, or remove project.toml to import again",
        ));
    }
    let poses = entries(&shoot.join("exemplars"), |path| {
        path.is_dir().then(|| name_of(path))
    })?;
    if poses.is_empty() {
        return Err(missing(
            &shoot.join("exemplars"),
            "at least one pose folder",
        ));
    }
    // A lamp that any pose or probe has is a lamp: where it lacks, reading it names the file.
    let mut lamps = std::collections::BTreeSet::new();
    for pose in &poses {
        lamps.extend(png_names(&shoot.join("exemplars").join(pose))?);
    }
    lamps.extend(
        png_names(&shoot.join("probes"))?
            .into_iter()
            .filter(|name| name != "interview"),
    );
    let lamps: Vec<String> = lamps.into_iter().collect();
    let frames = png_names(&shoot.join("interview"))?;
    check_count(
        &manifest_path,
        "exemplar_poses",
        manifest.exemplar_poses,
        poses.len(),
    )?;
    check_count(
        &manifest_path,
        "olat_conditions",
        manifest.olat_conditions,
        lamps.len(),
    )?;
    check_count(&manifest_path, "frames", manifest.frames, frames.len())?;
    if lamps.is_empty() {
        return Err(missing(
            &shoot.join("exemplars"),
            "at least one OLAT as PNG",
        ));
    }
    if frames.is_empty() {
        return Err(missing(
            &shoot.join("interview"),
            "at least one frame as PNG",
        ));
    }
    let [x, y, z] = manifest.camera.position;
    let ball = Ball {
        center_px: manifest.probes.ball_center_px,
        radius_px: manifest.probes.ball_radius_px,
        radius_m: manifest.probes.ball_radius_m,
        camera_distance_m: (x * x + y * y + z * z).sqrt(),
    };
    check_ball(&manifest_path, &ball)?;
    let lamp_layout = manifest
        .bank_directions
        .map_or_else(Vec::new, |directions| {
            let layout = layout(directions, &lamps);
            if layout.is_empty() {
                progress.say(format!(
                    "The manifest's `bank_directions` are not {} directions, one for each lamp: the lamps \
                     will not be checked against them",
                    lamps.len()
                ));
            }
            layout
        });
    std::fs::create_dir_all(root).map_err(|e| {
        Error::file(
            "make",
            root,
            e,
            "Check that the folder above can be written",
        )
    })?;
    let project = Project {
        root: root.to_path_buf(),
        settings: Settings {
            format: FORMAT,
            name: manifest.name.unwrap_or_else(|| name_of(shoot)),
            size: settings.size,
            seed: settings.seed,
            shoot: Shoot {
                folder: relative(root, shoot)?,
                frame_rate: manifest
                    .frame_rate
                    .filter(|r| *r > 0.0 && r.is_finite())
                    .unwrap_or(24.0),
                poses,
                lamps,
                other_lamps: vec![],
                frames,
                ball,
                dome_radius_m: manifest.dome_radius_m,
                environments: manifest.hdris,
                lamp_layout,
            },
            environments: Vec::new(),
        },
    };
    check_pictures(&project, progress)?;
    project.save()?;
    Ok(project)
}

/// Reads the header of every picture: all there, all readable, sizes alike within each group.
fn check_pictures(project: &Project, progress: &Progress) -> Result<()> {
    let shoot = &project.settings.shoot;
    let group = |what: &'static str, paths: Vec<PathBuf>| -> Result<(usize, usize)> {
        progress.check("no project was made")?;
        progress.step(what, 0, paths.len() as u64, "");
        let sizes = paths
            .par_iter()
            .map(|p| dimensions(p))
            .collect::<Result<Vec<_>>>()?;
        let size = sizes[0];
        if let Some(other) = sizes.iter().position(|s| *s != size) {
            return Err(differs(&paths[other], sizes[other], &paths[0], size));
        }
        progress.step(what, paths.len() as u64, paths.len() as u64, "");
        Ok(size)
    };
    let poses = 0..shoot.poses.len();
    let olats = poses
        .clone()
        .flat_map(|p| (0..shoot.lamps.len()).map(move |l| (p, l)));
    let olat_size = group(
        "checking OLATs",
        olats.map(|(p, l)| project.olat_path(p, l)).collect(),
    )?;
    let masks: Vec<_> = poses.map(|p| project.exemplar_mask_path(p)).collect();
    let mask_size = group("checking mattes", masks.clone())?;
    same_size(&masks[0], mask_size, &project.olat_path(0, 0), olat_size)?;
    let frame_paths: Vec<_> = (0..shoot.frames.len())
        .map(|f| project.frame_path(f))
        .collect();
    let frame_size = group("checking frames", frame_paths.clone())?;
    let masks: Vec<_> = (0..shoot.frames.len())
        .map(|f| project.frame_mask_path(f))
        .collect();
    let mask_size = group("checking mattes", masks.clone())?;
    same_size(&masks[0], mask_size, &frame_paths[0], frame_size)?;
    same_size(
        &frame_paths[0],
        frame_size,
        &project.olat_path(0, 0),
        olat_size,
    )?;
    if frame_size.0 != frame_size.1 {
        return Err(Error::unexpected(
            frame_paths[0].display(),
            "square pictures",
            format!("{} × {}", frame_size.0, frame_size.1),
            "Crop and pad the footage to squares first",
        ));
    }
    let mut probes = vec![project.interview_probe_path()];
    probes.extend((0..shoot.lamps.len()).map(|l| project.lamp_probe_path(l)));
    group("checking probes", probes)?;
    for environment in &shoot.environments {
        let path = project.shoot_path(&environment.file);
        if let Err(e) = dimensions(&path) {
            progress.say(format!(
                "The environment {} cannot be used: {e}",
                environment.name
            ));
        }
    }
    Ok(())
}

fn check_ball(manifest: &Path, ball: &Ball) -> Result<()> {
    let positive = [ball.radius_px, ball.radius_m, ball.camera_distance_m]
        .iter()
        .all(|v| *v > 0.0 && v.is_finite());
    if positive
        && ball.camera_distance_m > ball.radius_m
        && ball.center_px.iter().all(|v| v.is_finite())
    {
        return Ok(());
    }
    Err(Error::unexpected(
        manifest.display(),
        "a ball of positive size, nearer to the origin than the camera",
        format!("{ball:?}"),
        "Mend `probes` and `camera` in the manifest",
    ))
}

fn check_count(manifest: &Path, key: &str, said: Option<usize>, found: usize) -> Result<()> {
    match said {
        Some(said) if said != found => Err(Error::unexpected(
            manifest.display(),
            format!("{said} as `{key}` says"),
            format!("{found} in the folder"),
            "Bring the missing pictures, or mend the manifest",
        )),
        _ => Ok(()),
    }
}

fn same_size(a: &Path, a_size: (usize, usize), b: &Path, b_size: (usize, usize)) -> Result<()> {
    if a_size == b_size {
        Ok(())
    } else {
        Err(differs(a, a_size, b, b_size))
    }
}

fn differs(path: &Path, size: (usize, usize), reference: &Path, expected: (usize, usize)) -> Error {
    Error::unexpected(
        path.display(),
        format!(
            "{} × {} pixels like {}",
            expected.0,
            expected.1,
            reference.display()
        ),
        format!("{} × {}", size.0, size.1),
        "Bring all pictures of the shoot to one size",
    )
}

fn missing(folder: &Path, what: &str) -> Error {
    Error::unexpected(
        folder.display(),
        what,
        "none",
        "Check that this is a shoot folder and is complete",
    )
}

/// Where each lamp is by the manifest: its directions are in the order of the OLATs' numbers, which is
/// not that of names without leading zeros. Empty where it does not fit the lamps.
fn layout(directions: serde_json::Value, lamps: &[String]) -> Vec<Vec3> {
    let number = |name: &String| -> Option<u64> {
        let digits = name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        name[digits..].parse().ok()
    };
    let directions: Vec<Vec3> = serde_json::from_value(directions).unwrap_or_default();
    let unit: Vec<Vec3> = directions
        .iter()
        .filter_map(|d| d.try_normalize())
        .collect();
    if unit.len() != directions.len() || unit.len() != lamps.len() {
        return vec![];
    }
    let mut order: Vec<usize> = (0..lamps.len()).collect();
    if lamps.iter().all(|name| number(name).is_some()) {
        order.sort_by_key(|&lamp| number(&lamps[lamp]));
    }
    let mut layout = unit.clone();
    for (lamp, direction) in order.into_iter().zip(unit) {
        layout[lamp] = direction;
    }
    layout
}

/// Names that `pick` takes from a folder's entries, sorted.
fn entries(folder: &Path, pick: impl Fn(&Path) -> Option<String>) -> Result<Vec<String>> {
    let listing = std::fs::read_dir(folder).map_err(|e| {
        Error::file(
            "open",
            folder,
            e,
            "Check that this is a shoot folder and is complete",
        )
    })?;
    let mut names: Vec<String> = listing
        .flatten()
        .filter_map(|entry| pick(&entry.path()))
        .collect();
    names.sort();
    Ok(names)
}

fn png_names(folder: &Path) -> Result<Vec<String>> {
    entries(folder, |path| {
        let png = path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("png"));
        (png && !name_of(path).starts_with('.'))
            .then(|| path.with_extension(""))
            .map(|p| name_of(&p))
    })
}

fn name_of(path: &Path) -> String {
    path.file_name()
        .map_or_else(|| "shoot".to_owned(), |n| n.to_string_lossy().into_owned())
}

/// The way from folder `from` to folder `to`, both existing.
fn relative(from: &Path, to: &Path) -> Result<PathBuf> {
    let full = |p: &Path| {
        p.canonicalize()
            .map_err(|e| Error::file("open", p, e, "Check that the folder is there"))
    };
    let (from, to) = (full(from)?, full(to)?);
    let shared = from
        .components()
        .zip(to.components())
        .take_while(|(a, b)| a == b)
        .count();
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    Ok(up.chain(to.components().skip(shared)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layout_follows_the_numbers_of_the_lamps() {
        let names = |names: [&str; 3]| names.map(str::to_owned);
        let directions = serde_json::json!([[1, 0, 0], [0, 2, 0], [0, 0, 1]]);
        let unpadded = layout(directions.clone(), &names(["olat_1", "olat_10", "olat_2"]));
        assert_eq!(unpadded, [Vec3::X, Vec3::Z, Vec3::Y]);
        let padded = layout(
            directions.clone(),
            &names(["olat_01", "olat_02", "olat_10"]),
        );
        assert_eq!(padded, [Vec3::X, Vec3::Y, Vec3::Z]);
        let words = layout(directions, &names(["back", "key", "rim"]));
        assert_eq!(words, [Vec3::X, Vec3::Y, Vec3::Z]);
    }

    #[test]
    fn a_layout_that_does_not_fit_the_lamps_is_left_out() {
        let lamps = ["olat_0", "olat_1"].map(str::to_owned);
        for directions in [
            serde_json::json!([[1, 0, 0]]),
            serde_json::json!([[1, 0, 0], [0, 0, 0]]),
            serde_json::json!([[1, 0, 0], [0, 1]]),
            serde_json::json!({"key": [1, 0, 0]}),
            serde_json::Value::Null,
        ] {
            assert!(layout(directions, &lamps).is_empty());
        }
    }

    #[test]
    fn the_way_between_folders_is_relative() {
        let base = tempfile::tempdir().unwrap();
        let (a, b) = (base.path().join("films/a"), base.path().join("shoots/b"));
        std::fs::create_dir_all(&a).unwrap();
        std::fs::create_dir_all(&b).unwrap();
        assert_eq!(relative(&a, &b).unwrap(), Path::new("../../shoots/b"));
    }
}
