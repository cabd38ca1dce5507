//! Shoots with movies, compared with the same shoot as files.

use crate::{BehindReader, Exemplar, Frame, ImportSettings, TrackingFrames, import, picture_behind, read_picture};
use base::progress::Progress;
use imaging::{Image, Response};
use movies::Source;
use project::{Picture, Project};
use std::path::{Path, PathBuf};
use std::process::Command;
use test_support::shown;
use virtual_stage::{StageSettings, TroubleSettings, WrittenAs, write_shoot};

const SETTINGS: ImportSettings = ImportSettings { size: 16, seed: 1, layer: None };
const LAMPS: usize = 6;
/// ffmpeg converts RGB through luma and chroma, exact to an eighth of an 8-bit code; linear light is up to 2.3
/// times as steep.
const NEAR: f32 = 2.3 / 8.0 / 255.0;

/// A shoot of six poses, six lamps, three tracking frames per pose and three frames.
fn stage(folder: &Path) {
    let stage = StageSettings {
        frames: 3,
        size: 32,
        lamps: LAMPS,
        trouble: TroubleSettings { tracking: Some(3), ..TroubleSettings::default() },
        ..StageSettings::default()
    };
    write_shoot(folder, &stage, &Progress::silent()).unwrap();
}

/// Makes a lossless movie of pictures.
fn film(pictures: &[PathBuf], movie: &Path) {
    let folder = tempfile::tempdir().unwrap();
    for (i, picture) in pictures.iter().enumerate() {
        std::fs::copy(picture, folder.path().join(format!("{i:04}.png"))).unwrap();
    }
    let status = Command::new("ffmpeg")
        .args(["-v", "error", "-y", "-framerate", "24", "-i"])
        .arg(folder.path().join("%04d.png"))
        .args(["-c:v", "ffv1", "-pix_fmt", "gbrp"])
        .arg(movie)
        .status();
    assert!(status.unwrap().success());
}

#[test]
fn a_movie_behind_an_interview_keeps_its_rate_and_repeats() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    stage(&at.join("shoot"));
    let movie = at.join("street.mkv");
    film(&interview(&at.join("shoot")), &movie);
    let behind = |frame, rate| picture_behind(&movie, frame, rate).unwrap();
    let shown = |frame| Picture::Movie { file: movie.clone(), frame };
    // Its three frames at 24 a second, behind interviews of 48, 24 and 12 frames a second.
    assert_eq!([0, 1, 2, 5, 6].map(|frame| behind(frame, 48.0)), [0, 0, 1, 2, 0].map(shown));
    assert_eq!([0, 1, 2, 3].map(|frame| behind(frame, 24.0)), [0, 1, 2, 0].map(shown));
    assert_eq!([0, 1, 2].map(|frame| behind(frame, 12.0)), [0, 2, 1].map(shown));
    let (_, light) = BehindReader::default().read(&movie, 1, 24.0).unwrap();
    let filmed = Response::Srgb.decode(&read_picture(&shown(1)).unwrap());
    assert_eq!(*light, filmed);
}

/// A filmed pose: fully lit, half of the lamps, fully lit, the other half, fully lit.
fn round(shoot: &Path, pose: usize) -> Vec<PathBuf> {
    let lit = |k: usize| shoot.join(format!("tracking/pose{pose:02}/frame_{k:02}.png"));
    let olat = |lamp: usize| shoot.join(format!("exemplars/pose{pose:02}/olat_{lamp:02}.png"));
    let half = |lamps: std::ops::Range<usize>| lamps.map(olat).collect::<Vec<_>>();
    let parts = [vec![lit(0)], half(0..3), vec![lit(1)], half(3..6), vec![lit(2)]];
    parts.concat()
}

fn balls(shoot: &Path) -> Vec<PathBuf> {
    (0..LAMPS).map(|lamp| shoot.join(format!("probes/olat_{lamp:02}.png"))).collect()
}

fn interview(shoot: &Path) -> Vec<PathBuf> {
    (0..3).map(|frame| shoot.join(format!("interview/frame_{frame:03}.png"))).collect()
}

/// Asserts equal frames and OLATs of two projects.
fn compare(files: &Project, movies: &Project) {
    let near = |a: &Image, b: &Image| {
        let off = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
        off.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) < NEAR
    };
    for frame in 0..3 {
        let [a, b] = [files, movies].map(|p| Frame::load(p, &Response::Srgb, frame).unwrap());
        assert!(near(&a.plate, &b.plate) && a.mask == b.mask, "frame {frame}");
    }
    for pose in 0..movies.settings.shoot.poses.len() {
        let [a, b] = [files, movies].map(|p| Exemplar::load(p, &Response::Srgb, pose).unwrap());
        assert!(a.olats.iter().zip(&b.olats).all(|(a, b)| near(a, b)), "pose {pose}");
        let [a, b] = [files, movies].map(|p| TrackingFrames::new(p, pose).unwrap().unwrap());
        assert_eq!((a.times.len(), b.times), (3, vec![0.0, 0.5, 1.0]));
        let seen = |pictures: &[Picture]| read_picture(&pictures[1]).unwrap().0;
        assert!(near(&seen(&a.pictures), &seen(&b.pictures)));
    }
    let [a, b] =
        [files, movies].map(|p| p.probe_pictures().iter().map(|p| read_picture(p).unwrap().0).collect::<Vec<_>>());
    assert_eq!(a.len(), b.len());
    assert!(a.iter().zip(&b).all(|(a, b)| near(a, b)));
}

/// Adds mattes to the shoot's folder or, as `afterlight matte` does, to the project's.
fn give_mattes(shoot: &Path, project: &Project) {
    for frame in 0..3 {
        let to = project.frame_matte_path(frame);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(shoot.join(format!("interview_masks/frame_{frame:03}.png")), to).unwrap();
    }
    for pose in 0..project.settings.shoot.poses.len() {
        let to = project.exemplar_matte_path(pose);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(shoot.join(format!("exemplar_masks/pose{pose:02}.png")), to).unwrap();
    }
}

#[test]
fn a_shoot_of_movies_is_the_shoot_of_its_files() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (shoot, filmed) = (folder.path().join("shoot"), folder.path().join("filmed"));
    let silent = Progress::silent();
    stage(&shoot);
    let files = import(&folder.path().join("files"), &shoot, &SETTINGS, &silent).unwrap();
    std::fs::create_dir_all(filmed.join("exemplars")).unwrap();
    std::fs::create_dir_all(filmed.join("probes")).unwrap();
    film(&interview(&shoot), &filmed.join("interview.mkv"));
    for pose in 0..6 {
        film(&round(&shoot, pose), &filmed.join(format!("exemplars/pose{pose:02}.mkv")));
    }
    film(&balls(&shoot), &filmed.join("probes.mkv"));
    for name in ["manifest.json", "probes/interview.png"] {
        std::fs::copy(shoot.join(name), filmed.join(name)).unwrap();
    }
    assert!(crate::scan::scan(&filmed, None).is_complete(), "{:?}", crate::scan::scan(&filmed, None));
    let root = folder.path().join("movies");
    let movies = import(&root, &filmed, &SETTINGS, &silent).unwrap();
    let said = Frame::load(&movies, &Response::Srgb, 0).unwrap_err().for_terminal();
    assert!(said.contains("afterlight matte") && said.contains("frame_000000.png"), "{said}");
    give_mattes(&shoot, &movies);
    compare(&files, &movies);
    assert_eq!(Project::open(&root).unwrap(), movies);
    let text = std::fs::read_to_string(root.join("project.toml")).unwrap();
    assert!(!text.contains("frame_00"), "frames of a movie have no names there: {text}");
    // One movie lacks a lamp.
    let short: Vec<PathBuf> = round(&shoot, 1).into_iter().skip(2).collect();
    film(&short, &filmed.join("exemplars/pose01.mkv"));
    let again = folder.path().join("again");
    let _ = movies::open(&filmed.join("exemplars/pose01.mkv"));
    let said = import(&again, &filmed, &SETTINGS, &silent).unwrap_err().to_string();
    assert!(said.contains("pose01.mkv") && said.contains("6 lamps"), "{said}");
    assert!(!again.join("project.toml").exists());
}

#[test]
fn a_map_says_which_frames_of_one_movie_are_what() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let shoot = folder.path().join("shoot");
    let silent = Progress::silent();
    stage(&shoot);
    let files = import(&folder.path().join("files"), &shoot, &SETTINGS, &silent).unwrap();
    let parts = [
        interview(&shoot),
        round(&shoot, 0),
        round(&shoot, 1),
        balls(&shoot),
        vec![shoot.join("probes/interview.png")],
    ];
    // Balls and pictures of the subject differ in size, and a movie has one size.
    film(&parts[..3].concat(), &folder.path().join("day 1.mkv"));
    film(&parts[3..].concat(), &folder.path().join("balls.mkv"));
    let manifest = std::fs::read_to_string(shoot.join("manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&manifest).unwrap();
    let probes = &manifest["probes"];
    let lamps: String = (0..LAMPS).map(|lamp| format!("olat_{lamp:02}.jpg 0 {lamp} 1\n")).collect();
    std::fs::write(folder.path().join("dome.lp"), format!("{LAMPS}\n{lamps}")).unwrap();
    let map = format!(
        r#"
name = "Ann"
lamps = "dome.lp"
ball = {{ center_px = {}, radius_px = {} }}
interview = {{ file = "day 1.mkv", frames = [0, 2], ball = {{ file = "balls.mkv", frame = 6 }} }}
balls = {{ file = "balls.mkv", lamps = [0, 1, 2, 3, 4, 5] }}
[[pose]]
name = "pose00"
file = "day 1.mkv"
frames = [3, 11]
[[pose]]
name = "pose01"
file = "day 1.mkv"
lamps = [13, 14, 15, 17, 18, 19]
tracking = [12, 16, 20]
"#,
        probes["ball_center_px"], probes["ball_radius_px"]
    );
    let path = folder.path().join("ann.toml");
    std::fs::write(&path, &map).unwrap();
    let movies = import(&folder.path().join("movies"), &path, &SETTINGS, &silent).unwrap();
    assert_eq!(movies.settings.name, "Ann");
    assert_eq!(movies.settings.shoot.lamps, files.settings.shoot.lamps);
    assert_eq!(movies.settings.shoot.lamp_layout.len(), LAMPS);
    assert!((movies.settings.shoot.frame_rate - 24.0).abs() < 1e-9);
    give_mattes(&shoot, &movies);
    compare(&files, &movies);
    // A list of the lamps' directions stands for the balls.
    let without_balls =
        map.replacen("balls = {", "# balls = {", 1).replacen(", ball = { file = \"balls.mkv\", frame = 6 }", "", 1);
    std::fs::write(&path, &without_balls).unwrap();
    let listed = import(&folder.path().join("listed"), &path, &SETTINGS, &silent).unwrap();
    assert!(listed.settings.shoot.without_balls && listed.probe_pictures().is_empty());
    assert_eq!(listed.settings.shoot.lamp_layout.len(), LAMPS);
    std::fs::write(&path, without_balls.replacen("lamps = \"dome.lp\"", "", 1)).unwrap();
    let said = import(&folder.path().join("bad"), &path, &SETTINGS, &silent).unwrap_err().to_string();
    assert!(said.contains("list of the lamps' directions"), "{said}");
    for (from, to, says) in [
        ("frames = [0, 2]", "frames = [0, 200]", "has 0 to 20"),
        ("frames = [3, 11]", "frames = [3, 8]", "6 lamps"),
        ("lamps = [13, 14,", "lamps = [999, 14,", "no frame 999"),
        ("lamps = [13, 14,", "lamps = [14,", "5 frames for 6 lamps"),
        ("frame = 6", "frame = 60", "frame 60"),
        ("day 1.mkv", "gone.mkv", "gone.mkv"),
        ("pose01", "pose00", "twice"),
        ("balls = {", "# balls = {", "no [balls]"),
        (", ball = { file = \"balls.mkv\", frame = 6 }", "", "no `ball`"),
        ("[[pose]]", "[[post]]", "ann.toml"),
        ("name = \"pose01\"", "name = \"../up\"", "is not the name"),
    ] {
        std::fs::write(&path, map.replacen(from, to, 1)).unwrap();
        let said = import(&folder.path().join("bad"), &path, &SETTINGS, &silent).unwrap_err().to_string();
        assert!(said.contains(says), "{to}: {said}");
    }
    shown!(
        Strangers,
        "A map of a shoot with frames outside the movie, too few lamps, or missing files",
        done: "the import is refused: each message names the file and its frames",
    );
}

/// A stage that is filmed, with tracking frames.
fn filmed() -> StageSettings {
    StageSettings {
        frames: 3,
        size: 32,
        lamps: LAMPS,
        written_as: WrittenAs::Movies,
        trouble: TroubleSettings { tracking: Some(3), ..TroubleSettings::default() },
        ..StageSettings::default()
    }
}

#[test]
fn a_stage_that_is_filmed_is_imported_from_its_movies() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let silent = Progress::silent();
    let stage = filmed();
    let [filmed, shoot] = ["filmed", "shoot"].map(|name| folder.path().join(name));
    write_shoot(&filmed, &stage, &silent).unwrap();
    let files = StageSettings { written_as: WrittenAs::Files, ..stage };
    write_shoot(&shoot, &files, &silent).unwrap();
    let movies = import(&folder.path().join("movies"), &filmed, &SETTINGS, &silent).unwrap();
    let files = import(&folder.path().join("files"), &shoot, &SETTINGS, &silent).unwrap();
    let Source::Movie(movie) = &*movies::open(&filmed.join("interview.mov")).unwrap() else {
        panic!("expected a movie");
    };
    assert!(movie.info().has_sound && movie.info().time_code.as_deref() == Some("01:00:00:00"));
    assert_eq!(movies.settings.shoot.lamps.len(), LAMPS);
    for frame in 0..3 {
        let [a, b] = [&files, &movies].map(|p| Frame::load(p, &Response::Srgb, frame).unwrap());
        let off = a.plate.pixels.iter().flatten().zip(b.plate.pixels.iter().flatten());
        let off = off.map(|(a, b)| (a - b).abs()).sum::<f32>() / (3 * a.plate.pixels.len()) as f32;
        // ProRes is not a lossless codec.
        assert!(off < 0.01 && a.mask == b.mask, "frame {frame}: {off}");
    }
    for pose in 0..6 {
        assert_eq!(TrackingFrames::new(&movies, pose).unwrap().unwrap().times, [0.0, 0.5, 1.0]);
        let [a, b] = [&files, &movies].map(|p| Exemplar::load(p, &Response::Srgb, pose).unwrap());
        for (lamp, (a, b)) in a.olats.iter().zip(&b.olats).enumerate() {
            let off = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
            let off = off.map(|(a, b)| (a - b).abs()).sum::<f32>() / (3 * a.pixels.len()) as f32;
            assert!(off < 0.01, "pose {pose}, lamp {lamp}: {off}");
        }
    }
}

#[test]
fn a_movie_is_the_interview_of_what_lies_beside_it_or_says_what_is_missing() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let silent = Progress::silent();
    let stage = filmed();
    let shoot = folder.path().join("card");
    write_shoot(&shoot, &stage, &silent).unwrap();
    // Named by a camera, at a rate that differs from the manifest's.
    let movie = shoot.join("A001_C003.mov");
    let status = Command::new("ffmpeg")
        .args(["-v", "error", "-r", "30000/1001", "-i"])
        .arg(shoot.join("interview.mov"))
        .args(["-an", "-c:v", "prores_ks"])
        .arg(&movie)
        .status();
    assert!(status.unwrap().success());
    std::fs::remove_file(shoot.join("interview.mov")).unwrap();
    let root = folder.path().join("film");
    let (film, said) = Progress::heard(|progress| import(&root, &movie, &SETTINGS, progress));
    let film = film.unwrap();
    assert_eq!(film.settings.shoot.frames.len(), 3);
    assert_eq!(film.frame_picture(0).file().file_name(), movie.file_name());
    let rate = film.settings.shoot.frame_rate;
    assert!((rate - 30000.0 / 1001.0).abs() < 1e-6, "{rate}");
    assert!(said.contains("24") && said.contains("29.970"), "{said}");
    Frame::load(&film, &Response::Srgb, 2).unwrap();

    let alone = folder.path().join("alone.mov");
    std::fs::copy(&movie, &alone).unwrap();
    let refused = import(&folder.path().join("no"), &alone, &SETTINGS, &silent).unwrap_err();
    let refused = refused.to_string();
    for word in ["alone.mov", "exemplars/", "probes.mov", "New project", "docs/movies.md"] {
        assert!(refused.contains(word), "{refused}");
    }
    assert!(!folder.path().join("no").exists());
    shown!(
        Strangers,
        "A single movie as a shoot",
        done: "poses and balls beside it make it an interview; otherwise a message lists the missing parts",
    );
    shown!(
        Strangers,
        "A manifest with a frame rate that differs from the interview's movie",
        done: "the movie's rate is used, and the import reports the difference",
    );
}

#[test]
fn an_interview_of_exr_pictures_is_imported() {
    let folder = tempfile::tempdir().unwrap();
    let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
    stage(&shoot);
    let files = import(&folder.path().join("files"), &shoot, &SETTINGS, &silent).unwrap();
    let plain = Frame::load(&files, &Response::Srgb, 2).unwrap();
    for (frame, path) in interview(&shoot).into_iter().enumerate() {
        let light = Response::Srgb.decode(&imaging::file::read_encoded(&path).unwrap());
        imaging::file::write_exr(&path.with_file_name(format!("A.{}.exr", 1001 + frame)), &light).unwrap();
        std::fs::remove_file(path).unwrap();
        let mask = |digits: usize| shoot.join(format!("interview_masks/frame_{frame:0digits$}.png"));
        std::fs::rename(mask(3), mask(6)).unwrap();
    }
    let exr = import(&folder.path().join("exr"), &shoot, &SETTINGS, &silent).unwrap();
    let light = Frame::load(&exr, &Response::Srgb, 2).unwrap();
    let off = light.plate.pixels.iter().flatten().zip(plain.plate.pixels.iter().flatten());
    let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off < 1e-3 && light.mask == plain.mask, "{off}");
}

#[test]
fn mattes_of_a_sequence_may_have_the_names_of_its_files() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let shoot = folder.path().join("shoot");
    let silent = Progress::silent();
    stage(&shoot);
    let files = import(&folder.path().join("files"), &shoot, &SETTINGS, &silent).unwrap();
    let seen = |project: &Project| [0, 1, 2].map(|frame| Frame::load(project, &Response::Srgb, frame).unwrap());
    let stills = seen(&files);
    for frame in interview(&shoot) {
        let status =
            Command::new("ffmpeg").args(["-v", "error", "-i"]).arg(&frame).arg(frame.with_extension("tif")).status();
        assert!(status.unwrap().success());
        std::fs::remove_file(frame).unwrap();
    }
    let root = folder.path().join("sequence");
    let sequence = import(&root, &shoot, &SETTINGS, &silent).unwrap();
    for (a, b) in stills.iter().zip(&seen(&sequence)) {
        let pairs = |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) };
        let off = pairs(&a.mask.pixels, &b.mask.pixels);
        assert!(off < 1e-6, "the matte is off by {off}");
        let off = pairs(a.plate.pixels.as_flattened(), b.plate.pixels.as_flattened());
        assert!(off < NEAR, "the plate is off by {off}");
    }
    // The project's own mattes have priority; a missing matte is reported.
    let own = sequence.frame_matte_path(1);
    std::fs::create_dir_all(own.parent().unwrap()).unwrap();
    std::fs::copy(shoot.join("interview_masks/frame_000.png"), own).unwrap();
    let replaced = Frame::load(&sequence, &Response::Srgb, 1).unwrap();
    assert_eq!(replaced.mask, stills[0].mask);
    std::fs::remove_file(shoot.join("interview_masks/frame_002.png")).unwrap();
    let said = import(&folder.path().join("short"), &shoot, &SETTINGS, &silent).unwrap_err();
    let said = said.to_string();
    assert!(said.contains("interview_masks") && said.contains("2 mattes"), "{said}");
}
