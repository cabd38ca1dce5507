//! Mattes compared with the truth, and pictures without a subject or screen.

use super::*;
use base::progress::Progress;
use imaging::{Raster, file};
use std::path::Path;
use test_support::{files, shown};
use virtual_stage::{StageSettings, write_shoot};

/// Required scores of poses, which have no screen.
const POSES: (f32, f32) = (0.985, 0.01);

/// Intersection over union of pixels that are at least half covered, and mean error of coverage.
pub fn scores(found: &Mask, truth: &Mask) -> (f32, f32) {
    assert_eq!(found.size(), truth.size());
    let pairs = || found.pixels.iter().zip(&truth.pixels);
    assert!(pairs().all(|(a, _)| (0.0..=1.0).contains(a)));
    let both = pairs().filter(|(a, b)| **a >= 0.5 && **b >= 0.5).count();
    let any = pairs().filter(|(a, b)| **a >= 0.5 || **b >= 0.5).count();
    let off = pairs().map(|(a, b)| (a - b).abs()).sum::<f32>();
    (both as f32 / any.max(1) as f32, off / found.pixels.len() as f32)
}

/// Worst scores of a shoot's frames, every `step`th of them.
fn frames(shoot: &Path, step: usize) -> (f32, f32) {
    let mut worst = (1.0_f32, 0.0_f32);
    for path in files(&shoot.join("interview")).iter().step_by(step) {
        let picture = file::read_encoded(path).unwrap();
        let found = key(&picture).unwrap().matte(&picture).unwrap();
        let truth = shoot.join("interview_masks").join(path.file_name().unwrap());
        let (iou, off) = scores(&found.mask, &file::read_mask(&truth).unwrap());
        println!("{} IoU {iou:.4}, error {off:.5}, uncertain {:.3}", path.display(), found.uncertain);
        worst = (worst.0.min(iou), worst.1.max(off));
    }
    worst
}

/// Worst scores of a shoot's poses, from the maximum of their OLATs.
fn poses(shoot: &Path) -> (f32, f32) {
    let mut worst = (1.0_f32, 0.0_f32);
    for folder in files(&shoot.join("exemplars")).iter().filter(|f| f.is_dir()) {
        let mut brightest: Option<Encoded> = None;
        for path in files(folder) {
            let picture = file::read_encoded(&path).unwrap();
            let so_far = brightest.get_or_insert_with(|| picture.clone());
            for (a, b) in so_far.0.pixels.iter_mut().zip(&picture.0.pixels) {
                *a = std::array::from_fn(|c| a[c].max(b[c]));
            }
        }
        let found = lit(&brightest.unwrap()).unwrap();
        let name = folder.file_name().unwrap().to_str().unwrap();
        let truth = shoot.join(format!("exemplar_masks/{name}.png"));
        let (iou, off) = scores(&found.mask, &file::read_mask(&truth).unwrap());
        println!("{name} IoU {iou:.4}, error {off:.5}");
        worst = (worst.0.min(iou), worst.1.max(off));
    }
    worst
}

#[test]
fn mattes_of_the_shared_shoot_are_those_of_its_truth() {
    let Some(shoot) = test_support::shared("data/stage") else { return };
    let (iou, off) = frames(&shoot, 4);
    assert!(iou >= 0.985 && off <= 0.01, "frames: {iou} {off}");
    let (iou, off) = poses(&shoot);
    assert!(iou >= POSES.0 && off <= POSES.1, "poses: {iou} {off}");
}

#[test]
fn mattes_of_virtual_stages_are_those_of_their_truth() {
    for seed in [3, 17] {
        let folder = tempfile::tempdir().unwrap();
        let settings = StageSettings { frames: 2, size: 128, lamps: 6, seed, ..StageSettings::default() };
        write_shoot(folder.path(), &settings, &Progress::silent()).unwrap();
        let (iou, off) = frames(folder.path(), 1);
        assert!(iou >= 0.985 && off <= 0.01, "seed {seed}: {iou} {off}");
        let (iou, off) = poses(folder.path());
        assert!(iou >= POSES.0 && off <= POSES.1, "seed {seed} poses: {iou} {off}");
    }
}

/// A round subject of colour `subject` with soft edges, before a screen whose light falls off by half to the right.
pub fn round(size: (usize, usize), screen: [f32; 3], subject: [f32; 3]) -> (Encoded, Mask) {
    let (w, h) = (size.0 as f32, size.1 as f32);
    let truth = Raster::from_fn(size.0, size.1, |x, y| {
        let (dx, dy) = (x as f32 + 0.5 - 0.5 * w, y as f32 + 0.5 - 0.6 * h);
        ((0.25 * w - dx.hypot(dy)) / 3.0 + 0.5).clamp(0.0, 1.0)
    });
    let picture = Raster::from_fn(size.0, size.1, |x, y| {
        let (a, light) = (truth.at(x, y), 1.0 - 0.5 * x as f32 / w);
        std::array::from_fn(|c| imaging::color::srgb_from_linear(a * subject[c] + (1.0 - a) * light * screen[c]))
    });
    (Encoded(picture), truth)
}

#[test]
fn uneven_green_and_blue_screens_are_keyed() {
    let mut worst = (1.0_f32, 0.0_f32);
    for (screen, hue) in [([0.05, 0.4, 0.1], Hue::Green), ([0.05, 0.12, 0.5], Hue::Blue)] {
        for subject in [[0.4, 0.25, 0.2], [0.02, 0.02, 0.02], [0.8, 0.8, 0.75], [0.2, 0.2, 0.05]] {
            let (picture, truth) = round((150, 110), screen, subject);
            let key = key(&picture).unwrap();
            assert_eq!(key.hue, hue);
            let (iou, off) = scores(&key.matte(&picture).unwrap().mask, &truth);
            assert!(iou >= 0.985 && off <= 0.01, "{hue:?}, {subject:?}: {iou}, {off}");
            worst = (worst.0.min(iou), worst.1.max(off));
        }
    }
    shown!(Pictures, "A green or blue screen half as bright on one side, and a dark, bright or greenish subject",
        bound: "IoU 0.985, mean error 0.01",
        measured: format!("IoU {:.3}, mean error {:.4}", worst.0, worst.1));
}

#[test]
fn specks_and_gaps_are_closed_and_black_bars_are_no_subject() {
    let (mut picture, truth) = round((160, 120), [0.05, 0.4, 0.1], [0.4, 0.25, 0.2]);
    let (clean, screen) = (picture.clone(), picture.0.at(30, 30));
    picture.0.pixels[20 * 160 + 20] = [0.6, 0.3, 0.3];
    picture.0.pixels[70 * 160 + 80] = screen;
    let matte = key(&picture).unwrap().matte(&picture).unwrap().mask;
    assert_eq!((matte.at(20, 20), matte.at(80, 70)), (0.0, 1.0));
    let mut barred = clean;
    barred.0.pixels[110 * 160..].fill([0.0; 3]);
    let matte = key(&barred).unwrap().matte(&barred).unwrap().mask;
    assert!(matte.pixels[110 * 160..].iter().all(|a| *a == 0.0));
    assert!(scores(&matte, &truth).1 < 0.01);
}

#[test]
fn a_picture_without_a_screen_is_refused_and_one_without_a_subject_is_empty() {
    for (width, height) in [(1, 1), (1, 9), (40, 30)] {
        for color in [[0.0; 3], [0.5; 3], [1.0; 3], [0.7, 0.5, 0.4], [f32::NAN; 3]] {
            let picture = Encoded(Raster::filled(width, height, color));
            let said = key(&picture).unwrap_err().to_string();
            assert!(said.contains("no green or blue screen") && said.contains("mattes"), "{said}");
            assert!(lit(&picture).unwrap_err().to_string().contains("mattes"));
        }
        for color in [[0.2, 0.6, 0.3], [0.1, 0.2, 0.6]] {
            let picture = Encoded(Raster::filled(width, height, color));
            let key = key(&picture).unwrap();
            let matte = key.matte(&picture).unwrap();
            assert!(matte.mask.pixels.iter().all(|a| *a == 0.0), "{width} × {height}");
            let other = Encoded(Raster::filled(width, height, [0.5; 3]));
            assert!(key.matte(&other).unwrap_err().to_string().contains("does not show"));
        }
    }
}

#[test]
fn every_pixel_may_be_anything() {
    let mut state = 7_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        match state >> 29 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            _ => (state >> 8) as f32 / (1 << 24) as f32,
        }
    };
    for (width, height) in [(1, 1), (2, 1), (3, 7), (33, 20)] {
        let (screened, _) = round((width, height), [0.05, 0.4, 0.1], [0.4, 0.25, 0.2]);
        let mut picture = screened.clone();
        for pixel in &mut picture.0.pixels {
            *pixel = std::array::from_fn(|_| random());
        }
        let found = [
            key(&picture).and_then(|key| key.matte(&picture)),
            key(&screened).and_then(|key| key.matte(&picture)),
            lit(&picture),
        ];
        for matte in found.into_iter().flatten() {
            assert!(matte.mask.pixels.iter().all(|a| (0.0..=1.0).contains(a)));
            assert!((0.0..=1.0).contains(&matte.uncertain));
        }
    }
}

#[test]
fn a_box_is_enough_before_any_background() {
    let mut worst = (1.0_f32, 0.0_f32);
    if let Some(shoot) = test_support::shared("data/stage") {
        for path in files(&shoot.join("interview")).iter().step_by(8) {
            let picture = file::read_encoded(path).unwrap();
            let name = path.file_name().unwrap();
            let truth = file::read_mask(&shoot.join("interview_masks").join(name)).unwrap();
            let (w, h) = picture.0.size();
            let found = boxed(&picture, [0, h / 14, w, h]).unwrap();
            let (iou, off) = scores(&found.mask, &truth);
            println!("{name:?} in a box: IoU {iou:.4}, error {off:.5}");
            worst = (worst.0.min(iou), worst.1.max(off));
        }
    }
    // No screen: grey, and one as warm as the subject; also at twice the size of the cut.
    for (screen, size) in
        [([0.3, 0.3, 0.3], (150, 110)), ([0.25, 0.1, 0.1], (200, 180)), ([0.3, 0.3, 0.3], (1000, 700))]
    {
        let (picture, truth) = round(size, screen, [0.5, 0.35, 0.2]);
        let (w, h) = size;
        let found = boxed(&picture, [w / 10, h / 12, w - w / 5, h]).unwrap();
        let (iou, off) = scores(&found.mask, &truth);
        println!("{screen:?} {size:?}: IoU {iou:.4}, error {off:.5}");
        worst = (worst.0.min(iou), worst.1.max(off));
    }
    assert!(worst.0 >= 0.985 && worst.1 <= 0.01, "{worst:?}");
    shown!(Pictures, "A subject in a box, without any screen",
        bound: "IoU 0.985, mean error 0.01",
        measured: format!("IoU {:.3}, mean error {:.4}", worst.0, worst.1));
}

#[test]
fn a_box_that_says_nothing_ends_in_a_sentence() {
    let (picture, _) = round((60, 40), [0.3; 3], [0.5, 0.35, 0.2]);
    for frame in [[0, 0, 60, 40], [0, 0, usize::MAX, usize::MAX], [5, 5, 0, 0], [100, 100, 5, 5]] {
        let said = boxed(&picture, frame).unwrap_err().to_string();
        assert!(said.contains("60 × 40") && said.contains("Draw the box"), "{said}");
    }
    for (width, height) in [(1, 1), (2, 1), (9, 7)] {
        for value in [0.5, f32::NAN] {
            let even = Encoded(Raster::filled(width, height, [value; 3]));
            if let Ok(matte) = boxed(&even, [0, 0, 1, 1]) {
                assert!(matte.mask.pixels.iter().all(|a| (0.0..=1.0).contains(a)));
            }
        }
    }
    shown!(Pictures, "A box that is empty, outside the picture, or as large as the picture",
        done: "a message says what the box must leave free");
}
