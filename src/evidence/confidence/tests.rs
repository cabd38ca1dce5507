//! Distances and relations on known numbers, and the complete estimate on a small shoot.

use super::cells::{Differences, mean_of_cells};
use super::missing::missing;
use super::*;
use base::progress::Progress;
use imaging::{Image, Mask};
use test_shoot::TestShoot;

fn noise(seed: usize) -> f32 {
    (seed.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0 - 0.5
}

#[test]
fn the_frame_farthest_from_all_is_missed_first_and_bad_mattes_are_not() {
    let at = |distance: f64| -> Vec<(usize, f64)> { (0..9).map(|cell| (cell, distance * distance)).collect() };
    let places: [f64; 5] = [0.5, 4.0, 3.9, -2.0, 0.9];
    let mut frames: Vec<_> = places.iter().map(|place| at(place.abs().min((place - 1.0).abs()))).collect();
    // A matte that shows only a corner.
    frames.push(at(99.0)[..3].to_vec());
    let apart = |a: usize, b: usize| Ok::<_, ()>(at(places[a] - places[b]));
    assert_eq!(missing(frames.clone(), 2, apart), Ok(vec![1, 3]));
    assert_eq!(missing(frames, 0, apart), Ok(Vec::new()));
    let known = vec![at(0.0), at(0.0)];
    assert_eq!(missing(known, 3, apart), Ok(Vec::new()));
    let refused = missing(vec![at(1.0), at(2.0)], 2, |_, _| Err("stopped"));
    assert_eq!(refused, Err("stopped"));
}

/// A cell at a distance, with a spread of 1.
fn far(distance: f64) -> Sign {
    Sign { distance, spread: 1.0 }
}

/// Poses whose errors follow a law, each with its own factor.
fn poses_by(law: impl Fn(f64) -> f64, factors: &[f64]) -> Vec<PoseErrors> {
    with_spreads(|distance, _| law(distance), factors, |_| 1.0)
}

/// The same with distance and spread; spreads are independent of distances.
fn with_spreads(law: impl Fn(f64, f64) -> f64, factors: &[f64], spread: impl Fn(usize) -> f64) -> Vec<PoseErrors> {
    let pose = |(k, factor): (usize, &f64)| {
        let distances: Vec<f64> =
            (0..200).map(|i| (0.1 + 0.01 * i as f64) * (1.0 + 0.2 * f64::from(noise(i + 999 * k)))).collect();
        let noise = |i: usize| (f64::from(noise(31 * i + k))).exp();
        let squares = distances.iter().enumerate();
        PoseErrors {
            squared_errors: (squares).map(|(i, d)| (factor * law(*d, spread(i)) * noise(i)).powi(2)).collect(),
            signs: (distances.iter().enumerate())
                .map(|(i, distance)| Sign { distance: *distance, spread: spread(i) })
                .collect(),
            lamps: LampErrors::default(),
        }
    };
    factors.iter().enumerate().map(pose).collect()
}

#[test]
fn a_relation_is_found_and_holds_for_the_asked_share_of_every_pose() {
    let factors = [1.0, 0.7, 1.4, 1.1, 0.9];
    let poses = poses_by(|d| 0.02 * d.powf(0.8), &factors);
    let relation = Relation::learn(&poses, 0.8).unwrap();
    let growth = relation.cells(far(1.0))[0] / relation.cells(far(0.5))[0];
    assert!((growth / 2f64.powf(0.8) - 1.0).abs() < 0.05, "{growth}");
    assert!((relation.chance() - 5.0 / 6.0).abs() < 1e-12);
    let mut halves = 0;
    for pose in &poses {
        let pairs = || pose.signs.iter().zip(&pose.squared_errors);
        let share = |which: usize| {
            let within = pairs().filter(|(s, e)| e.sqrt() <= relation.cells(**s)[which] * (1.0 + 1e-9));
            within.count() as f64 / pose.signs.len() as f64
        };
        assert!(share(1) >= 0.8, "{}", share(1));
        halves += usize::from(share(0) >= 0.8);
        let mean = pairs().map(|(_, e)| e).sum::<f64>() / pose.signs.len() as f64;
        let [usual, least] = relation.decibels(pose.signs.iter().copied()).unwrap();
        assert!(-10.0 * mean.log10() >= least - 1e-9 && usual >= least);
    }
    assert_eq!(halves, 3);
    // A greater distance never gives a smaller error.
    let falling = Relation::learn(&poses_by(|d| 0.02 / d, &factors), 0.8).unwrap();
    assert!(falling.cells(far(2.0))[0] >= falling.cells(far(0.5))[0]);
    assert!(Relation::learn(&poses[..1], 0.8).is_none());
    let broken = PoseErrors {
        signs: vec![far(f64::NAN), far(0.0)],
        squared_errors: vec![1.0, f64::NAN],
        lamps: LampErrors::default(),
    };
    assert!(Relation::learn(&[broken.clone(), broken], 0.8).is_none());
    let zero = PoseErrors { signs: vec![far(0.0); 9], squared_errors: vec![0.0; 9], lamps: LampErrors::default() };
    let zero = Relation::learn(&[zero.clone(), zero], 0.8).unwrap();
    assert!(zero.cells(far(0.0))[1].is_finite() && zero.decibels([far(0.0)].into_iter()).unwrap()[0].is_finite());
    test_support::shown!(Network, "Confidence from poses without error, at zero distance, with NaN, or from a single pose",
 bound: "finite, and growing with distance", measured: "holds");
}

#[test]
fn what_was_said_is_counted_where_little_and_where_much_was_said() {
    let factors = [1.0, 0.7, 1.4, 1.1, 0.9];
    let relation = Relation::learn(&poses_by(|d| 0.02 * d.powf(0.8), &factors), 0.8).unwrap();
    // Frames that follow the same law as the poses.
    let alike = Judged::new(&relation, None, &poses_by(|d| 0.02 * d.powf(0.8), &[1.0])).unwrap();
    for quarter in alike.quarters {
        let [usual, promised] = quarter.within;
        assert!((0.6..0.95).contains(&usual) && promised >= usual, "{quarter:?}");
    }
    let cells: usize = alike.quarters.iter().map(|quarter| quarter.cells).sum();
    assert_eq!(cells, 200);
    let said = alike.quarters.map(|quarter| quarter.said);
    assert!(said.windows(2).all(|pair| pair[0][1] <= pair[1][0]), "{said:?}");
    // Frames that are as wrong near the poses as far from them: the mean over all cells hides this.
    let even = Judged::new(&relation, None, &poses_by(|_| 0.02, &[1.0])).unwrap();
    let [near, .., far] = even.quarters.map(|quarter| quarter.within[0]);
    assert!(near < 0.5 && far > 0.9, "{near} {far}");
}

#[test]
fn the_spread_of_the_exemplars_tells_where_they_err() {
    let factors = [1.0, 0.7, 1.4];
    let spread = |i: usize| 0.02 + 0.001 * (i * 37 % 200) as f64;
    let law = |d: f64, s: f64| 0.3 * d.powf(0.5) * s.powf(0.9);
    let relation = Relation::learn(&with_spreads(law, &factors, spread), 0.8).unwrap();
    let at = |distance, spread| relation.cells(Sign { distance, spread })[0];
    let growth = at(1.0, 0.2) / at(1.0, 0.1);
    assert!((growth / 2f64.powf(0.9) - 1.0).abs() < 0.05, "{growth}");
    let growth = at(1.0, 0.1) / at(0.5, 0.1);
    assert!((growth / 2f64.powf(0.5) - 1.0).abs() < 0.07, "{growth}");
}

#[test]
fn errors_are_those_of_the_measure() {
    let truth = vec![Image::from_fn(32, 32, |x, y| [noise(x + 40 * y) + 0.6; 3]); 2];
    let mask = Mask::from_fn(32, 32, |x, _| f32::from(u8::from(x >= 16)));
    // Doubled light is one common factor, which is removed.
    let twice: Vec<Image> = (truth.iter())
        .map(|image| Image { pixels: image.pixels.iter().map(|p| p.map(|v| 2.0 * v)).collect(), ..*image })
        .collect();
    let none = Differences::new(&twice, &truth, &mask);
    assert!(none.cells.iter().chain(&none.lamps).all(|e| *e < 1e-10));
    let mut other = truth.clone();
    for (i, pixel) in other[0].pixels.iter_mut().enumerate() {
        *pixel = pixel.map(|v| v * (1.0 + 0.2 * noise(3 * i)));
    }
    let compared = evaluation::metrics::Compared { pictures: &other, truths: &truth, mask: &mask };
    let Differences { cells, lamps } = Differences::new(&other, &truth, &mask);
    let covered = mean_of_cells(&mask, |alpha| f64::from(*alpha));
    let inside = cells.iter().zip(&covered).filter(|(_, a)| **a > 0.0);
    let inside: Vec<f64> = inside.map(|(e, _)| *e).collect();
    let mean = inside.iter().sum::<f64>() / inside.len() as f64;
    // The common factor makes the other lamp slightly wrong too.
    assert!(lamps[0] > 100.0 * lamps[1], "{lamps:?}");
    assert!((0.5 * (lamps[0] + lamps[1]) / mean - 1.0).abs() < 1e-6);
    let db = evaluation::metrics::psnr(&[compared]).unwrap().mean_db;
    assert!((db + 10.0 * mean.log10()).abs() < 0.05, "{db} {}", -10.0 * mean.log10());
}

#[test]
fn a_small_shoot_has_its_confidence_which_ages_with_the_calibration() {
    let folder = tempfile::tempdir().unwrap();
    let (project, mut calibration) = TestShoot::default().calibrate(folder.path(), "project");
    let silent = Progress::silent();
    let settings =
        ConfidenceSettings { poses: 2, truth: Some(folder.path().join("shoot")), ..ConfidenceSettings::default() };
    assert!(ConfidenceReport::load(&project).unwrap().is_none());
    let report = confidence(&project, &settings, &silent).unwrap();
    let poses = project.settings.shoot.poses.len();
    assert_eq!((report.pose_distances.len(), report.left_out.len()), (poses, poses));
    assert_eq!((report.frames.len(), report.missing.len()), (3, 2));
    assert_eq!(report.relation.unwrap().poses, poses);
    for frame in &report.frames {
        let expected = frame.expected.unwrap();
        assert!(expected.psnr_db.is_finite() && expected.at_least_db <= expected.psnr_db);
        assert!(frame.pose.is_some_and(|pose| pose < poses) && frame.distance > 0.0);
        assert_eq!((frame.cells.len(), frame.errors.len()), (SIDE * SIDE, SIDE * SIDE));
        assert_eq!(frame.lamps.len(), project.settings.shoot.lamps.len());
        assert!(frame.worst_lamp().unwrap().1 <= expected.psnr_db as f32);
    }
    assert!(report.sentence().contains("dB expected"), "{}", report.sentence());
    // A bound only holds for frames like the poses, in light that the lamps cover.
    let promises = |far: f32, uncovered: f32| {
        let mut report = report.clone();
        (report.far, report.uncovered) = (far, uncovered);
        let promised = report.frames.iter().filter_map(|frame| report.promised(frame));
        (promised.count(), report.sentence())
    };
    let (all, sentence) = promises(f32::MAX, 0.0);
    assert!(all == 3 && sentence.contains("at least"), "{sentence}");
    let (none, sentence) = promises(f32::MAX, 0.3);
    assert!(none == 0 && sentence.contains("They may be worse: 30 %"), "{sentence}");
    let (none, sentence) = promises(0.0, 0.0);
    assert!(none == 0 && sentence.contains("It may be worse"), "{sentence}");
    let judged = report.judged.unwrap();
    assert!(judged.frames > 0 && judged.correlation.is_finite());
    let worst = report.worst_olats();
    assert!(worst.len() == 3 && worst.windows(2).all(|pair| pair[0].2 <= pair[1].2));
    let (kept, fits) = ConfidenceReport::load(&project).unwrap().unwrap();
    assert!(fits);
    assert_eq!((&kept.missing, kept.sentence()), (&report.missing, report.sentence()));
    // New mattes make it old.
    let matte = project.frame_matte(0).file().to_owned();
    let before = std::fs::read(&matte).unwrap();
    std::fs::write(&matte, b"another").unwrap();
    assert!(!ConfidenceReport::load(&project).unwrap().unwrap().1);
    std::fs::write(&matte, before).unwrap();
    let again = confidence(&project, &settings, &silent).unwrap();
    assert_eq!(again.left_out, report.left_out);

    calibration.exposure *= 2.0;
    calibration.save(&project).unwrap();
    assert!(!ConfidenceReport::load(&project).unwrap().unwrap().1);
    std::fs::write(ConfidenceReport::path(&project), "{").unwrap();
    let broken = ConfidenceReport::load(&project).unwrap_err().to_string();
    assert!(broken.contains("confidence.json"), "{broken}");
}
