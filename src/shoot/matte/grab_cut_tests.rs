use super::super::mixture::start_for_opencv;
use super::*;
use imaging::file::{read_encoded, read_mask, write_mask_png, write_png};
use std::process::Command;

/// A disc of warm stripes before a cold, noisy ramp, drawn from a seed, and the true disc.
fn drawn(width: usize, height: usize, seed: u32) -> (Encoded, Raster<bool>) {
    let noise = |x: usize, y: usize, c: usize| {
        let key = [x, y, c, seed as usize];
        let mixed = key.iter().fold(0x9e37_79b9_u32, |h, &v| (h ^ v as u32).wrapping_mul(0x85eb_ca6b).rotate_left(13));
        (mixed >> 8) as f32 / 16_777_216.0 - 0.5
    };
    let (middle_x, middle_y) = (0.5 * width as f32, 0.55 * height as f32);
    let radius = (0.26 + 0.02 * (seed % 5) as f32) * width.min(height) as f32;
    let inside =
        Raster::from_fn(width, height, |x, y| (x as f32 + 0.5 - middle_x).hypot(y as f32 + 0.5 - middle_y) < radius);
    let picture = Raster::from_fn(width, height, |x, y| {
        let color = if inside.at(x, y) {
            let stripe = if (x / 5 + y / 9) % 2 == 0 { 0.1 } else { -0.1 };
            [0.65 + stripe, 0.4, 0.3 - stripe]
        } else {
            [0.25, 0.35 + 0.3 * y as f32 / height as f32, 0.5]
        };
        std::array::from_fn(|c| unit(color[c] + 0.12 * noise(x, y, c)))
    });
    (Encoded(picture), inside)
}

/// Intersection over union of two regions.
fn overlap(a: &Raster<bool>, b: &Raster<bool>) -> f64 {
    let count = |f: fn(bool, bool) -> bool| {
        let pairs = a.pixels.iter().zip(&b.pixels);
        pairs.filter(|p| f(*p.0, *p.1)).count() as f64
    };
    count(|a, b| a && b) / count(|a, b| a || b).max(1.0)
}

/// All but a border of a picture.
fn within_border(size: (usize, usize), border: usize) -> Raster<Mark> {
    let (width, height) = size;
    rectangle(size, [border, border, width - 2 * border, height - 2 * border])
}

/// Interview frames of the shared shoot with their mattes; empty if it is missing.
fn interview(frames: &[usize]) -> Vec<(Encoded, Raster<bool>)> {
    let Some(stage) = test_support::shared("data/stage") else { return Vec::new() };
    let frame = |i: &usize| {
        let name = format!("frame_{i:03}.png");
        let matte = read_mask(&stage.join("interview_masks").join(&name)).unwrap();
        let picture = read_encoded(&stage.join("interview").join(&name)).unwrap();
        (picture, matte.map(|alpha| alpha > 0.5))
    };
    frames.iter().map(frame).collect()
}

/// A box around a person cut off by the lower border.
fn person_box((width, height): (usize, usize)) -> Raster<Mark> {
    let top = height / 14;
    let mut marks = rectangle((width, height), [0, top, width, height]);
    for (i, mark) in marks.pixels.iter_mut().enumerate() {
        let (x, y) = (i % width, i / width);
        if (x < width / 12 || x >= width - width / 12) && y < 3 * height / 4 {
            *mark = Mark::Background;
        }
    }
    marks
}

#[test]
fn it_cuts_as_opencv_does() {
    let Some(python) = test_support::python(&["cv2", "numpy"]) else { return };
    let script = test_support::repository("tests/peers/grab_cut.py");
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let drawn = [(120, 90, 1), (64, 200, 2), (150, 150, 3), (97, 61, 4)]
        .map(|(width, height, seed)| drawn(width, height, seed).0)
        .map(|picture| {
            let marks = within_border(picture.0.size(), 6);
            (picture, marks)
        });
    let filmed = interview(&[0, 7, 13, 20, 27, 34]).into_iter().map(|(picture, _)| {
        let marks = person_box(picture.0.size());
        (picture, marks)
    });
    for (i, (picture, marks)) in drawn.into_iter().chain(filmed).enumerate() {
        let labels = marks.map(|mark| match mark {
            Mark::Background => 0.0,
            Mark::Subject => 1.0 / 255.0,
            Mark::MaybeBackground => 2.0 / 255.0,
            Mark::MaybeSubject => 3.0 / 255.0,
        });
        write_png(&file("picture.png"), &picture).unwrap();
        write_mask_png(&file("marks.png"), &labels).unwrap();
        // Both read the same codes and start with the same colours: OpenCV's own start is random, and its result
        // differs by a tenth between starts.
        let picture = read_encoded(&file("picture.png")).unwrap();
        let codes = picture.0.map(|p| p.map(|v| f64::from(v) * 255.0));
        let start = [false, true].map(|subject| {
            let sides = codes.pixels.iter().zip(&marks.pixels);
            let side = sides.filter(|s| s.1.is_subject() == subject).map(|s| *s.0);
            start_for_opencv(&side.collect::<Vec<_>>())
        });
        let bytes: Vec<u8> = start.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        std::fs::write(file("start.f64"), bytes).unwrap();
        let mut peer = Command::new(&python);
        peer.arg(&script).args(["picture.png", "marks.png", "start.f64"].map(file));
        peer.arg("5").arg(file("out.png"));
        assert!(peer.status().unwrap().success());
        let theirs = read_mask(&file("out.png")).unwrap().map(|v| v > 0.5);
        let ours = grab_cut(&picture, &marks, 5).unwrap();
        let alike = overlap(&ours.subject, &theirs);
        println!("picture {i}: overlap {alike:.4} in {} rounds", ours.rounds);
        assert!(alike >= 0.98, "picture {i}: {alike}");
    }
}

#[test]
fn a_box_around_a_filmed_person_is_enough() {
    for (i, (picture, truth)) in interview(&[0, 9, 18, 27, 36]).into_iter().enumerate() {
        let marks = person_box(picture.0.size());
        let found = grab_cut(&picture, &marks, 8).unwrap();
        let overlap = overlap(&found.subject, &truth);
        println!("frame {i}: overlap {overlap:.4}");
        assert!(overlap >= 0.985, "frame {i}: {overlap}");
    }
}

#[test]
fn a_box_around_a_drawn_disc_is_enough_on_any_number_of_threads() {
    for seed in 0..6 {
        let (picture, truth) = drawn(120, 100, seed);
        let marks = within_border(picture.0.size(), 5);
        let found = grab_cut(&picture, &marks, 8).unwrap();
        let overlap = overlap(&found.subject, &truth);
        assert!(overlap >= 0.985, "seed {seed}: {overlap}");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3);
        let again = pool.build().unwrap().install(|| grab_cut(&picture, &marks, 8));
        let again = again.unwrap();
        assert_eq!(again.subject, found.subject);
        assert_eq!(again.margin, found.margin);
    }
}

#[test]
fn what_a_person_marked_stays() {
    let (picture, inside) = drawn(80, 80, 3);
    let mut marks = within_border(picture.0.size(), 5);
    // Part of the disc is to be removed, part of the ramp kept.
    for y in 40..46 {
        for x in 36..42 {
            assert!(inside.at(x, y));
            marks.pixels[y * 80 + x] = Mark::Background;
            marks.pixels[(y - 32) * 80 + x - 20] = Mark::Subject;
        }
    }
    let found = grab_cut(&picture, &marks, 5).unwrap();
    for (i, mark) in marks.pixels.iter().enumerate() {
        match mark {
            Mark::Background => assert!(!found.subject.pixels[i]),
            Mark::Subject => assert!(found.subject.pixels[i]),
            _ => assert!(found.margin.pixels[i].is_finite()),
        }
    }
}

#[test]
fn pictures_and_marks_that_say_nothing_end_in_a_sentence() {
    let (picture, _) = drawn(20, 20, 1);
    for (mark, missing) in [(Mark::MaybeSubject, "background"), (Mark::MaybeBackground, "subject")] {
        let said = grab_cut(&picture, &Raster::filled(20, 20, mark), 5).unwrap_err();
        assert!(said.to_string().contains(missing), "{said}");
    }
    let other = Raster::filled(19, 20, Mark::MaybeSubject);
    let said = grab_cut(&picture, &other, 5).unwrap_err().to_string();
    assert!(said.contains("19 × 20") && said.contains("20 × 20"), "{said}");
    let large = Encoded(Raster::filled(MAX_PIXELS + 1, 1, [0.5; 3]));
    let marks = Raster::filled(MAX_PIXELS + 1, 1, Mark::MaybeSubject);
    let said = grab_cut(&large, &marks, 5).unwrap_err().to_string();
    assert!(said.contains("too large"), "{said}");
    let none = Encoded(Raster::filled(0, 0, [0.0; 3]));
    assert!(grab_cut(&none, &Raster::filled(0, 0, Mark::Subject), 5).is_err());
    test_support::shown!(Pictures, "A cut-out without marks, or with marks of another picture",
        done: "a message names the missing marks and the remedy");
}

#[test]
fn even_pictures_nan_and_single_rows_are_cut_by_their_marks_alone() {
    for value in [0.0, 0.5, 1.0, f32::NAN, f32::INFINITY, -1.0] {
        for (width, height) in [(2, 1), (1, 7), (9, 6)] {
            let picture = Encoded(Raster::filled(width, height, [value; 3]));
            let mut marks = Raster::filled(width, height, Mark::MaybeBackground);
            marks.pixels[0] = Mark::Subject;
            *marks.pixels.last_mut().unwrap() = Mark::Background;
            let found = grab_cut(&picture, &marks, 5).unwrap();
            assert!(found.subject.pixels[0]);
            assert!(!found.subject.pixels.last().unwrap());
            assert!(found.margin.pixels.iter().all(|margin| !margin.is_nan()));
        }
    }
    test_support::shown!(Pictures, "A cut-out of a uniform picture, of NaN, or of one row",
        done: "the marks alone decide");
}
