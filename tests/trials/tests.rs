//! A fixed small part of the trials, and statements about the table and its summary.

use crate::page;
use crate::results::{Results, Row};
use crate::summary::{Estimate, LEVELS, coverage, exposure, gammas, normal_deviations, quantile};
use crate::trial;

fn row(seed: u64) -> Row {
    Row {
        seed,
        size: 48,
        light: "window".into(),
        response: "dual".into(),
        gamma1: 2.5,
        found1: 2.55,
        deviation1: 0.1,
        gamma2: 1.9,
        found2: 2.5,
        deviation2: 0.1,
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
    assert_eq!(Results::read(&path).unwrap(), Results::default());
    let refused = Row {
        refused: "the balls show nothing, not even a rim".into(),
        ..Row::default()
    };
    let results = Results {
        rows: vec![row(1), row(3), refused],
    };
    results.write(&path).unwrap();
    let read = Results::read(&path).unwrap();
    assert_eq!(read.rows[..2], results.rows[..2]);
    assert_eq!(
        read.rows[2].refused,
        "the balls show nothing; not even a rim"
    );
    assert!(read.has(3, 48) && !read.has(2, 48) && !read.has(3, 64));
    std::fs::write(&path, "seed,size\n1,many\n").unwrap();
    let error = Results::read(&path).unwrap_err().to_string();
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
    let estimates = [first, second];
    assert_eq!(LEVELS.map(|(_, d)| coverage(&estimates, d)), [0.5; 3]);
    // A result without a deviation states that it is exact.
    let exact = |off| Estimate {
        off,
        deviation: 0.0,
    };
    assert!(exact(0.02).is_sure_and_wrong() && !exact(0.005).is_sure_and_wrong());
    for (level, deviations) in LEVELS {
        assert!((normal_deviations(level) - deviations).abs() < 1e-5);
    }
    assert_eq!(quantile([3.0, 1.0, 2.0], 0.5), 2.0);
}

#[test]
fn the_page_says_what_was_sure_and_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robustness.md");
    page::write(
        &path,
        &Results {
            rows: vec![row(1), row(2)],
        },
    )
    .unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.contains("| values of γ (of 4) beyond five stated deviations | 0 | 2 |"),
        "{text}"
    );
    assert!(text.contains("| 2 | window | dual | 2.50, 1.90 |"));
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
    let [first, second] = [2, 2].map(|seed| without_times(trial::run(seed, 32).unwrap()));
    assert_eq!(first, second);
    assert!(first.refused.is_empty(), "{first}");
}
