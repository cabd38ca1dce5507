//! The network compared with MediaPipe's own, and pictures without a person.

use super::*;
use imaging::Raster;
use imaging::file::{read_encoded, write_png};
use std::process::Command;

/// A person as a child draws one: a head with hair and eyes on shoulders, in front of a wall with a window.
fn drawn() -> Encoded {
    let within = |x: i64, y: i64, (cx, cy): (i64, i64), (rx, ry): (i64, i64)| {
        let (dx, dy) = ((x - cx) * ry, (y - cy) * rx);
        dx * dx + dy * dy <= rx * rx * ry * ry
    };
    Encoded(Raster::from_fn(SIDE, SIDE, |x, y| {
        let (x, y) = (x as i64, y as i64);
        let shade = (x - 128) / 4;
        let code = if within(x, y, (106, 110), (7, 4)) || within(x, y, (150, 110), (7, 4)) {
            [40, 30, 30]
        } else if within(x, y, (128, 152), (16, 5)) {
            [150, 70, 70]
        } else if within(x, y, (128, 122), (44, 58)) && y > 84 {
            [205 + shade, 160 + shade, 135 + shade]
        } else if within(x, y, (128, 110), (54, 64)) {
            [60, 45, 35]
        } else if within(x, y, (128, 280), (104, 90)) {
            [70, 80 + shade, 110]
        } else if (20..70).contains(&x) && (20..90).contains(&y) {
            [225, 235, 245]
        } else {
            [150 + y / 8, 150, 140]
        };
        code.map(|v: i64| v as f32 / 255.0)
    }))
}

/// Output of MediaPipe's own package for [`drawn`] at every eighth pixel from (4, 4), written by
/// `tests/peers/person.py`.
const THEIRS: &[u8] = include_bytes!("mediapipe.f32");

fn floats(bytes: &[u8]) -> Vec<f32> {
    let (values, rest) = bytes.as_chunks::<4>();
    assert!(rest.is_empty());
    values.iter().map(|v| f32::from_le_bytes(*v)).collect()
}

fn largest_difference(ours: &[f32], theirs: &[f32]) -> f32 {
    assert_eq!(ours.len(), theirs.len());
    let pairs = ours.iter().zip(theirs);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn it_says_what_mediapipe_said_of_a_drawn_person() {
    let ours = Segmenter::new().unwrap().probability(&drawn()).unwrap();
    let eighth = Raster::from_fn(SIDE / 8, SIDE / 8, |x, y| ours.at(8 * x + 4, 8 * y + 4));
    let theirs = floats(THEIRS);
    let sure = |wanted: fn(f32) -> bool| theirs.iter().filter(|p| wanted(**p)).count();
    assert!(sure(|p| p > 0.9) > 200 && sure(|p| p < 0.1) > 200);
    let off = largest_difference(&eighth.pixels, &theirs);
    assert!(off <= 1e-3, "{off}");
}

#[test]
fn it_says_what_mediapipe_says() {
    let Some(python) = test_support::mediapipe() else { return };
    let script = test_support::repository("tests/peers/person.py");
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let mut pictures = vec![drawn()];
    if let Some(stage) = test_support::shared("data/stage/interview") {
        pictures.extend(["frame_003.png", "frame_029.png"].map(|name| read_encoded(&stage.join(name)).unwrap()));
    }
    let segmenter = Segmenter::new().unwrap();
    for picture in pictures {
        write_png(&file("picture.png"), &picture).unwrap();
        let status = Command::new(&python).args([&script, &file("picture.png"), &file("out.f32")]).status().unwrap();
        assert!(status.success());
        let theirs = floats(&std::fs::read(file("out.f32")).unwrap());
        let ours = segmenter.probability(&picture).unwrap();
        let off = largest_difference(&ours.pixels, &theirs);
        println!("largest difference {off}");
        assert!(off <= 1e-3, "{off}");
    }
}

#[test]
fn any_number_of_threads_says_the_same() {
    let segmenter = Segmenter::new().unwrap();
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| segmenter.probability(&drawn()).unwrap())
    });
    assert_eq!(one, three);
}

#[test]
fn pictures_of_any_size_and_value_are_answered() {
    let segmenter = Segmenter::new().unwrap();
    for (width, height) in [(1, 1), (1, 300), (700, 3), (256, 256)] {
        for value in [0.0, 0.5, 1.0, 7.0, f32::NAN, f32::INFINITY] {
            let picture = Encoded(Raster::filled(width, height, [value; 3]));
            let found = segmenter.probability(&picture).unwrap();
            assert_eq!(found.size(), (SIDE, SIDE));
            assert!(found.pixels.iter().all(|p| (0.0..=1.0).contains(p)));
        }
    }
    let none = Encoded(Raster::filled(0, 5, [0.0; 3]));
    let said = segmenter.probability(&none).unwrap_err().to_string();
    assert!(said.contains("0 × 5"), "{said}");
}
