//! The page of a ladder measured elsewhere: figures are means over seeds, every rung has its line, and missing parts
//! are listed.

use crate::about::About;
use crate::bench::Bench;
use crate::kept::Kept;
use crate::methods::Scored;
use crate::page::{Page, Shoot, builds};
use crate::poses::{Added, Reached};
use crate::summary::{Figure, steps};
use base::Result;
use base::progress::Progress;
use footage::{ImportSettings, import};
use serde_json::{Value, json};
use std::path::Path;
use tradeoff::{Knob, Ledger, TradeoffSettings, tradeoff};

#[test]
fn a_figure_says_its_range_where_seeds_differ() {
    let text = |values: &[f64]| Figure::from_values(values.iter().copied()).map(|figure| figure.text(1));
    assert_eq!(text(&[1.0, 2.0, 3.0]).unwrap(), "2.0 (1.0 to 3.0)");
    assert_eq!(text(&[2.01, 2.02]).unwrap(), "2.0");
    assert_eq!(text(&[f64::NAN]), None);
}

#[test]
fn figures_of_several_builds_are_never_mixed_without_a_word() {
    assert_eq!(builds(["a", "a"].into_iter()), "Build a.");
    let mixed = builds(["b", "a", "a", ""].into_iter());
    assert_eq!(
        mixed,
        "**Builds differ, so figures may not be comparable: older versions (1 figure), a (2 figures), b (1 figure).**"
    );
}

fn kept(result: Value) -> Kept {
    Kept { build: "0badcafe".to_owned(), result }
}

#[test]
fn every_rung_of_a_ladder_has_its_line_and_its_point() -> Result<()> {
    let folder = tempfile::tempdir().unwrap();
    let ladder = ladder(folder.path())?;
    let scored = |method: &'static str, learnt: Option<(u64, f64)>| Scored {
        method,
        learnt,
        kept: kept(json!({
            "frames": [1], "relit_psnr_db": {"nave": 20.0}, "olat_psnr_db": null, "frame_ms": 1.5,
            "training_seconds": 90.0, "training_steps": learnt.map(|(seed, _)| 250 + seed),
        })),
        pictures: folder.path().join(method),
    };
    let methods = vec![
        scored("ratio", None),
        scored("sun", Some((1, 1.5))),
        scored("sun", Some((2, 1.5))),
        scored("sun", Some((1, 6.0))),
    ];
    let shoot =
        Shoot { name: "small stage".to_owned(), size: 16, ladder, methods, networks: Vec::new(), elsewhere: None };
    let found = steps(&shoot.ladder);
    assert!(found.iter().all(|step| step.seeds.len() == 2));
    assert!(found.iter().any(|step| step.on_front));
    let bench = Bench { name: "relight", kept: kept(json!({"machine": {}, "threads": 2, "rows": []})) };
    let page = folder.path().join("accuracy.md");
    let reached = |olats: f64| Reached { like: vec![3, 9], olats, relit: 20.0 };
    let quarter = |within: f64| json!({"said": [0.01, 0.02], "within": [within, 0.9], "cells": 5});
    let added = Added {
        seed: 7,
        minutes: 2.0,
        before: reached(20.0),
        chosen: reached(22.0),
        drawn: vec![reached(21.0), reached(20.0)],
        judged: json!({"frames": 4, "cells_within": [0.81, 0.93], "frames_within": 0.75, "better_by_db": 0.4,
            "quarters": [quarter(0.7), quarter(0.8), quarter(0.85), quarter(0.9)]}),
        builds: vec!["0badcafe".to_owned()],
    };
    let written = Page {
        shoots: vec![shoot],
        added: vec![added],
        benches: vec![bench],
        about: About {
            runs: vec![json!({"minutes": 30.0, "others": 0.1}), json!({"minutes": 10.0, "others": 0.42})],
            build: "feedbeef".to_owned(),
            seeds: 3,
            left_out: vec!["time of each pass".to_owned()],
        },
    };
    written.write(&page)?;
    let text = std::fs::read_to_string(&page).unwrap();
    for expected in [
        "## small stage",
        "| ratio image |",
        "| portrait relighting (Sun 2019) |",
        "| 1.5 min, 252 (251 to 252) steps |",
        "| 6.0 min, 251 steps |",
        "| base |",
        "| field=f32 |",
        "(accuracy/small-stage.svg)",
        "## The sum of lamps",
        "| +1.50 / +0.00 |",
        "worth +1.50 dB more",
        // Missing parts are listed.
        "Measured in 2 runs, 40 minutes in total. Other work took 10 to 42 % of the processor.",
        "**Builds differ",
        "No rung has 3 seeds yet: 2.",
        "Not measured yet and left out: time of each pass.",
        "| seed 7 | 4 | 81 % | 93 % | 75 % | +0.4 | 70 % ≤ 2.0 % | 80 % ≤ 2.0 % |",
    ] {
        assert!(text.contains(expected), "{expected} is not in\n{text}");
    }
    assert!(!text.contains("<!--"), "{text}");
    // Each row of a table has as many cells as its header.
    let mut cells = None;
    for line in text.lines() {
        let count = line.starts_with('|').then(|| line.matches('|').count());
        if let (Some(head), Some(count)) = (cells, count) {
            assert_eq!(count, head, "{line}");
        }
        cells = count;
    }
    let svg = std::fs::read_to_string(folder.path().join("accuracy/small-stage.svg")).unwrap();
    assert!(svg.contains("<svg") && svg.contains("field=f32"), "{svg}");
    let table = std::fs::read_to_string(folder.path().join("accuracy/small-stage.csv")).unwrap();
    assert!(table.lines().count() > 2 && table.contains(",truth of the small stage,"), "{table}");
    Ok(())
}

/// A small ladder of two seeds.
fn ladder(folder: &Path) -> Result<Ledger> {
    use base::Error;
    let silent = Progress::silent();
    let shoot = folder.join("shoot");
    let stage =
        virtual_stage::StageSettings { frames: 3, size: 32, lamps: 8, ..virtual_stage::StageSettings::default() };
    virtual_stage::write_shoot(&shoot, &stage, &silent)?;
    let root = folder.join("film");
    let mut project = import(&root, &shoot, &ImportSettings { size: 16, seed: 1, layer: None }, &silent)?;
    let found = calibration::calibrate(&mut project, &calibration::CalibrateSettings::default(), &silent)?;
    found.save(&project)?;
    let settings = TradeoffSettings {
        truth: Some(shoot),
        knobs: vec![Knob::Field],
        budget: 0.1,
        seeds: 2,
        device: gpu::DeviceChoice::Cpu,
        ..TradeoffSettings::default()
    };
    tradeoff(&project, &settings, &silent)?;
    Ledger::load(&project)?.ok_or_else(|| Error::bug("nothing was measured"))
}
