//! Tests of predicted times and left-out measures, without measuring.

use super::measure::{Figure, Measure};
use super::names::{PASSES, PICTURES, PREDICTION, STEP};
use super::plan::{Planned, plan};
use super::process::{Ended, Measuring};
use super::report::{DeviceReport, Row};
use super::{Budget, LAMPS, Spread};
use base::progress::{Control, Progress};
use std::process::Command;
use std::time::{Duration, Instant};
use test_support::shown;
use training::Preset;

fn row(what: &str, network: Option<&str>, size: usize, ms: f64) -> Row {
    Row {
        what: what.to_owned(),
        network: network.map(str::to_owned),
        size: Some(size),
        median_ms: Some(ms),
        low_ms: Some(0.9 * ms),
        high_ms: Some(1.2 * ms),
        runs: 9,
        ..Row::default()
    }
}

#[test]
fn a_spread_is_of_the_times_in_any_order() {
    let spread = Spread::from_times((1..=101).rev().map(f64::from).collect());
    assert_eq!((spread.low_ms, spread.median_ms, spread.high_ms), (6.0, 51.0, 96.0));
    let mut runs = 0;
    let budget = Budget::seconds(0.0, 50);
    let times = budget.time(|| {
        runs += 1;
        Ok(())
    });
    assert_eq!((times.unwrap().len(), runs), (3, 3), "at least three runs, whatever the time");
}

#[test]
fn networks_are_predicted_by_their_multiplications_and_pictures_by_their_pixels() {
    let adds = |size| Preset::Quick.config().network_of(size, LAMPS).cost().multiply_adds as f64;
    let known = [row(STEP, Some("quick"), 128, 100.0), row(PREDICTION, Some("quick"), 128, 20.0)];
    let larger = Measure::Network { preset: Preset::Quick, size: 256 };
    let found = larger.predicted(&known).unwrap();
    let ratio = adds(256) / adds(128);
    assert!(ratio > 3.5 && ratio < 4.5, "{ratio}");
    assert!((found[0] - 100.0 * ratio).abs() < 1e-6 && (found[1] - 20.0 * ratio).abs() < 1e-6);
    let other = Measure::Network { preset: Preset::Paper, size: 128 };
    assert!(other.predicted(&known).unwrap()[0] > 200.0, "by another network");
    assert_eq!(larger.predicted(&[]), None);

    let picture = |size| Measure::Picture { preset: Preset::Quick, working: 512, size };
    let known = [
        row(PICTURES[0], Some("quick"), 512, 110.0),
        row(PICTURES[1], Some("quick"), 512, 10.0),
        row(PICTURES[2], Some("quick"), 512, 5.0),
    ];
    assert_eq!(picture(1024).predicted(&known), Some(vec![140.0, 40.0, 20.0]));
}

#[test]
fn an_aim_is_said_where_there_is_one() {
    let frame = row(PICTURES[0], Some("quick"), 512, 16.0).with_goal();
    assert_eq!(frame.reached, Some(true));
    let slow = row(PICTURES[0], Some("quick"), 512, 17.0).with_goal();
    assert_eq!(slow.reached, Some(false));
    assert_eq!(row(PICTURES[0], Some("quick"), 1024, 16.0).with_goal().goal, None);
    let sum = |ms| Row { copy_ms: Some(1.0), ..row("relight", None, 512, ms) }.with_goal().reached;
    assert_eq!((sum(1.2), sum(1.4)), (Some(true), Some(false)));
    let half = Row { copy_ms: Some(1.0), ..row("relight, f16", None, 512, 1.2) };
    assert_eq!(half.with_goal().reached, Some(true));
}

#[test]
fn the_important_comes_first_and_on_a_gpu_before_the_cpu() {
    let planned = plan(true);
    for planned in &planned {
        let measure = planned.measure;
        assert!(!measure.rows().is_empty() && planned.need() > 0.0);
        let text = serde_json::to_string(&measure).unwrap();
        assert_eq!(serde_json::from_str::<Measure>(&text).unwrap(), measure);
        assert_eq!(measure.bytes() == 0, measure == Measure::SelfTest);
        assert_eq!(plan(false).contains(planned), !planned.on_gpu);
    }
    let place = |on_gpu, measure| {
        let sought = Planned { on_gpu, measure };
        planned.iter().position(|p| *p == sought).unwrap()
    };
    let network = |preset, size| Measure::Network { preset, size };
    let quick = network(Preset::Quick, 128);
    assert_eq!(place(true, Measure::SelfTest), 0);
    assert!(place(true, Measure::Passes { size: 512 }) < place(true, quick));
    assert!(place(true, quick) < place(false, quick));
    assert!(place(false, quick) < place(true, network(Preset::Paper, 512)));
    // The second start follows the first and finds its kernels; no other measure leaves any there.
    let fresh: Vec<Measure> = (planned.iter().filter(|p| p.starts_fresh())).map(|p| p.measure).collect();
    assert_eq!(fresh, [quick, Measure::FirstUse { size: 128 }]);
}

fn gpu() -> DeviceReport {
    DeviceReport::new("gpu", "a card")
}

fn figure(what: &str, first_ms: f64, median_ms: Option<f64>) -> Figure {
    Figure {
        what: what.to_owned(),
        first_ms: Some(first_ms),
        times: median_ms.map(|ms| Spread::from_times(vec![ms; 3])),
        ..Figure::default()
    }
}

#[test]
fn a_measure_that_is_late_keeps_what_it_had_timed() {
    let mut device = gpu();
    let quick = Measure::Network { preset: Preset::Quick, size: 256 };
    device.found(&quick, false, figure(STEP, 9000.0, None));
    let row = device.found(&quick, false, figure(STEP, 8990.0, Some(10.0)));
    assert_eq!(
        device.sentence(&device.rows[row]),
        "GPU: training step (quick) at 256 pixels: 10.0 (10.0–10.0) ms; the first run took 9.0 s more"
    );
    device.found(&quick, false, figure(PREDICTION, 4000.0, None));
    device.leave_out(&quick, None, "it was late");
    let [step, prediction] = &device.rows[..] else {
        panic!("{:?}", device.rows);
    };
    assert_eq!((step.median_ms, &step.left_out), (Some(10.0), &None));
    assert_eq!((prediction.median_ms, prediction.first_ms), (None, Some(4000.0)));
    assert_eq!(prediction.left_out.as_deref(), Some("it was late"));

    let passes = Measure::Passes { size: 512 };
    let pass = Figure { copy_ms: Some(1.0), bytes_per_second: Some(1e11), ..figure("relight", 0.0, Some(1.1)) };
    device.found(&passes, false, pass);
    device.leave_out(&passes, None, "it was late");
    let last = device.rows.last().unwrap();
    assert!(last.left_out.is_some() && last.what != PASSES, "{last:?}");
    assert_eq!(device.copied_per_second, Some(1e11));
    assert!(device.rows.iter().any(|row| row.reached == Some(true)));
}

#[test]
fn the_first_use_of_kernels_is_told_for_both_starts() {
    let mut device = gpu();
    let network = Measure::Network { preset: Preset::Quick, size: 128 };
    for (measure, fresh, first) in [(network, true, 20_000.0), (Measure::FirstUse { size: 128 }, true, 500.0)] {
        device.found(&measure, fresh, figure(STEP, first, Some(10.0)));
        device.found(&measure, fresh, figure(PREDICTION, first / 2.0, Some(4.0)));
    }
    let first = |what: &str| {
        let mut rows = device.rows.iter().filter(|row| row.what == what);
        rows.next().and_then(|row| row.first_ms)
    };
    assert_eq!(first("first training step ever"), Some(20_000.0));
    assert_eq!(first("first training step again, after a start"), Some(500.0));
    assert_eq!(first("first prediction ever"), Some(10_000.0));
    assert_eq!(first("first prediction again, after a start"), Some(250.0));
    // The second process timed too little to tell the time of a step.
    let steps = device.rows.iter().filter(|row| row.what == STEP);
    assert_eq!(steps.count(), 1);
}

/// Outcome and figures of a process that runs `script`.
fn measured(script: &str, most: f64, progress: &Progress) -> (Ended, Vec<String>) {
    let mut command = Command::new("sh");
    command.args(["-c", script]);
    let measuring = Measuring::spawn(command).unwrap();
    let mut found = Vec::new();
    let most = Duration::from_secs_f64(most);
    let ended = measuring.wait(most, progress, |figure| found.push(figure.what));
    (ended, found)
}

#[cfg(unix)]
#[test]
fn what_a_process_said_before_it_hung_crashed_or_failed_is_kept() {
    let step = r#"echo noise of a driver; echo '{"what":"training step"}'"#;
    let began = Instant::now();
    let (ended, found) = measured(&format!("{step}; exec sleep 1000"), 0.5, &Progress::silent());
    assert!(matches!(ended, Ended::Late) && found == [STEP]);
    let (ended, found) = measured(&format!("{step}; kill -SEGV $$"), 60.0, &Progress::silent());
    let Ended::Failed(why) = ended else {
        panic!("it crashed");
    };
    assert!(why.contains("signal 11") && found == [STEP], "{why}");
    let failing = format!("{step}; echo 'afterlight: the GPU is gone.' >&2; exit 1");
    let (ended, found) = measured(&failing, 60.0, &Progress::silent());
    assert!(matches!(ended, Ended::Failed(why) if why == "the GPU is gone") && found == [STEP]);
    let control = Control::default();
    control.stop();
    let stopping = Progress::new(&|_| {}, control);
    let (ended, _) = measured("exec sleep 1000", 60.0, &stopping);
    assert!(matches!(ended, Ended::Stopped));
    let (ended, found) = measured(step, 60.0, &Progress::silent());
    assert!(matches!(ended, Ended::Done) && found == [STEP]);
    shown!(
        Surroundings,
        "A measure of a machine hangs, crashes or is stopped",
        bound: "60 s",
        measured: format!("{:.1} s for five endings", began.elapsed().as_secs_f64()),
    );
}

#[test]
fn the_table_names_what_was_left_out_once() {
    let left = Row {
        median_ms: None,
        predicted_ms: Some(5000.0),
        left_out: Some("it would take about 10 s".to_owned()),
        ..row(STEP, Some("paper"), 512, 1.0)
    };
    let prediction = Row { what: PREDICTION.to_owned(), ..left.clone() };
    let device = DeviceReport {
        kind: "cpu".to_owned(),
        name: "a processor".to_owned(),
        self_test: None,
        copied_per_second: Some(1e10),
        rows: vec![left, prediction],
    };
    let report = super::MachineReport {
        machine: base::machine::Machine::this(),
        adapters: Vec::new(),
        minutes: 8.0,
        seconds: 60.0,
        stopped: false,
        devices: vec![device],
    };
    let text = report.markdown();
    assert_eq!(text.matches("it would take about 10 s").count(), 1, "{text}");
    assert!(text.contains("left out, about 5000") && text.contains("10.0 GB/s"), "{text}");
    assert!(text.contains("| ten minutes of training `paper`, 512 pixels | about 120 steps |"), "{text}");
}
