//! A fixed small part of the trials, and statements about the table and its summary.

use crate::networks::Pair;
use crate::results::{OUTSIDE, Row};
use crate::summary::{Estimate, LEVELS, coverage, exposure, gammas, quantile};
use crate::{page, table, trial};

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
    let refused = Row {
        refused: "the balls show nothing, not even a rim".into(),
        ..Row::default()
    };
    let rows = [row(1), row(3), refused];
    table::write(&path, &rows).unwrap();
    let read: Vec<Row> = table::read(&path).unwrap();
    assert_eq!(read[..2], rows[..2]);
    assert_eq!(read[2].refused, "the balls show nothing; not even a rim");
    std::fs::write(&path, "seed,size\n1,many\n").unwrap();
    let error = table::read::<Row>(&path).unwrap_err().to_string();
    assert!(
        error.contains("results.csv") && error.contains("--fresh"),
        "{error}"
    );
}

#[test]
fn coverage_counts_what_was_stated() {
    let [first, second] = gammas(&row(1));
    assert!(!first.is_sure_and_wrong() && second.is_sure_and_wrong());
    assert!((exposure(&row(1)).off - 1.02f64.ln()).abs() < 1e-12);
    assert_eq!(
        LEVELS.map(|level| coverage(&[first, second], level)),
        [0.5; 3]
    );
    let nine = Estimate {
        within: 0.9,
        ..first
    };
    assert_eq!(
        LEVELS.map(|level| coverage(&[nine], level)),
        [0.0, 1.0, 1.0]
    );
    // A result without a deviation states that it is exact, and no interval.
    let exact = |off| Estimate {
        off,
        deviation: 0.0,
        within: 0.0,
    };
    assert!(exact(0.02).is_sure_and_wrong() && !exact(0.005).is_sure_and_wrong());
    assert_eq!(coverage(&[nine, exact(0.02)], 0.9), 1.0);
    assert_eq!(quantile([3.0, 1.0, 2.0], 0.5), 2.0);
}

#[test]
fn the_page_says_what_was_sure_and_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robustness.md");
    let pair = Pair {
        seed: 1,
        environment: "nave".into(),
        found: 29.5,
        exact: 30.0,
        ..Pair::default()
    };
    page::write(&path, &[row(1), row(2)], &[pair]).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.contains("| values of γ (of 4) beyond five stated deviations | 0 | 2 |"),
        "{text}"
    );
    assert!(text.contains("| 2 | window | dual | 2.50, 1.90 |"));
    assert!(
        text.contains("costs 0.50 dB in the median")
            && text.contains("| 1 | nave | 29.5 | 30.0 | +0.50 |")
    );
    for plot in ["gamma", "coverage", "errors", "light", "directions"] {
        assert!(text.contains(&format!("(robustness/{plot}.svg)")));
        let svg =
            std::fs::read_to_string(folder.path().join(format!("robustness/{plot}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.len() < 100_000 && !svg.contains("NaN"));
    }
}

#[test]
fn a_trial_is_the_same_each_time() {
    let without_times = |row: Row| Row {
        seconds: 0.0,
        shoot_seconds: 0.0,
        ..row
    };
    let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let [first, second] = folders
        .each_ref()
        .map(|shoots| without_times(trial::run(2, 32, shoots.path()).unwrap()));
    assert_eq!(first, second);
    assert!(first.refused.is_empty(), "{first}");
    // A shoot that is there is calibrated again.
    let again = trial::run(2, 32, folders[0].path()).unwrap();
    assert_eq!(without_times(again), first);
    assert_eq!(folders[0].path().join("32").read_dir().unwrap().count(), 1);
}
