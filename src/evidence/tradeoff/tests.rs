//! The ladder on a tiny shoot, stopped and continued; choices and fronts on made-up figures.

use super::front::{Pick, front, pick};
use super::ladder::{Facts, order, rungs};
use super::*;
use base::progress::{Control, Progress, Report};
use base::{Error, Result};
use calibration::{CalibrateSettings, Calibration, calibrate};
use footage::{ImportSettings, PictureSize, import};
use project::Project;
use std::path::Path;
use virtual_stage::{StageSettings, write_shoot};

/// A calibrated project of 16 × 16 from a shoot of 32 × 32 with few lamps.
fn project(folder: &Path) -> Result<Project> {
    let (shoot, silent) = (folder.join("shoot"), Progress::silent());
    let stage = StageSettings { frames: 3, size: 32, lamps: 8, ..StageSettings::default() };
    write_shoot(&shoot, &stage, &silent)?;
    let root = folder.join("film");
    let mut project = import(&root, &shoot, &ImportSettings { size: 16, seed: 1, layer: None }, &silent)?;
    calibrate(&mut project, &CalibrateSettings::default(), &silent)?.save(&project)?;
    Project::open(&root)
}

fn facts() -> Facts {
    Facts {
        size: 128,
        source: 256,
        lamps: 41,
        poses: 6,
        has_truth: true,
        environment_columns: 1024,
        precisions: vec![],
    }
}

#[test]
fn every_knob_is_turned_alone_and_the_budget_is_shared_out() {
    let settings = TradeoffSettings { budget: 60.0, ..TradeoffSettings::default() };
    let all = rungs(&facts(), &settings);
    let base = all[0].clone();
    assert_eq!((base.name.as_str(), base.knob), ("base", None));
    let mut names: Vec<&str> = all.iter().map(|rung| rung.name.as_str()).collect();
    for expected in [
        "field=f32",
        "field=8-components",
        "weights=cells",
        "environment=128",
        "effects=glare",
        "minutes=0x",
        "minutes=0.25x",
        "minutes=4x",
        "size=64",
        "size=256",
        "width=8",
        "depth=4",
        "lamps-per-step=8",
        "features=none",
        "steadiness=1",
        "rendering=0.5-to-0",
        "lamps=12",
    ] {
        assert!(names.contains(&expected), "{expected} is not in {names:?}");
    }
    // The base's own values, and sizes beyond the pictures, give no rung.
    for absent in ["field=f16", "size=128", "size=512", "width=16"] {
        assert!(!names.contains(&absent), "{absent}");
    }
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), all.len());
    // Each network is trained once, to the longest time of all settings; two more are reserved for combinations.
    let mut networks = std::collections::BTreeMap::<&str, f64>::new();
    for rung in &all {
        let most = networks.entry(&rung.network.name).or_default();
        *most = most.max(rung.minutes);
    }
    let spent: f64 = networks.values().sum::<f64>() + 2.0 * base.minutes;
    assert!((spent - 60.0).abs() < 1e-9, "{spent}");
    for rung in &all[1..] {
        let changed = (rung.network.config != base.network.config)
            || (rung.network.size, rung.network.lamps) != (base.network.size, base.network.lamps)
            || rung.show != base.show
            || rung.minutes != base.minutes;
        assert!(changed, "{}", rung.name);
        // A network of another shape never shares the base's folder.
        let same_shape = (&rung.network.config, rung.network.size, rung.network.lamps)
            == (&base.network.config, base.network.size, base.network.lamps);
        assert!(same_shape || rung.network.name != "base", "{}", rung.name);
    }
    let few = TradeoffSettings { knobs: vec![Knob::Size], seeds: 3, ..settings };
    let sizes = rungs(&facts(), &few);
    let names: Vec<&str> = sizes.iter().map(|rung| rung.name.as_str()).collect();
    assert_eq!(names, ["base", "size=64", "size=256"]);
    let spent: f64 = sizes.iter().map(|rung| 3.0 * rung.minutes).sum();
    assert!((spent - 60.0).abs() < 1e-9, "{spent}");
}

#[test]
fn the_base_comes_first_with_all_seeds_and_other_seeds_of_other_knobs_last() {
    let all = rungs(&facts(), &TradeoffSettings::default());
    let [sooner, later] = order(&all, 7..10);
    let named = |(rung, seed): &(Rung, u64)| (rung.name.clone(), *seed);
    let first: Vec<(String, u64)> = sooner.iter().take(7).map(named).collect();
    let expected = [
        ("base", 7),
        ("base", 8),
        ("base", 9),
        ("minutes=0x", 7),
        ("minutes=0.25x", 7),
        ("minutes=0.5x", 7),
        ("minutes=2x", 7),
    ];
    assert_eq!(first, expected.map(|(name, seed)| (name.to_owned(), seed)));
    assert!(later.iter().all(|(_, seed)| *seed != 7));
    // Nothing is missing, and nothing comes twice.
    let mut both: Vec<(String, u64)> = sooner.iter().chain(&later).map(named).collect();
    both.sort_unstable();
    both.dedup();
    assert_eq!(both.len(), sooner.len() + later.len());
    assert_eq!(both.len(), 3 * all.len());
}

#[test]
fn a_precision_is_a_rung_where_the_device_knows_it() {
    let facts = Facts { precisions: vec![reflectance::Precision::Full, reflectance::Precision::Mixed], ..facts() };
    let all = rungs(&facts, &TradeoffSettings::default());
    for (name, precision) in
        [("precision=full", reflectance::Precision::Full), ("precision=mixed", reflectance::Precision::Mixed)]
    {
        let rung = all.iter().find(|rung| rung.name == name).unwrap();
        assert_eq!(rung.network.config.precision, precision);
        assert_eq!(rung.network.name, name);
    }
}

#[test]
fn a_ladder_keeps_its_time_and_the_base_is_measured_in_any_case() -> Result<()> {
    let folder = tempfile::tempdir().unwrap();
    let project = project(folder.path())?;
    let settings = TradeoffSettings {
        truth: Some(folder.path().join("shoot")),
        knobs: vec![Knob::Field],
        base_minutes: Some(0.01),
        within: Some(1e-6),
        seeds: 2,
        device: gpu::DeviceChoice::Cpu,
        ..TradeoffSettings::default()
    };
    let report = tradeoff(&project, &settings, &Progress::silent())?;
    let found: Vec<(&str, u64)> = (report.rungs.iter()).map(|m| (m.rung.name.as_str(), m.seed)).collect();
    assert_eq!(found, [("base", 1), ("base", 2)]);
    // However busy the machine is, networks with equal minutes get equal steps.
    assert_eq!(report.rungs[0].steps, report.rungs[1].steps);
    let ledger = Ledger::load(&project)?.unwrap();
    assert!(ledger.left() > 0 && ledger.base_step_ms.is_some());
    assert!(ledger.rungs.iter().all(|m| m.build == evaluation::build()));
    let settings = TradeoffSettings { within: None, ..settings };
    let whole = tradeoff(&project, &settings, &Progress::silent())?;
    assert_eq!(whole.rungs[..2].iter().map(|m| m.timed).collect::<Vec<_>>(), {
        let before = report.rungs.iter();
        before.map(|m| m.timed).collect::<Vec<_>>()
    });
    assert_eq!(Ledger::load(&project)?.unwrap().left(), 0);
    // A ladder trained by the clock is set aside.
    let path = super::folder(&project).join("ladder.json");
    let mut old = Ledger::load(&project)?.unwrap();
    old.base_step_ms = None;
    std::fs::write(&path, serde_json::to_string(&old).unwrap()).unwrap();
    tradeoff(&project, &settings, &Progress::silent())?;
    assert!(project.root.join("tradeoff-aside-1/ladder.json").exists());
    Ok(())
}

/// A rung with these milliseconds and decibels.
fn rung(ms: f64, db: f64) -> Measured {
    let first = rungs(&facts(), &TradeoffSettings::default()).remove(0);
    Measured {
        rung: first,
        seed: 1,
        predicted: None,
        cost: Cost::default(),
        frame: Spread { median: ms, ..Spread::default() },
        predict_ms: 0.0,
        timed: Spread::default(),
        base_ms: ms,
        training_seconds: 0.0,
        steps: 0,
        fidelity: evaluation::Fidelity { psnr_db: db, ..evaluation::Fidelity::default() },
        relit_psnr_db: vec![],
        olat_psnr_db: None,
        changes_db: None,
        flicker: None,
        device: String::new(),
        build: String::new(),
        picture: String::new(),
    }
}

proptest::proptest! {
    #[test]
    fn nothing_beats_the_front_and_each_other_rung_is_beaten(
        places in proptest::collection::vec((1u32..20, 20u32..40), 1..30)
    ) {
        let all: Vec<Measured> =
            places.iter().map(|&(ms, db)| rung(ms.into(), db.into())).collect();
        let on = front(&all);
        let beats = |a: usize, b: usize| {
            let (a, b) = (places[a], places[b]);
            a.0 <= b.0 && a.1 >= b.1 && a != b
        };
        for (i, on) in on.into_iter().enumerate() {
            let beaten = (0..all.len()).any(|j| beats(j, i));
            proptest::prop_assert_eq!(on, !beaten);
        }
        // The choice meets the requirement, and no other rung does so better.
        let picked = pick(&all, Pick::Within(10.0));
        let within = |i: &usize| places[*i].0 <= 10;
        let best = (0..all.len()).filter(within).map(|i| places[i].1).max();
        proptest::prop_assert_eq!(picked.map(|i| places[i].1), best);
        let picked = pick(&all, Pick::AtLeast(30.0));
        let good = |i: &usize| places[*i].1 >= 30;
        let fastest = (0..all.len()).filter(good).map(|i| places[i].0).min();
        proptest::prop_assert_eq!(picked.map(|i| places[i].0), fastest);
    }
}

#[test]
fn a_rung_with_effects_is_neither_on_the_front_nor_picked() {
    let plain = rung(10.0, 30.0);
    let vignette = Measured { changes_db: Some(20.0), ..rung(9.0, 31.0) };
    let all = [plain, vignette];
    assert_eq!(front(&all), [true, false]);
    assert_eq!(pick(&all, Pick::Within(100.0)), Some(0));
    assert_eq!(pick(&all, Pick::AtLeast(40.0)), None);
}

#[test]
fn a_ladder_that_was_stopped_goes_on_and_a_rung_is_taken_over() -> Result<()> {
    let folder = tempfile::tempdir().unwrap();
    let project = project(folder.path())?;
    let before = Calibration::load(&project)?;
    let settings = TradeoffSettings {
        truth: Some(folder.path().join("shoot")),
        knobs: vec![Knob::Field, Knob::Size, Knob::Lamps, Knob::Minutes],
        budget: 0.15,
        device: gpu::DeviceChoice::Cpu,
        ..TradeoffSettings::default()
    };
    // Stopped at the third rung.
    let control = Control::default();
    let stop = control.clone();
    let stopping = move |report: Report| {
        if let Report::Say(said) = report
            && said.starts_with("Setting 3 ")
        {
            stop.stop();
        }
    };
    let stopped = tradeoff(&project, &settings, &Progress::new(&stopping, control));
    assert!(matches!(stopped, Err(Error::Cancelled { .. })));
    let half = Ledger::load(&project)?.unwrap();
    assert_eq!(half.rungs.len(), 2);
    let report = tradeoff(&project, &settings, &Progress::silent())?;
    assert!(report.failures.is_empty(), "{:?}", report.failures);
    for (before, now) in half.rungs.iter().zip(&report.rungs) {
        assert_eq!((&before.rung, before.timed), (&now.rung, now.timed));
    }
    let names: Vec<&str> = report.rungs.iter().map(|m| m.rung.name.as_str()).collect();
    for name in ["base", "field=f32", "size=32", "lamps=6", "minutes=0x", "minutes=2x"] {
        assert!(names.contains(&name), "{name} is not in {names:?}");
    }
    for measured in &report.rungs {
        let name = &measured.rung.name;
        let is_trained = measured.rung.minutes > 0.0;
        assert!(measured.frame.median > 0.0, "{name}");
        assert_eq!(measured.steps > 0, is_trained, "{name}");
        assert!(measured.fidelity.psnr_db > 5.0, "{name}: {:?}", measured.fidelity);
        assert!(measured.cost.memory_bytes > 0, "{name}");
        assert_eq!(measured.cost.disk_bytes > 0, is_trained, "{name}");
        let picture = super::folder(&project).join("pictures").join(&measured.picture);
        assert!(picture.exists(), "{name}");
        // All are compared at the truth's size.
        let size = image::image_dimensions(picture).unwrap();
        assert_eq!(size, (32, 32), "{name}");
        let is_base = name == "base";
        assert_eq!(measured.predicted.is_none(), is_base, "{name}");
    }
    let rung = |name: &str| report.rungs.iter().find(|m| m.rung.name == name).unwrap();
    // Half the bytes cost next to nothing; a larger size and fewer lamps mean other networks.
    let (half, full) = (rung("base"), rung("field=f32"));
    assert!((half.fidelity.psnr_db - full.fidelity.psnr_db).abs() < 0.05);
    assert!(half.cost.memory_bytes < full.cost.memory_bytes);
    assert!(rung("lamps=6").olat_psnr_db.is_none() && full.olat_psnr_db.is_some());
    let table = std::fs::read_to_string(&report.table).unwrap();
    // A round of epochs may exceed the requested steps.
    let [once, twice] = ["base", "minutes=2x"].map(|name| rung(name).steps as f64);
    assert!((twice - 2.0 * once).abs() <= 20.0, "{once} {twice}");
    let none = rung("minutes=0x");
    assert!(none.steps == 0 && none.cost.disk_bytes == 0 && none.fidelity.psnr_db > 15.0);
    assert!(none.cost.memory_bytes > 0 && none.cost.memory_bytes < half.cost.memory_bytes);
    assert!(table.contains("lamps=6"));
    assert_eq!(table.lines().count(), 1 + report.rungs.len());
    let columns = table.lines().next().unwrap().split(',').count();
    assert!(table.contains(&Machine::this().version) && columns > 30);

    // The project itself is unchanged until a rung is applied.
    assert_eq!(Project::open(&project.root)?, project);
    assert!(!project.checkpoint_path().exists());
    let applied = apply(&project, "lamps=6", &Progress::silent())?;
    let changed = Project::open(&project.root)?;
    assert_eq!(changed.settings.shoot.lamps.len(), 6);
    assert!(applied.aside.is_some());
    let predictor = reflectance::Predictor::open(&changed, &gpu::ComputeDevice::choose(settings.device).device)?;
    assert_eq!(predictor.info().network.lamps, 6);
    Calibration::load(&changed)?;
    apply(&changed, "base", &Progress::silent())?;
    let back = Project::open(&project.root)?;
    assert_eq!(back.settings, project.settings);
    assert_eq!(Calibration::load(&back)?.rig, before.rig);
    // Without training the project has no network.
    apply(&back, "minutes=0x", &Progress::silent())?;
    assert!(!project.checkpoint_path().exists());
    // The ladder continues with an applied rung, and nothing is left to measure.
    apply(&back, "size=32", &Progress::silent())?;
    let large = Project::open(&project.root)?;
    assert_eq!(large.settings.size, 32);
    let again = tradeoff(&large, &settings, &Progress::silent())?;
    assert_eq!(again.rungs.len(), report.rungs.len());
    let [first, last] = [&report, &again].map(|report| report.rungs.last().unwrap().timed);
    assert_eq!(first, last);
    let unknown = apply(&large, "size=31", &Progress::silent()).unwrap_err().to_string();
    assert!(unknown.contains("size=31") && unknown.contains("size=32"), "{unknown}");
    Ok(())
}

#[test]
fn a_pose_is_held_out_where_there_is_no_truth_and_other_settings_set_aside() -> Result<()> {
    let folder = tempfile::tempdir().unwrap();
    let project = project(folder.path())?;
    let settings = TradeoffSettings {
        knobs: vec![Knob::Weights, Knob::Effects],
        budget: 0.05,
        device: gpu::DeviceChoice::Cpu,
        ..TradeoffSettings::default()
    };
    let report = tradeoff(&project, &settings, &Progress::silent())?;
    let poses = project.settings.shoot.poses.len();
    let held_out = &project.settings.shoot.poses[poses / 2];
    assert!(report.compared_with.contains(held_out.as_str()), "{}", report.compared_with);
    // Kinds of weights cannot be compared without a truth.
    assert!(report.rungs.iter().all(|m| m.rung.knob != Some(Knob::Weights)));
    let effects: Vec<&Measured> = report.rungs.iter().filter(|m| m.rung.knob == Some(Knob::Effects)).collect();
    assert!(effects.len() > 4 && effects.iter().all(|m| m.changes_db.is_some()));
    assert!(effects.iter().any(|m| m.changes_db.unwrap() < 40.0));
    let other = TradeoffSettings { hold_out: Some(0), knobs: vec![Knob::Field], ..settings.clone() };
    tradeoff(&project, &other, &Progress::silent())?;
    assert!(project.root.join("tradeoff-aside-1/ladder.json").exists());
    let refused = tradeoff(&project, &TradeoffSettings { hold_out: Some(99), ..settings.clone() }, &Progress::silent());
    assert!(refused.unwrap_err().to_string().contains("pose 99"));
    let square = TradeoffSettings { at: PictureSize::Square, ..settings };
    assert!(tradeoff(&project, &square, &Progress::silent()).is_err());
    Ok(())
}
