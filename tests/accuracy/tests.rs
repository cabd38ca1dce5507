//! The page of a ladder that was measured elsewhere: figures are means over seeds, and every rung has its line.

use crate::page::{Bench, Shoot, write};
use crate::poses::{Added, Reached};
use crate::summary::{Figure, steps};
use base::Result;
use base::progress::Progress;
use footage::{ImportSettings, import};
use std::path::Path;
use tradeoff::{Knob, Ledger, TradeoffSettings, tradeoff};

#[test]
fn a_figure_says_its_range_where_seeds_differ() {
    let text = |values: &[f64]| Figure::of(values.iter().copied()).map(|figure| figure.text(1));
    assert_eq!(text(&[1.0, 2.0, 3.0]).unwrap(), "2.0 (1.0 to 3.0)");
    assert_eq!(text(&[2.01, 2.02]).unwrap(), "2.0");
    assert_eq!(text(&[f64::NAN]), None);
}

#[test]
fn every_rung_of_a_ladder_has_its_line_and_its_point() -> Result<()> {
    let folder = tempfile::tempdir().unwrap();
    let ladder = ladder(folder.path())?;
    let scores = |seconds: Option<f64>| {
        serde_json::json!({
            "frames": [1], "relit_psnr_db": {"nave": 20.0}, "olat_psnr_db": null, "frame_ms": 1.5,
            "training_seconds": seconds, "training_steps": seconds.map(|_| 250),
        })
    };
    let methods = vec![("ratio", scores(None)), ("sun", scores(Some(90.0)))];
    let shoot = Shoot {
        name: "small stage".to_owned(),
        size: 16,
        ladder,
        methods,
    };
    let found = steps(&shoot.ladder);
    assert!(found.iter().all(|step| step.seeds.len() == 2));
    assert!(found.iter().any(|step| step.on_front));
    let bench = Bench {
        name: "relight",
        rows: vec!["| size | what |".to_owned(), "|---|---|".to_owned()],
    };
    let page = folder.path().join("accuracy.md");
    let reached = |olats: f64| Reached {
        like: vec![3, 9],
        olats,
        relit: 20.0,
    };
    let added = Added {
        seed: 7,
        minutes: 2.0,
        before: reached(20.0),
        chosen: reached(22.0),
        drawn: vec![reached(21.0), reached(20.0)],
    };
    write(&page, &[shoot], &[added], &[bench])?;
    let text = std::fs::read_to_string(&page).unwrap();
    for expected in [
        "## small stage",
        "| ratio image |",
        "| portrait relighting (Sun 2019) |",
        "| 1.5 min, 250 steps |",
        "| base |",
        "| field=f32 |",
        "(accuracy/small-stage.svg)",
        "## The sum of lamps",
        "| +1.50 / +0.00 |",
        "worth +1.50 dB more",
    ] {
        assert!(text.contains(expected), "{expected} is not in\n{text}");
    }
    // Each line of a table has as many cells as its head.
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
    assert!(
        table.lines().count() > 2 && table.contains(",truth of the small stage,"),
        "{table}"
    );
    Ok(())
}

/// A small ladder of two seeds.
fn ladder(folder: &Path) -> Result<Ledger> {
    use base::Error;
    let silent = Progress::silent();
    let shoot = folder.join("shoot");
    let stage = virtual_stage::StageSettings {
        frames: 3,
        size: 32,
        lamps: 8,
        ..virtual_stage::StageSettings::default()
    };
    virtual_stage::write_shoot(&shoot, &stage, &silent)?;
    let root = folder.join("film");
    let mut project = import(
        &root,
        &shoot,
        &ImportSettings { size: 16, seed: 1 },
        &silent,
    )?;
    let found = calibration::calibrate(
        &mut project,
        &calibration::CalibrateSettings::default(),
        &silent,
    )?;
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
