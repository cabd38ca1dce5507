//! A fixed small part of the trials, and properties of the table and its summary.

use crate::faults::{Fault, FaultRow};
use crate::motion::MotionColumns;
use crate::networks::Pair;
use crate::results::{OUTSIDE, Row};
use crate::summary::{Estimate, LEVELS, coverage, exposure, gammas, quantile};
use crate::{faults, page, table, trial};
use chacha20::ChaCha8Rng;
use footage::{Motion, PoseMotion, SeenIn};
use imaging::file::{read_encoded, write_png};
use imaging::{Encoded, Raster};
use rand::SeedableRng;
use std::path::Path;

fn row(seed: u64) -> Row {
    Row {
        seed,
        size: 48,
        light: "window".into(),
        response: "dual".into(),
        gamma1: 2.5,
        found1: 2.55,
        deviation1: 0.1,
        within1: 0.5,
        gamma2: 1.9,
        found2: 2.5,
        deviation2: 0.1,
        within2: OUTSIDE,
        exposure_change: 1.0,
        found_exposure: 1.02,
        exposure_deviation: 0.03,
        refused: String::new(),
        ..Row::default()
    }
}

#[test]
fn the_table_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep/results.csv");
    assert_eq!(table::read::<Row>(&path).unwrap(), []);
    let refused = Row { refused: "the balls show nothing, not even a rim".into(), ..Row::default() };
    let rows = [row(1), row(3), refused];
    table::write(&path, &rows).unwrap();
    let read: Vec<Row> = table::read(&path).unwrap();
    assert_eq!(read[..2], rows[..2]);
    assert_eq!(read[2].refused, "the balls show nothing; not even a rim");
    std::fs::write(&path, "seed,size\n1,many\n").unwrap();
    let error = table::read::<Row>(&path).unwrap_err().to_string();
    assert!(error.contains("results.csv") && error.contains("--fresh"), "{error}");
}

#[test]
fn coverage_counts_what_was_stated() {
    let [first, second] = gammas(&row(1));
    assert!(!first.is_sure_and_wrong() && second.is_sure_and_wrong());
    assert!((exposure(&row(1)).off - 1.02f64.ln()).abs() < 1e-12);
    assert_eq!(LEVELS.map(|level| coverage(&[first, second], level)), [0.5; 3]);
    let nine = Estimate { within: 0.9, ..first };
    assert_eq!(LEVELS.map(|level| coverage(&[nine], level)), [0.0, 1.0, 1.0]);
    // A result without a deviation claims to be exact, without an interval.
    let exact = |off| Estimate { off, deviation: 0.0, within: 0.0 };
    assert!(exact(0.02).is_sure_and_wrong() && !exact(0.005).is_sure_and_wrong());
    assert_eq!(coverage(&[nine, exact(0.02)], 0.9), 1.0);
    assert_eq!(quantile([3.0, 1.0, 2.0], 0.5), 2.0);
}

#[test]
fn the_page_says_what_was_sure_and_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robustness.md");
    let pair = Pair { seed: 1, environment: "nave".into(), found: 29.5, exact: 30.0, ..Pair::default() };
    let fault = |fault, found, named| FaultRow { fault, found, named, ..FaultRow::default() };
    let faults = [
        fault(Fault::None, true, false),
        fault(Fault::None, false, false),
        fault(Fault::Shifted, true, true),
        fault(Fault::BlackInOne, true, false),
    ];
    page::write(&path, &[row(1), row(2)], &faults, &[pair]).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("accused: 1 of 2 (50 %"), "{text}");
    assert!(text.contains("Of 2 faults 100 % are found and 50 % named"), "{text}");
    assert!(text.contains("| OLATs of one pose shifted by one | 1 | 1 | 1 | 0 |"), "{text}");
    assert!(!text.contains("The subject's motion"), "{text}");
    assert!(text.contains("| values of γ (of 4) beyond five stated deviations | 0 | 2 |"), "{text}");
    assert!(text.contains("| 2 | window | dual | 2.50, 1.90 |"));
    assert!(text.contains("costs 0.50 dB in the median"), "{text}");
    for plot in ["gamma", "coverage", "errors", "light", "directions"] {
        assert!(text.contains(&format!("(robustness/{plot}.svg)")));
        let svg = std::fs::read_to_string(folder.path().join(format!("robustness/{plot}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.len() < 100_000 && !svg.contains("NaN"));
    }
}

/// The calibration's estimate for one pose under four lamps.
fn said(pose: &str, largest_px: f32, shifts: Vec<[f32; 4]>) -> PoseMotion {
    PoseMotion { pose: pose.into(), largest_px, deviation_px: 0.25, corrected: !shifts.is_empty(), shifts }
}

#[test]
fn false_alarms_missed_poses_and_what_is_left_of_a_motion_are_counted() {
    let names = ["a", "b", "c", "d"];
    // The face moves 1 pixel right, half of it with the body, and 1 pixel back; in pictures of 50 pixels.
    let half = [0.01f32, 0.0, 0.01, 0.0];
    let there_and_back = vec![half, half, half.map(|v| -v), half.map(|v| -v)];
    let found = |poses| Motion {
        seen_in: SeenIn::Olats,
        // The lighting order differs from the truth's order.
        lamps: ["a", "c", "b", "d"].map(String::from).to_vec(),
        poses,
    };
    let poses =
        vec![said("pose00", 1.0, there_and_back.clone()), said("pose01", 0.6, vec![]), said("pose02", 0.0, vec![])];
    let sway = [[11.0, 5.0], [9.0, 5.0], [11.0, 5.0], [9.0, 5.0]];
    let faint = sway.map(|[x, y]| [0.2 * x, y]);
    let truth = serde_json::json!([sway, sway, faint]);
    let columns = MotionColumns::new(&found(poses.clone()), &truth, &names, 50);
    assert_eq!((columns.poses, columns.moving, columns.missed), (3, 2, 1));
    assert_eq!(columns.false_alarms, 0);
    assert_eq!((columns.within_one, columns.within_two), (2, 3));
    let expected = [(2.04f64 / 3.0).sqrt(), (1.04f64 / 3.0).sqrt()];
    for (is, expected) in [columns.moved_px, columns.left_px].iter().zip(expected) {
        assert!((is - expected).abs() < 1e-6, "{columns:?}");
    }
    let still = MotionColumns::new(&found(poses), &serde_json::json!([]), &names, 50);
    assert_eq!((still.false_alarms, still.moving, still.within_two), (1, 0, 1));
    assert!(still.moved_px == 0.0 && still.left_px > 0.5);

    let rows = [(1.0, columns), (0.0, still)].map(|(sway, motion)| Row { sway, motion, ..row(1) });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robustness.md");
    page::write(&path, &rows, &[], &[]).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    for line in [
        "swayed in 3 of 6 poses",
        "| still poses (of 3) corrected: false alarms | 0 | 1 |",
        "| moving poses (of 2) not corrected: missed | 0 | 1 |",
        "| at most half after | 0.82 and 0.59 |",
        "| 68 / 95 % | 67 / 100 % |",
        "| 68 / 95 % or more | 33 / 33 % |",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    // The table keeps the columns.
    let table = folder.path().join("calibrations.csv");
    table::write(&table, &rows).unwrap();
    let read: Vec<Row> = table::read(&table).unwrap();
    assert_eq!(read[0].motion.missed, 1);
    assert!((read[1].motion.left_px - rows[1].motion.left_px).abs() < 1e-5);
}

#[test]
fn a_trial_is_the_same_each_time() {
    let without_times = |row: Row| Row { seconds: 0.0, shoot_seconds: 0.0, ..row };
    let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let [first, second] = folders.each_ref().map(|shoots| without_times(trial::run(2, 32, shoots.path()).unwrap()));
    assert_eq!(first, second);
    assert!(first.refused.is_empty(), "{first}");
    // An existing shoot is calibrated again.
    let again = trial::run(2, 32, folders[0].path()).unwrap();
    assert_eq!(without_times(again), first);
    assert_eq!(folders[0].path().join("32").read_dir().unwrap().count(), 1);
}

/// Shoots that once had a curve far from the truth with a small deviation: a window, and an exposure changed under a log
/// curve.
#[test]
fn a_wrong_curve_is_stated_as_uncertain() {
    let shoots = tempfile::tempdir().unwrap();
    for seed in [174, 202, 203] {
        let row = trial::run(seed, trial::SIZE, shoots.path()).unwrap();
        assert_eq!(row.refused, "");
        assert!(gammas(&row).iter().all(|gamma| !gamma.is_sure_and_wrong()), "{row}");
    }
}

#[test]
fn a_fault_changes_its_own_files() {
    const LAMPS: u8 = 5;
    // Each OLAT has a brightness of its own, and no OLAT is black.
    let code = |pose: u8, lamp: u8| 10 * pose + lamp + 1;
    let changes = |fault: Fault| {
        let folder = tempfile::tempdir().unwrap();
        let olat = |pose: u8, lamp: u8| folder.path().join(format!("exemplars/pose{pose}")).join(format!("{lamp}.png"));
        for pose in 0..2 {
            std::fs::create_dir_all(olat(pose, 0).parent().unwrap()).unwrap();
            for lamp in 0..LAMPS {
                let picture = Raster::filled(4, 2, [f32::from(code(pose, lamp)) / 255.0; 3]);
                write_png(&olat(pose, lamp), &Encoded(picture)).unwrap();
            }
        }
        std::fs::create_dir(folder.path().join("probes")).unwrap();
        let ball = folder.path().join("probes/0.png");
        write_png(&ball, &Encoded(Raster::from_fn(4, 2, |x, _| [x as f32 / 4.0; 3]))).unwrap();
        faults::put(fault, &mut ChaCha8Rng::seed_from_u64(7), folder.path()).unwrap();
        let first = |path: &Path| 255.0 * read_encoded(path).unwrap().0.at(0, 0)[0];
        let is_changed = |pose: u8, lamp: u8| (first(&olat(pose, lamp)) - f32::from(code(pose, lamp))).abs() > 0.5;
        let changed = |pose: u8| (0..LAMPS).filter(|lamp| is_changed(pose, *lamp)).count();
        let changed = [0, 1].map(changed).into_iter().filter(|olats| *olats > 0);
        (changed.collect::<Vec<_>>(), first(&ball) > 100.0)
    };
    for (fault, changed, mirrored) in [
        (Fault::None, vec![], false),
        (Fault::BlackInOne, vec![1], false),
        (Fault::BlackInAll, vec![1, 1], false),
        (Fault::ExchangedInOne, vec![2], false),
        (Fault::ExchangedInAll, vec![2, 2], false),
        (Fault::Shifted, vec![5], false),
        (Fault::BallsMirrored, vec![], true),
    ] {
        assert_eq!(changes(fault), (changed, mirrored), "{fault:?}");
    }
}
