//! Mattes from the network's probability, compared with the truth.

use afterlight_person::Segmenter;
use base::files::natural_order;
use base::progress::Progress;
use footage::{ImportSettings, MatteSettings, import, make_mattes};
use imaging::Encoded;
use imaging::color::{linear_from_srgb, srgb_from_linear, unit};
use imaging::file::{read_encoded, read_linear, read_mask};
use imaging::resample::{resize, resize_area};
use imaging::{Mask, Raster};
use matte::{guessed, key};
use std::path::Path;
use std::process::Command;
use test_support::shown;
use virtual_stage::{StageSettings, write_shoot};

/// Intersection over union, of pixels that are at least half covered, and the mean error of coverage.
fn scores(found: &Mask, truth: &Mask) -> [f32; 2] {
    assert_eq!(found.size(), truth.size());
    let pairs = || found.pixels.iter().zip(&truth.pixels);
    assert!(pairs().all(|(a, _)| (0.0..=1.0).contains(a)));
    let both = pairs().filter(|(a, b)| **a >= 0.5 && **b >= 0.5).count();
    let any = pairs().filter(|(a, b)| **a >= 0.5 || **b >= 0.5).count();
    let off = pairs().map(|(a, b)| (a - b).abs()).sum::<f32>();
    [both as f32 / any.max(1) as f32, off / found.pixels.len() as f32]
}

/// Worst scores so far: of the network alone and of the matte.
struct Worst([[f32; 2]; 2]);

impl Worst {
    fn new() -> Self {
        Self([[1.0, 0.0]; 2])
    }

    fn add(&mut self, segmenter: &Segmenter, picture: &Encoded, truth: &Mask) {
        let (width, height) = picture.0.size();
        let alone = resize(&segmenter.probability(picture).unwrap(), width, height);
        let found = guessed(picture, |inner| segmenter.probability(inner)).unwrap();
        let new = [scores(&alone, truth), scores(&found.mask, truth)];
        self.join(&Self(new), "");
    }

    fn join(&mut self, other: &Self, what: &str) {
        for (worst, new) in self.0.iter_mut().zip(other.0) {
            *worst = [worst[0].min(new[0]), worst[1].max(new[1])];
        }
        if !what.is_empty() {
            let [alone, matte] = other.0;
            println!("{what}, worst IoU and mean error: network {alone:.4?}, matte {matte:.4?}");
        }
    }
}

/// A subject in front of another background, both as light; screen light that shines through is removed.
fn before(picture: &Encoded, truth: &Mask, background: &imaging::Image) -> Encoded {
    let light = picture.0.map(|p| p.map(linear_from_srgb));
    let (mut screen, mut count) = ([0.0_f32; 3], 0.0);
    for (p, _) in (light.pixels.iter().zip(&truth.pixels)).filter(|(_, a)| **a == 0.0) {
        screen = std::array::from_fn(|c| screen[c] + p[c]);
        count += 1.0;
    }
    let screen = screen.map(|s| s / count);
    let (width, height) = light.size();
    Encoded(Raster::from_fn(width, height, |x, y| {
        let (a, p, b) = (truth.at(x, y), light.at(x, y), background.at(x, y));
        std::array::from_fn(|c| {
            let own = (p[c] - (1.0 - a) * screen[c]).max(0.0);
            // Eight bits, like a camera.
            let code = srgb_from_linear(own + (1.0 - a) * b[c]);
            (unit(code) * 255.0).round() / 255.0
        })
    }))
}

/// A part of a panorama, at medium brightness.
fn part(panorama: &imaging::Image, (width, height): (usize, usize), turn: usize) -> imaging::Image {
    let rows = panorama.height / 2;
    let columns = (rows * width / height).min(panorama.width);
    let start = turn * panorama.width / 3;
    let cut = Raster::from_fn(columns, rows, |x, y| panorama.at((start + x) % panorama.width, y + rows / 2));
    let cut = resize(&resize_area(&cut, columns.min(width), rows.min(height)), width, height);
    let mut levels: Vec<f32> = cut.pixels.iter().map(|p| p[1]).collect();
    levels.sort_by(f32::total_cmp);
    let scale = 0.2 / levels[levels.len() / 2].max(1e-6);
    cut.map(|p| p.map(|v| (v * scale).min(1.0)))
}

/// Required IoU and mean error in front of a screen, in focus or not.
const SCREEN: [f32; 2] = [0.985, 0.01];
/// Required IoU and mean error in front of any background.
const ANY: [f32; 2] = [0.95, 0.02];

fn frame(shoot: &Path, index: usize) -> (Encoded, Mask) {
    let name = format!("frame_{index:03}.png");
    let picture = read_encoded(&shoot.join("interview").join(&name)).unwrap();
    let truth = read_mask(&shoot.join("interview_masks").join(&name)).unwrap();
    (picture, truth)
}

/// Frames of a real man in front of a green screen, without the bar below, and the mattes of their key. Empty
/// without the footage.
fn filmed() -> Vec<(Encoded, Mask)> {
    let Some(movie) = test_support::shared("data/footage/d0.mp4") else { return Vec::new() };
    if !test_support::ffmpeg() {
        return Vec::new();
    }
    let folder = tempfile::tempdir().unwrap();
    let status = Command::new("ffmpeg")
        .args(["-v", "error", "-i"])
        .arg(movie)
        .args(["-vf", "select=not(mod(n\\,26)),crop=512:480:0:0"])
        .args(["-fps_mode", "passthrough"])
        .arg(folder.path().join("%d.png"))
        .status()
        .unwrap();
    assert!(status.success());
    let read = |i| {
        let picture = read_encoded(&folder.path().join(format!("{i}.png"))).unwrap();
        let truth = key(&picture).unwrap().matte(&picture).unwrap().mask;
        (picture, truth)
    };
    (1..=3).map(read).collect()
}

#[test]
fn a_person_is_found_without_screen_or_box() {
    let segmenter = Segmenter::new().unwrap();
    let mut people = Vec::new();
    let mut all = Worst::new();
    for seed in [3, 17] {
        let folder = tempfile::tempdir().unwrap();
        let settings = StageSettings { frames: 2, size: 256, lamps: 4, seed, ..StageSettings::default() };
        write_shoot(folder.path(), &settings, &Progress::silent()).unwrap();
        let mut worst = Worst::new();
        for index in 0..2 {
            let (picture, truth) = frame(folder.path(), index);
            worst.add(&segmenter, &picture, &truth);
            if index == 0 {
                people.push((picture, truth));
            }
        }
        all.join(&worst, &format!("virtual stage of seed {seed}"));
    }
    if let Some(shoot) = test_support::shared("data/stage") {
        let mut worst = Worst::new();
        for index in (0..40).step_by(8) {
            let (picture, truth) = frame(&shoot, index);
            worst.add(&segmenter, &picture, &truth);
            if index % 16 == 0 {
                people.push((picture, truth));
            }
        }
        all.join(&worst, "shared shoot");
    }
    let filmed = filmed();
    if !filmed.is_empty() {
        let mut worst = Worst::new();
        for (picture, truth) in &filmed {
            worst.add(&segmenter, picture, truth);
        }
        all.join(&worst, "filmed man");
        people.extend(filmed);
    }
    let [_, [iou, off]] = all.0;
    assert!(iou >= SCREEN[0] && off <= SCREEN[1], "{iou} {off}");

    let Some(panoramas) = test_support::shared("data/hdri") else { return };
    let mut worst = Worst::new();
    for name in ["interior", "forest", "courtyard"] {
        let panorama = read_linear(&panoramas.join(format!("{name}.exr"))).unwrap();
        for (turn, (picture, truth)) in people.iter().enumerate() {
            let background = part(&panorama, picture.0.size(), turn);
            worst.add(&segmenter, &before(picture, truth, &background), truth);
        }
    }
    all.join(&worst, "the same in front of parts of three panoramas");
    let [_, [iou, off]] = worst.0;
    assert!(iou >= ANY[0] && off <= ANY[1], "{iou} {off}");
    shown!(Pictures, "A person in front of any background, without screen, box or strokes",
        bound: format!("IoU {}, mean error {}", ANY[0], ANY[1]),
        measured: format!("IoU {iou:.3}, mean error {off:.4}"));
}

/// Interview and poses in front of a wall that the lamps light too: no screen, and no dark background.
#[test]
fn a_shoot_without_a_screen_gets_mattes() {
    let folder = tempfile::tempdir().unwrap();
    let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
    let settings = StageSettings { frames: 2, size: 128, lamps: 4, seed: 5, ..StageSettings::default() };
    write_shoot(&shoot, &settings, &silent).unwrap();
    let put = |file: &Path, truth: &Mask, level: f32| {
        let wall = imaging::Image::filled(128, 128, [0.2, 0.19, 0.18].map(|v| level * v));
        let picture = before(&read_encoded(file).unwrap(), truth, &wall);
        imaging::file::write_png(file, &picture).unwrap();
    };
    let listed = |folder: &str| {
        let files = std::fs::read_dir(shoot.join(folder)).unwrap();
        let mut files: Vec<_> = files.map(|file| file.unwrap().path()).collect();
        files.sort_by(|a, b| natural_order(a, b));
        files
    };
    let truth_of = |masks: &str, name: &Path| {
        let stem = name.file_stem().unwrap().to_str().unwrap();
        read_mask(&shoot.join(format!("{masks}/{stem}.png"))).unwrap()
    };
    let frames: Vec<Mask> = (listed("interview").iter())
        .map(|file| {
            let truth = truth_of("interview_masks", file);
            put(file, &truth, 1.0);
            truth
        })
        .collect();
    let poses: Vec<Mask> = (listed("exemplars").iter())
        .map(|pose| {
            let truth = truth_of("exemplar_masks", pose);
            for olat in std::fs::read_dir(pose).unwrap() {
                put(&olat.unwrap().path(), &truth, 0.2);
            }
            truth
        })
        .collect();
    let root = folder.path().join("project");
    let settings = ImportSettings { size: 16, seed: 1, layer: None };
    let project = import(&root, &shoot, &settings, &silent).unwrap();
    for masks in ["interview_masks", "exemplar_masks"] {
        std::fs::remove_dir_all(shoot.join(masks)).unwrap();
    }
    let segmenter = Segmenter::new().unwrap();
    let person = move |picture: &Encoded| segmenter.probability(picture);
    let settings = MatteSettings::default();
    let made = make_mattes(&root, &settings, Some(Box::new(person)), &silent).unwrap();
    assert_eq!((made.frames, made.guessed, made.screen), (2, 2, None));
    assert_eq!((made.poses, made.guessed_poses), (poses.len(), poses.len()));
    let said = made.sentence();
    assert!(said.contains(&format!("2 frames and {} poses", poses.len())), "{said}");
    let check = |path: &dyn Fn(usize) -> std::path::PathBuf, truths: &[Mask]| {
        for (index, truth) in truths.iter().enumerate() {
            let [iou, off] = scores(&read_mask(&path(index)).unwrap(), truth);
            assert!(iou >= 0.97 && off <= 0.02, "{}: {iou} {off}", path(index).display());
        }
    };
    check(&|frame| project.frame_matte_path(frame), &frames);
    check(&|pose| project.exemplar_matte_path(pose), &poses);
}

#[test]
fn bars_that_fill_the_picture_up_are_not_looked_at() {
    let segmenter = Segmenter::new().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let settings = StageSettings { frames: 1, size: 128, lamps: 4, ..StageSettings::default() };
    write_shoot(folder.path(), &settings, &Progress::silent()).unwrap();
    let (picture, truth) = frame(folder.path(), 0);
    let bars = |x: usize, y: usize| !(20..148).contains(&x) || y >= 128;
    let wide = Encoded(Raster::from_fn(168, 150, |x, y| if bars(x, y) { [0.0; 3] } else { picture.0.at(x - 20, y) }));
    // The line next to a bar counts as bar.
    let truth =
        Raster::from_fn(168, 150, |x, y| if !(21..147).contains(&x) || y >= 127 { 0.0 } else { truth.at(x - 20, y) });
    let found = guessed(&wide, |p| segmenter.probability(p)).unwrap();
    let [iou, off] = scores(&found.mask, &truth);
    assert!(iou >= 0.98 && off <= 0.01, "{iou} {off}");
    let on_bars = (0..150).flat_map(|y| (0..168).map(move |x| (x, y)));
    let mut on_bars = on_bars.filter(|(x, y)| bars(*x, *y));
    assert!(on_bars.all(|(x, y)| found.mask.at(x, y) == 0.0));
}

#[test]
fn where_nobody_is_a_sentence_says_so() {
    let segmenter = Segmenter::new().unwrap();
    let said = |room: &Encoded| match guessed(room, |p| segmenter.probability(p)) {
        Ok(_) => None,
        Err(said) => Some(said.for_terminal()),
    };
    let mut state = 1_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    for room in [
        Raster::filled(64, 64, [0.5; 3]),
        Raster::filled(1, 1, [f32::NAN; 3]),
        Raster::from_fn(90, 60, |x, y| [x as f32 / 90.0, y as f32 / 60.0, 0.4]),
        Raster::from_fn(70, 120, |_, _| std::array::from_fn(|_| noise())),
    ] {
        let said = said(&Encoded(room)).unwrap();
        assert!(said.contains("nor a person") && said.contains("--box"), "{said}");
    }
    let Some(panoramas) = test_support::shared("data/hdri") else { return };
    let (mut rooms, mut empty) = (0, 0);
    for name in ["interior", "city", "forest", "studio", "courtyard"] {
        let panorama = read_linear(&panoramas.join(format!("{name}.exr"))).unwrap();
        for turn in 0..3 {
            let room = part(&panorama, (320, 180), turn);
            let room = Encoded(room.map(|p| p.map(srgb_from_linear)));
            rooms += 1;
            empty += usize::from(said(&room).is_some());
        }
    }
    assert!(10 * empty >= 9 * rooms, "{empty} of {rooms}");
    shown!(Pictures, "An interview frame without a person or a screen",
        bound: "9 of 10 rooms",
        measured: format!("{empty} of {rooms}: an armchair can pass for a person"));
}
