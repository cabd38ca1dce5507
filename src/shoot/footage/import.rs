//! Import: checks a shoot folder and makes a project that references it.

use super::framed::{dimensions, no_matte};
use super::framing::fitted;
use super::lamps::LampSettings;
use super::missing_olats::lacks;
use super::parts::Parts;
use super::shoot::{Listing, NO_SHOOT, contents, file_name};
use base::error::{Error, Result};
use base::progress::Progress;
use glam::Vec3;
use imaging::file;
use project::{
    self, Corrections, FORMAT, Frames, Framing, Framings, Matte, Picture, Project, Settings, Shoot, relative,
};
use rayon::prelude::*;
use std::ops::Range;
use std::path::Path;

/// Settings of an import.
#[derive(Clone, Debug, clap::Args)]
pub struct ImportSettings {
    /// Working size in pixels, a power of two.
    #[arg(long, default_value_t = 128)]
    pub size: usize,
    /// Seed of every random draw of the project.
    // The limit of integers in project.toml.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub seed: u64,
    /// Layer of the shoot's EXR files that have several [default: the finished picture].
    #[arg(long, value_name = "NAME")]
    pub layer: Option<String>,
}

/// Makes a project in folder `root` for the shoot in folder `shoot`. Reads every picture's header, copies nothing,
/// and stores the shoot's path relative to the project's.
///
/// # Errors
/// As [`plan_import`], and when `project.toml` cannot be written.
pub fn import(root: &Path, shoot: &Path, settings: &ImportSettings, progress: &Progress) -> Result<Project> {
    let project = plan_import(root, shoot, settings, &LampSettings::default(), progress)?;
    project.save()?;
    Ok(project)
}

/// Plans the project of [`import`] without saving it. Pictures that `corrected` leaves out are not read.
///
/// # Errors
/// When the manifest is invalid; a pose lacks half of the lamps; a probe or a matte is missing; pictures that
/// belong together differ in size; a file cannot be read; or the folder already holds a project. The error names
/// the file.
pub fn plan_import(
    root: &Path,
    shoot: &Path,
    settings: &ImportSettings,
    corrected: &LampSettings,
    progress: &Progress,
) -> Result<Project> {
    project::check_size(settings.size)?;
    let project_file = root.join("project.toml");
    if project_file.exists() {
        return Err(Error::invalid(
            format!("{} already exists", project_file.display()),
            "Choose another folder, or remove project.toml to import again",
        ));
    }
    let Parts { folder: shoot, said_in, manifest, listing, takes, directions, named } =
        Parts::find(shoot, settings.layer.as_deref(), progress)?;
    let shoot = &*shoot;
    listing.notes.iter().for_each(|note| progress.say(note));
    for (is_empty, folder, what) in [
        (listing.poses.is_empty(), "exemplars", "pose folder"),
        (listing.lamps.is_empty(), "exemplars", "OLAT in its pose folders"),
        (listing.frames.is_empty(), "interview", "frame"),
    ] {
        if is_empty {
            return Err(missing(&shoot.join(folder), what));
        }
    }
    manifest.check_counts(shoot, &listing)?;
    let corrections = Corrections { missing: listing.lacking(shoot), ..Corrections::default() };
    lacks(&corrections.missing).for_each(|note| progress.say(note));
    let Listing { poses, lamps, frames, frame_rate, without_balls, .. } = listing;
    let ball = manifest.ball();
    let said = manifest.frame_rate();
    let frame_rate = frame_rate.or(said).unwrap_or(24.0);
    // Rounded rates, such as 29.97, count as equal.
    if let Some(said) = said.filter(|said| (said / frame_rate - 1.0).abs() > 5e-4) {
        progress.say(format!(
            "{} gives {said} frames a second, but the interview's movie has {frame_rate:.3}. The movie's rate is used, also \
             for sound and time code",
            said_in.display()
        ));
    }
    let second_ball = manifest.second_ball(shoot);
    for ball in std::iter::once(&ball).chain(second_ball.as_ref().map(|second| &second.ball)) {
        ball.check().map_err(|e| e.within(&said_in))?;
    }
    // Without the ball's size, distances in metres are useless.
    let dome_radius_m = manifest.dome_radius_m.filter(|_| !ball.is_far());
    if without_balls {
        progress.say(WITHOUT_BALLS);
    } else if ball.is_far() {
        progress.say(FAR);
    }
    if !ball.has_circle() && !without_balls {
        progress.advise(
            "The manifest does not give the mirror ball's position in its photographs. Calibrating finds it; check the circle \
             in the workspace Calibrate",
            "afterlight calibrate PROJECT",
        );
    }
    let lamp_layout = manifest.bank_directions.map_or(directions, |directions| {
        let layout = layout(directions, &lamps);
        if layout.is_empty() {
            progress.say(format!(
                "The manifest's `bank_directions` must hold {} directions, one per lamp; the lamps \
                     will not be checked against them",
                lamps.len()
            ));
        }
        layout
    });
    if without_balls && lamp_layout.is_empty() {
        return Err(Error::missing(
            format!(
                "{} has no mirror balls, and its list of lamps (.lp) does not name all {} lamps of the poses",
                shoot.display(),
                lamps.len()
            ),
            "Name each lamp of exemplars/POSE in the list, or add probes/ with the mirror balls",
        ));
    }
    std::fs::create_dir_all(root)
        .map_err(|e| Error::io("make", root, e, "Check that the folder above can be written"))?;
    if let Frames::Clip(clip) = &frames {
        for note in movies::open(&shoot.join(&clip.movie))?.notes() {
            progress.say(format!("Interview: {note}"));
        }
    }
    let mut project = Project {
        root: root.to_path_buf(),
        results: None,
        settings: Settings {
            format: FORMAT,
            name: manifest.name.unwrap_or_else(|| file_name(shoot)),
            size: settings.size,
            seed: settings.seed,
            shoot: Shoot {
                folder: relative(root, shoot)?,
                frame_rate,
                poses,
                lamps,
                other_lamps: vec![],
                frames,
                damaged_frames: manifest.damaged_frames,
                takes,
                ball,
                second_ball,
                dome_radius_m,
                environments: manifest.hdris,
                lamp_layout,
                without_balls,
                layer: settings.layer.clone(),
                corrections,
            },
            environments: Vec::new(),
            color_config: None,
            framing: Framings::default(),
        },
    };
    project.choose_layer();
    let shoot = &project.settings.shoot;
    shoot.check().map_err(|e| e.within(&said_in))?;
    corrected.run(&mut project)?;
    let sizes = check_pictures(&project, progress)?;
    super::left_out::notes(&project).into_iter().for_each(|note| progress.say(note));
    for doubt in super::uniform::doubts(&project) {
        progress.advise(
            format!(
                "{doubt}. Replace the mattes, or remove them and make new ones; if a movie's alpha is uniform, \
                 import without it"
            ),
            "afterlight matte PROJECT",
        );
    }
    frame_subject(&mut project, sizes, progress);
    if !named.is_empty() {
        let shoot = &mut project.settings.shoot;
        let is_named = |&lamp: &usize| named.contains(shoot.lamp(lamp));
        let learnt: Vec<usize> = (0..shoot.lamps.len()).filter(is_named).collect();
        shoot.learn(&learnt);
    }
    Ok(project)
}

/// Crops pictures that are not square to the largest centred square, or to one around the subject if that square
/// cuts it. Reports the crop.
fn frame_subject(project: &mut Project, sizes: [(usize, usize); 2], progress: &Progress) {
    if sizes.iter().all(|(width, height)| width == height) {
        return;
    }
    // Mattes may come later.
    let fitted = fitted(project, sizes).unwrap_or_default();
    for fitted in fitted.into_iter().filter(|fitted| !fitted.is_central) {
        project.settings.framing.set(fitted.framing);
    }
    for (what, (width, height)) in [("frames", sizes[0]), ("poses", sizes[1])] {
        let framing = project.settings.framing.for_size((width, height));
        let square = if framing == Framing::largest((width, height)) {
            "The network sees the largest square in their middle".to_owned()
        } else {
            format!("The network sees the {} pixels from {}, {} around the subject", framing.side, framing.x, framing.y)
        };
        if width != height {
            progress.advise(
                format!("The {what} have {width} × {height} pixels. {square}; this can be changed"),
                "afterlight frame PROJECT",
            );
        }
    }
}

/// Reads the header of every picture: all must exist, be readable and have one size within each group. For a movie
/// only the first frame is read. Mattes may all be missing, but not some of them. Returns the size of frames and of
/// exemplars.
fn check_pictures(project: &Project, progress: &Progress) -> Result<[(usize, usize); 2]> {
    let shoot = &project.settings.shoot;
    let group = |what: &'static str, pictures: Vec<Picture>| -> Result<(usize, usize)> {
        progress.check("no project was made")?;
        progress.step(what, 0, pictures.len() as u64, "");
        let sizes = pictures.par_iter().map(dimensions).collect::<Result<Vec<_>>>()?;
        let size = sizes[0];
        if let Some(other) = sizes.iter().position(|s| *s != size) {
            return Err(differs((&pictures[other], sizes[other]), (&pictures[0], size)));
        }
        progress.step(what, pictures.len() as u64, pictures.len() as u64, "");
        Ok(size)
    };
    let mattes = |folder: &str, mattes: Vec<Matte>, picture: (&Picture, (usize, usize))| {
        let is_none = |matte: &Matte| !matte.file().exists();
        if !project.shoot_path(folder).exists() && mattes.iter().any(is_none) {
            progress.advise(
                format!("The shoot has no {folder}/. Make the mattes before you calibrate and train"),
                "afterlight matte PROJECT",
            );
            return Ok(());
        }
        if let Some(missing) = mattes.iter().find(|matte| is_none(matte)) {
            return Err(no_matte(missing.file()));
        }
        let matte_pictures: Vec<_> = mattes.iter().map(|matte| matte.picture().clone()).collect();
        let first = matte_pictures[0].clone();
        let size = group("checking mattes", matte_pictures)?;
        if size == picture.1 {
            return Ok(());
        }
        Err(differs((&first, size), picture))
    };
    let poses = 0..shoot.poses.len();
    let olats = poses.clone().flat_map(|p| project.pose_lamps(p).into_iter().map(move |l| (p, l)));
    let olats = olats.map(|(p, l)| project.olat_picture(p, l)).collect();
    let olat_size = group("checking OLATs", olats)?;
    mattes("exemplar_masks", poses.map(|p| project.exemplar_matte(p)).collect(), (&project.first_olat(0), olat_size))?;
    // A long movie has a million frames of one size.
    let frames = match &shoot.frames {
        Frames::Named(names) => 0..names.len(),
        Frames::Clip(_) => 0..1,
    };
    let frames = readable(project, frames, progress);
    if frames.is_empty() {
        return dimensions(&project.frame_picture(0)).map(|size| [size; 2]);
    }
    let pictures = frames.iter().map(|&f| project.frame_picture(f)).collect();
    let frame_size = group("checking frames", pictures).map_err(|e| or_go_on(project, e))?;
    mattes(
        "interview_masks",
        frames.iter().map(|&f| project.frame_matte(f)).collect(),
        (&project.frame_picture(0), frame_size),
    )?;
    if let Matte::Grey(Picture::Movie { file, .. }) = project.frame_matte(0) {
        let count = movies::open(&file)?.count()?;
        if count != shoot.frames.len() as u64 {
            return Err(Error::invalid(
                format!("{} holds {count} mattes for {} interview frames", file.display(), shoot.frames.len()),
                (
                    "Provide one matte per frame, or remove the folder to let Afterlight do so",
                    "afterlight matte PROJECT",
                ),
            ));
        }
    }
    if frame_size != olat_size {
        progress.advise(
            "Frames and poses differ in size. Crop both so that the subject has the same size",
            "afterlight frame PROJECT",
        );
    }
    if !shoot.without_balls {
        group("checking probes", project.probe_pictures())?;
    }
    if let Some(second) = &shoot.second_ball {
        let lamps = (0..shoot.lamps.len()).map(|l| project.second_probe_picture(second, l));
        group("checking probes", lamps.collect())?;
    }
    for environment in &shoot.environments {
        let path = project.shoot_path(&environment.file);
        if let Err(e) = file::dimensions(&path) {
            let said = format!("The environment {} cannot be used: {e}", environment.name);
            progress.report(said, &e);
        }
    }
    Ok([frame_size, olat_size])
}

/// Frames with readable headers; all frames if the project stops at damaged ones.
fn readable(project: &Project, frames: Range<usize>, progress: &Progress) -> Vec<usize> {
    if project.settings.shoot.damaged_frames.is_stop() {
        return frames.collect();
    }
    let is_readable = |frame: &usize| match dimensions(&project.frame_picture(*frame)) {
        Ok(_) => true,
        Err(error) => {
            progress.report(format!("Frame {frame} cannot be read: {error}"), &error);
            false
        }
    };
    frames.into_par_iter().filter(is_readable).collect()
}

/// Adds a remedy to the error of an unreadable frame if others are readable.
fn or_go_on(project: &Project, error: Error) -> Error {
    let is_one = matches!(error, Error::Codec { .. } | Error::Io { .. });
    let all = [0, project.settings.shoot.frames.len() - 1];
    let mut others = all.map(|frame| dimensions(&project.frame_picture(frame))).into_iter();
    if !is_one || !others.any(|size| size.is_ok()) {
        return error;
    }
    error.with_note(
        "or continue without this frame: write `\"damaged_frames\": \"hold\"` into the manifest to show the previous frame in its \
         place, or `\"black\"` to show black",
    )
}

/// Effect of unknown sizes. A ray treated as parallel is off by its angle to the optical axis, at most the ball's
/// radius over the distance. A lamp is seen from the ball's surface instead of its centre.
const FAR: &str = "The manifest lacks the ball's radius and the camera's position in metres, so the camera and \
                   the lamps count as far away. Lamp directions are then off by up to 57° divided by the camera's \
                   distance in ball radii (1.1° at 50), most near the ball's rim, and likewise for the lamps' \
                   distance. Give `camera.position` and `probes.ball_radius_m` in the manifest to avoid that";

/// Effect of missing mirror balls.
const WITHOUT_BALLS: &str = "No mirror balls: the lamps' directions are those of the list. Calibration finds their energies and the \
                             interview's light from the subject, and the camera's response only if a frame shows a pose: \
                             otherwise give it with --gamma. Backgrounds and the subject may differ in brightness";

fn differs((picture, size): (&Picture, (usize, usize)), (reference, expected): (&Picture, (usize, usize))) -> Error {
    Error::other_size(
        (picture.display(), size),
        (reference.display(), expected),
        "Resize the pictures of the shoot to one size",
    )
}

fn missing(folder: &Path, what: &str) -> Error {
    let problem = format!("{} holds no {what}: it {}", folder.display(), contents(folder));
    Error::missing(problem, NO_SHOOT)
}

/// Lamp directions from the manifest, in the order of the OLATs' numbers (names without leading zeros sort
/// differently). Empty if they do not match the lamps.
fn layout(directions: serde_json::Value, lamps: &[String]) -> Vec<Vec3> {
    let number = |name: &String| -> Option<u64> {
        let digits = name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        name[digits..].parse().ok()
    };
    let directions: Vec<Vec3> = serde_json::from_value(directions).unwrap_or_default();
    let unit: Vec<Vec3> = directions.iter().filter_map(|d| d.try_normalize()).collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamps_are_matched_with_a_list_by_name_and_a_list_of_some_names_those_to_learn() {
        let folder = tempfile::tempdir().unwrap();
        let shoot = folder.path().join("shoot");
        let stage =
            virtual_stage::StageSettings { frames: 1, size: 16, lamps: 4, ..virtual_stage::StageSettings::default() };
        let silent = Progress::silent();
        virtual_stage::write_shoot(&shoot, &stage, &silent).unwrap();
        // The manifest's own directions count more than a list's.
        let manifest = shoot.join("manifest.json");
        let text = std::fs::read_to_string(&manifest).unwrap();
        let mut facts: serde_json::Value = serde_json::from_str(&text).unwrap();
        facts.as_object_mut().unwrap().remove("bank_directions");
        let wide = format!("\u{feff}{facts}");
        let wide: Vec<u8> = wide.encode_utf16().flat_map(u16::to_le_bytes).collect();
        std::fs::write(&manifest, wide).unwrap();
        let list = shoot.join("dome.lp");
        let settings = ImportSettings { size: 16, seed: 1, layer: None };
        for (text, lamps, others, layout) in [
            (
                "name;x;y;z\rolat_03.jpg;0;0,6;0,8\rolat_01;1;0;0\rolat_00;0;1;0\rolat_02;0;0;1\r",
                &["olat_00", "olat_01", "olat_02", "olat_03"][..],
                &[][..],
                &[Vec3::Y, Vec3::X, Vec3::Z, Vec3::new(0.0, 0.6, 0.8)][..],
            ),
            ("2\nolat_03.jpg 1 0 0\nolat_01.jpg 0 1 0\n", &["olat_01", "olat_03"], &["olat_00", "olat_02"], &[]),
            // Names of other pictures.
            ("2\nkey.jpg 1 0 0\nolat_01.jpg 0 1 0\n", &["olat_00", "olat_01", "olat_02", "olat_03"], &[], &[]),
        ] {
            std::fs::write(&list, text).unwrap();
            let root = folder.path().join("project");
            let all = LampSettings::default();
            let planned = plan_import(&root, &shoot, &settings, &all, &silent).unwrap();
            let shoot = planned.settings.shoot;
            assert_eq!(shoot.lamps, lamps, "{text:?}");
            assert_eq!(shoot.other_lamps, others, "{text:?}");
            assert_eq!(shoot.lamp_layout.len(), layout.len(), "{text:?}");
            for (found, wanted) in shoot.lamp_layout.iter().zip(layout) {
                assert!(found.distance(*wanted) < 1e-6, "{text:?}: {found}");
            }
        }
    }

    #[test]
    fn a_layout_follows_the_numbers_of_the_lamps() {
        let names = |names: [&str; 3]| names.map(str::to_owned);
        let directions = serde_json::json!([[1, 0, 0], [0, 2, 0], [0, 0, 1]]);
        let unpadded = layout(directions.clone(), &names(["olat_1", "olat_10", "olat_2"]));
        assert_eq!(unpadded, [Vec3::X, Vec3::Z, Vec3::Y]);
        let padded = layout(directions.clone(), &names(["olat_01", "olat_02", "olat_10"]));
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
}
