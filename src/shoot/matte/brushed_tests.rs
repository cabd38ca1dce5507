//! Strokes on mattes with known ground truth.

use super::*;
use crate::key;
use crate::seeds::Side;
use crate::tests::{round, scores};
use test_support::shown;

/// The round subject before a green screen, with a patch of nearly the screen's colour.
fn patched() -> (Encoded, Mask) {
    let (mut picture, truth) = round((220, 160), [0.05, 0.4, 0.1], [0.4, 0.25, 0.2]);
    for y in 70..100 {
        for x in 95..125 {
            picture.0.pixels[y * 220 + x] = [0.27, 0.655, 0.36];
        }
    }
    (picture, truth)
}

#[test]
fn one_stroke_gives_back_a_patch_that_the_key_took_for_screen() {
    let (picture, truth) = patched();
    let keyed = key(&picture).unwrap().matte(&picture).unwrap();
    let before = scores(&keyed.mask, &truth);
    assert!(before.0 < 0.95, "the key alone: {before:?}");
    let mut seeds = Seeds::none(picture.0.size());
    seeds.paint(Side::Keep, 4.0, &[[102.0, 80.0], [118.0, 90.0]]);
    let found = corrected(&picture, &keyed, &seeds).unwrap();
    let after = scores(&found.matte.mask, &truth);
    assert!(after.0 >= 0.985 && after.1 <= 0.01, "{after:?}");
    // Nothing changes far from the stroke.
    for (i, (a, b)) in found.matte.mask.pixels.iter().zip(&keyed.mask.pixels).enumerate() {
        let (x, y) = (i % 220, i / 220);
        if !(80..140).contains(&x) || !(55..115).contains(&y) {
            assert_eq!(a, b, "at {x}, {y}");
        }
    }
    assert!(found.seeds.values().at(110, 72) > 0.5, "changes become seeds for other frames");
    shown!(Pictures, "A patch of the subject nearly as green as the screen",
        bound: "IoU 0.985, mean error 0.01",
        measured: format!("IoU {:.3} without the stroke, {:.3} with it", before.0, after.0));
}

#[test]
fn a_stroke_removes_what_is_no_subject() {
    let (mut picture, truth) = round((220, 160), [0.05, 0.4, 0.1], [0.4, 0.25, 0.2]);
    // A lamp stand before the screen.
    for y in 10..150 {
        picture.0.pixels[y * 220 + 20..y * 220 + 34].fill([0.2, 0.2, 0.25]);
    }
    let keyed = key(&picture).unwrap().matte(&picture).unwrap();
    assert!(keyed.mask.at(26, 80) > 0.9, "the key keeps it");
    let mut seeds = Seeds::none(picture.0.size());
    seeds.paint(Side::Remove, 3.0, &[[27.0, 70.0], [27.0, 95.0]]);
    let found = corrected(&picture, &keyed, &seeds).unwrap().matte.mask;
    let after = scores(&found, &truth);
    assert!(after.0 >= 0.985 && after.1 <= 0.01, "{after:?}");
}

#[test]
fn strokes_alone_cut_out_a_subject_before_any_background() {
    for (screen, subject) in [([0.3, 0.3, 0.3], [0.5, 0.35, 0.2]), ([0.25, 0.1, 0.1], [0.1, 0.15, 0.3])] {
        for size in [(220, 160), (1000, 700)] {
            let (picture, truth) = round(size, screen, subject);
            let at = |x: f32, y: f32| [x * size.0 as f32, y * size.1 as f32];
            let mut seeds = Seeds::none(size);
            let only_one = |seeds: &Seeds| painted(&picture, seeds, None).unwrap_err().to_string();
            assert!(only_one(&seeds).contains("keep"));
            seeds.paint(Side::Keep, 4.0, &[at(0.45, 0.5), at(0.55, 0.7)]);
            assert!(!seeds.hold_both() && only_one(&seeds).contains("Remove"));
            let boxed = painted(&picture, &seeds, Some([size.0 / 6, size.1 / 20, 2 * size.0 / 3, size.1]));
            seeds.paint(Side::Remove, 4.0, &[at(0.05, 0.1), at(0.95, 0.1), at(0.95, 0.9)]);
            for (found, how) in [(boxed, "box"), (painted(&picture, &seeds, None), "strokes")] {
                let (iou, off) = scores(&found.unwrap().mask, &truth);
                assert!(iou >= 0.985 && off <= 0.01, "{how} {size:?}: {iou} {off}");
            }
        }
    }
}

#[test]
fn what_was_painted_is_exactly_so_whatever_the_picture_shows() {
    for size in [(1, 1), (3, 2), (40, 30), (700, 500)] {
        for value in [0.5, f32::NAN] {
            let picture = Encoded(Raster::filled(size.0, size.1, [value; 3]));
            let mut seeds = Seeds::none(size);
            seeds.paint(Side::Keep, 2.0, &[[0.4 * size.0 as f32, 0.5 * size.1 as f32]]);
            seeds.paint(Side::Remove, 0.0, &[[0.0, 0.0], [f32::NAN, 3.0], [1e9, -1e9]]);
            let start = Matte { mask: Mask::filled(size.0, size.1, 0.5), uncertain: 0.0 };
            let found = corrected(&picture, &start, &seeds).unwrap().matte.mask;
            for (alpha, told) in found.pixels.iter().zip(&seeds.values().pixels) {
                assert!((0.0..=1.0).contains(alpha));
                assert!(told.abs() < 1.0 || *alpha == told.max(0.0));
            }
        }
    }
    let other = Encoded(Raster::filled(5, 5, [0.5; 3]));
    let said = painted(&other, &Seeds::none((4, 4)), None).unwrap_err().to_string();
    assert!(said.contains("4 × 4") && said.contains("5 × 5"), "{said}");
}

#[test]
fn the_next_frame_follows() {
    let draw = |dx: f32| {
        let truth = Raster::from_fn(240, 180, |x, y| {
            let (x, y) = (x as f32 + 0.5 - 110.0 - dx, y as f32 + 0.5 - 100.0);
            ((55.0 - x.hypot(y)) / 3.0 + 0.5).clamp(0.0, 1.0)
        });
        let picture = Raster::from_fn(240, 180, |x, y| {
            let a = truth.at(x, y);
            let wave = 0.1 * ((x as f32 - dx) * 0.4).sin() * (y as f32 * 0.3).cos();
            let wall = 0.35 + 0.1 * ((x / 9 + y / 7) % 2) as f32;
            std::array::from_fn(|c| a * ([0.7, 0.5, 0.4][c] + wave) + (1.0 - a) * wall)
        });
        (Encoded(picture), truth)
    };
    let ((first, start), (second, truth)) = (draw(0.0), draw(6.0));
    let flow = crate::Flow::between(&crate::flow_picture(&second), &crate::flow_picture(&first));
    let carried = flow.warped_mask(&start);
    let none = Seeds::none((240, 180));
    let found = followed(&second, &carried, flow.trust(), &none).unwrap();
    let (iou, off) = scores(&found.mask, &truth);
    // The wall is as light as the subject in places.
    assert!(iou >= 0.97 && off <= 0.01, "{iou} {off}");
}
