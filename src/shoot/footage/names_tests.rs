//! File names as cameras, tools and systems leave them in a shoot's folder.

use crate::{ImportSettings, import, read_picture, scan};
use base::error::Result;
use base::progress::Progress;
use imaging::file;
use project::{Frames, Picture, Project};
use std::path::{Path, PathBuf};
use virtual_stage::{StageSettings, write_shoot};

const LAMPS: usize = 11;
const FRAMES: usize = 5;

fn stage(folder: &Path) -> PathBuf {
    let shoot = folder.join("shoot");
    let stage = StageSettings { frames: FRAMES, size: 16, lamps: LAMPS, ..StageSettings::default() };
    write_shoot(&shoot, &stage, &Progress::silent()).unwrap();
    shoot
}

/// Imports a shoot, with everything that the import says.
fn imported(shoot: &Path) -> (Result<Project>, String) {
    let root = shoot.with_file_name("project");
    let _ = std::fs::remove_dir_all(&root);
    let settings = ImportSettings { size: 16, seed: 1, layer: None };
    Progress::heard(|progress| import(&root, shoot, &settings, progress))
}

/// The problem of an import.
fn refused(shoot: &Path) -> String {
    imported(shoot).0.unwrap_err().to_string()
}

/// Renames files of a folder; `name` gives the new name for a name without its ending.
fn rename(folder: &Path, name: impl Fn(&str) -> String) {
    for old in base::files::sorted_names(folder).unwrap() {
        let old = folder.join(old);
        let stem = old.file_stem().unwrap().to_str().unwrap();
        std::fs::rename(&old, folder.join(name(stem))).unwrap();
    }
}

/// Codes of every picture of the lamps, frames and balls.
fn seen(project: &Project) -> Vec<Vec<[f32; 3]>> {
    let shoot = &project.settings.shoot;
    let poses = 0..shoot.poses.len();
    let olats = poses.flat_map(|p| (0..shoot.lamps.len()).map(move |l| project.olat_picture(p, l)));
    let frames = (0..shoot.frames.len()).map(|frame| project.frame_picture(frame));
    let pictures = olats.chain(frames).chain(project.probe_pictures());
    pictures.map(|picture| read_picture(&picture).unwrap().0.pixels).collect()
}

/// True for pictures that differ by no more than rounding.
fn is_same(a: &[Vec<[f32; 3]>], b: &[Vec<[f32; 3]>]) -> bool {
    let off = |(a, b): (&f32, &f32)| (a - b).abs();
    let near = |a: &[f32], b: &[f32]| a.len() == b.len() && a.iter().zip(b).map(off).all(|off| off < 1e-6);
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| near(a.as_flattened(), b.as_flattened()))
}

fn number(stem: &str) -> usize {
    stem[stem.len() - 2..].parse().unwrap()
}

#[test]
fn numbers_without_zeros_and_endings_in_any_case_are_the_same_shoot() {
    let folder = tempfile::tempdir().unwrap();
    let shoot = stage(folder.path());
    let padded = imported(&shoot).0.unwrap();
    let wanted = seen(&padded);
    let pose = |n: usize| shoot.join(format!("exemplars/pose{n:02}"));
    let poses = padded.settings.shoot.poses.len();
    let olat = |stem: &str| format!("olat_{}.PNG", number(stem) + 1);
    (0..poses).for_each(|n| rename(&pose(n), olat));
    let ball = |stem: &str| match stem {
        "interview" => "interview.png".to_owned(),
        stem => olat(stem),
    };
    rename(&shoot.join("probes"), ball);
    let (project, said) = imported(&shoot);
    let project = project.unwrap_or_else(|e| panic!("{e}"));
    let names: Vec<String> = (1..=LAMPS).map(|lamp| format!("olat_{lamp}")).collect();
    assert_eq!(project.settings.shoot.lamps, names);
    assert_eq!(project.settings.shoot.lamp_layout, padded.settings.shoot.lamp_layout);
    assert!(is_same(&seen(&project), &wanted) && !said.contains("left out"), "{said}");
    // Balls and a pose with other names follow the order of the lamps.
    rename(&pose(1), |stem| format!("IMG_{:04}.png", 7 + stem[5..].parse::<u32>().unwrap()));
    for name in (1..=LAMPS).map(|lamp| format!("olat_{lamp}.PNG")) {
        let ball = shoot.join("probes").join(name.replace("olat", "ball").to_lowercase());
        std::fs::rename(shoot.join("probes").join(&name), ball).unwrap();
    }
    assert!(scan::scan(&shoot, None).is_complete(), "{:?}", scan::scan(&shoot, None));
    let (project, said) = imported(&shoot);
    let project = project.unwrap_or_else(|e| panic!("{e}"));
    assert!(is_same(&seen(&project), &wanted) && project.settings.shoot.lamps == names);
    for words in ["ball_1 for olat_1 to ball_11 for olat_11", "IMG_0008 for olat_1"] {
        assert!(said.contains(words), "{said}");
    }
    let Picture::Movie { file, frame } = project.olat_picture(1, 0) else {
        panic!("expected the pattern of the pose's pictures");
    };
    assert_eq!((file.file_name().unwrap().to_str(), frame), (Some("IMG_%04d.png"), 8));
    assert_eq!(Project::open(&project.root).unwrap(), project);
}

#[test]
fn strays_are_left_out_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let shoot = stage(folder.path());
    let (clean, said) = imported(&shoot);
    assert!(!said.contains("left out"), "{said}");
    let clean = clean.unwrap();
    let wanted = seen(&clean);
    let picture = shoot.join("interview/frame_000.png");
    for stray in [
        "interview/thumb.png",
        "interview/a.jpg",
        "exemplars/pose00/thumb.png",
        "interview_masks/old.png",
        "exemplar_masks/pose00 copy.png",
        "exemplars/sheet.jpg",
    ] {
        std::fs::copy(&picture, shoot.join(stray)).unwrap();
    }
    for clutter in [
        "interview/.DS_Store",
        "interview/._frame_000.png",
        "interview/Thumbs.db",
        "exemplars/pose00/._olat_00.png",
        "exemplars/._pose00.mov",
        "exemplars/desktop.ini",
        "probes/.hidden.png",
        "._interview.mov",
    ] {
        std::fs::write(shoot.join(clutter), "no picture").unwrap();
    }
    for folder in ["exemplars/@eaDir", "exemplars/.@__thumb", "exemplars/__MACOSX"] {
        std::fs::create_dir(shoot.join(folder)).unwrap();
    }
    let (project, said) = imported(&shoot);
    let project = project.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(project.settings.shoot, clean.settings.shoot);
    assert!(is_same(&seen(&project), &wanted));
    for words in [
        "a.jpg, thumb.png are left out",
        "frame_###.png",
        "thumb in exemplars/pose00",
        "old.png is left out of",
        "interview_masks: no frame has that name",
        "pose00 copy.png is left out of",
        "sheet.jpg is left out of",
        // Files in the shoot's own folder are beside no picture.
        "10 hidden or system files are left out, such as exemplars/@eaDir\n",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert_eq!(said.matches("hidden").count(), 1, "{said}");
}

#[test]
fn several_candidates_are_refused_by_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let shoot = stage(folder.path());
    let picture = shoot.join("interview/frame_000.png");
    for (files, line, says) in [
        (&["interview.mov", "interview.mp4"][..], 1, ["interview.mov and interview.mp4", "Keep"]),
        (&["interview.mov"], 1, ["interview.mov and interview/", "Keep one"]),
        (&["interview/b_1.png", "interview/b_2.png"], 1, ["b_#.png (2", "frame_###.png (5"]),
        (&["interview/frame_000.jpg", "interview/frame_001.jpg"], 1, ["frame_###.jpg", ".png (5"]),
        (&["exemplars/pose00.mov"], 2, ["pose00/ and pose00.mov", "one movie"]),
        (&["exemplars/pose00/olat_00.jpg"], 2, ["olat_00.jpg and olat_00.png", "Keep one"]),
        (&["probes.mov", "probes.mkv"], 3, ["probes.mkv and probes.mov", "Keep one"]),
        (&["interview_masks.mov"], 4, ["interview_masks.mov and interview_masks/", "Keep one"]),
    ] {
        for file in files {
            std::fs::copy(&picture, shoot.join(file)).unwrap();
        }
        let said = refused(&shoot);
        let line = scan::scan(&shoot, None).lines[line].lack.clone().unwrap_or_default();
        for text in [&said, &line] {
            assert!(says.iter().all(|word| text.contains(word)), "{files:?}: {text}");
        }
        files.iter().for_each(|file| std::fs::remove_file(shoot.join(file)).unwrap());
    }
    for list in ["a.lp", "b.lp"] {
        std::fs::write(shoot.join(list), "1\na 0 0 1\n").unwrap();
    }
    assert!(refused(&shoot).contains("a.lp and b.lp"), "{}", refused(&shoot));
}

#[test]
fn a_gap_in_numbered_pictures_is_a_damaged_frame() {
    let folder = tempfile::tempdir().unwrap();
    let shoot = stage(folder.path());
    for frame in [1, 3] {
        std::fs::remove_file(shoot.join(format!("interview/frame_{frame:03}.png"))).unwrap();
    }
    let (stopped, said) = imported(&shoot);
    let stopped = stopped.unwrap_err().to_string();
    assert!(said.contains("Pictures 1, 3 of") && said.contains("frame_###.png"), "{said}");
    let is_named = ["frame_001.png", "frame_003.png"].iter().any(|name| stopped.contains(name));
    assert!(is_named && stopped.contains("damaged_frames"), "{stopped}");
    let path = shoot.join("manifest.json");
    let mut manifest: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    manifest["damaged_frames"] = "hold".into();
    std::fs::write(path, manifest.to_string()).unwrap();
    let (held, said) = imported(&shoot);
    let held = held.unwrap_or_else(|e| panic!("{e}"));
    let names: Vec<String> = (0..FRAMES).map(|frame| format!("frame_{frame:03}")).collect();
    assert_eq!(held.settings.shoot.frames, Frames::Named(names));
    assert!(said.contains("Frame 1 cannot be read"), "{said}");
    assert_eq!(crate::readable_frame(&held, 3).unwrap(), 2);

    // The same of other pictures than PNGs.
    for frame in [0, 2, 4] {
        let png = shoot.join(format!("interview/frame_{frame:03}.png"));
        let picture = file::read_encoded(&png).unwrap();
        let jpeg = file::jpeg_bytes(&picture, 100).unwrap();
        std::fs::write(png.with_extension("JPG"), jpeg).unwrap();
        std::fs::remove_file(png).unwrap();
        let mask = |digits| shoot.join(format!("interview_masks/frame_{frame:0digits$}.png"));
        std::fs::rename(mask(3), mask(6)).unwrap();
    }
    let (held, said) = imported(&shoot);
    let held = held.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(held.settings.shoot.frames.len(), FRAMES);
    assert!(held.frame_picture(1).file().ends_with("interview/frame_%03d.JPG"));
    assert!(said.contains("Pictures 1, 3 of the sequence are missing"), "{said}");
    assert_eq!(crate::readable_frame(&held, 3).unwrap(), 2);
    assert_eq!(crate::readable_frame(&held, 4).unwrap(), 4);
}

#[test]
fn lamps_balls_and_mattes_may_be_of_any_format() {
    let folder = tempfile::tempdir().unwrap();
    let shoot = stage(folder.path());
    let pngs = imported(&shoot).0.unwrap();
    let wanted = seen(&pngs);
    let masks = |project: &Project| {
        let frames = (0..FRAMES).map(|frame| project.frame_matte(frame));
        let poses = (0..project.settings.shoot.poses.len()).map(|p| project.exemplar_matte(p));
        let all = frames.chain(poses).map(|matte| crate::read_matte(&matte).unwrap().pixels);
        all.collect::<Vec<_>>()
    };
    let wanted_masks = masks(&pngs);
    let jpeg = |folder: &str| {
        let folder = shoot.join(folder);
        for name in base::files::sorted_names(&folder).unwrap() {
            let png = folder.join(name);
            let jpeg = file::jpeg_bytes(&file::read_encoded(&png).unwrap(), 100).unwrap();
            std::fs::write(png.with_extension("jpg"), jpeg).unwrap();
            std::fs::remove_file(png).unwrap();
        }
    };
    ["exemplars/pose00", "probes", "interview_masks", "exemplar_masks"].into_iter().for_each(jpeg);
    assert!(scan::scan(&shoot, None).is_complete(), "{:?}", scan::scan(&shoot, None));
    let project = imported(&shoot).0.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(project.settings.shoot, pngs.settings.shoot);
    assert!(project.olat_picture(0, 3).file().ends_with("pose00/olat_03.jpg"));
    let off = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / a.len() as f32;
    // JPEG may halve the colour's resolution.
    for (a, b) in seen(&project).iter().zip(&wanted) {
        assert!(off(a.as_flattened(), b.as_flattened()) < 0.05);
    }
    for (a, b) in masks(&project).iter().zip(&wanted_masks) {
        assert!(off(a, b) < 0.01);
    }
    // Formats that are not read are named.
    rename(&shoot.join("exemplar_masks"), |stem| format!("{stem}.webp"));
    let said = refused(&shoot);
    for words in ["no matte", "exemplar_masks/pose00.png", "has 6 .webp; PNG, JPEG, TIFF and EXR"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    rename(&shoot.join("interview"), |stem| format!("{stem}.cr3"));
    let said = refused(&shoot);
    assert!(said.contains("interview holds no frame: it has 5 .cr3"), "{said}");
}

#[test]
fn mattes_of_an_interview_may_be_a_movie() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let shoot = stage(folder.path());
    let film = |frames: usize| {
        let status = std::process::Command::new("ffmpeg")
            .args(["-v", "error", "-y", "-framerate", "24", "-i"])
            .arg(shoot.with_file_name("masks").join("frame_%03d.png"))
            .args(["-frames:v", &frames.to_string(), "-c:v", "ffv1", "-pix_fmt", "gray"])
            .arg(shoot.join("interview_masks.mkv"))
            .status();
        assert!(status.unwrap().success());
    };
    std::fs::rename(shoot.join("interview_masks"), shoot.with_file_name("masks")).unwrap();
    film(FRAMES - 1);
    let said = refused(&shoot);
    assert!(said.contains("interview_masks.mkv") && said.contains("4 mattes for 5"), "{said}");
    let longer = shoot.join("interview_masks.mov");
    film(FRAMES);
    std::fs::rename(shoot.join("interview_masks.mkv"), &longer).unwrap();
    let project = imported(&shoot).0.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(Project::open(&project.root).unwrap(), project);
    for frame in 0..FRAMES {
        let name = format!("masks/frame_{frame:03}.png");
        let still = file::read_mask(&shoot.with_file_name(name)).unwrap();
        let matte = crate::read_matte(&project.frame_matte(frame)).unwrap();
        let off = still.pixels.iter().zip(&matte.pixels).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f32::max) < 1e-4, "frame {frame}");
    }
}
