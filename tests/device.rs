//! `afterlight device` on the current machine, with a short time limit.

mod program;

use afterlight::benchmark::DeviceSettings;
use afterlight::gpu;
use afterlight::progress::Progress;
use afterlight::worker::{Job, Latest, Outcome};
use program::{afterlight, fail, succeed};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use test_support::{Need, shown};

/// Lock of the timed tests: each runs alone.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn rows(device: &Value) -> &[Value] {
    device["rows"].as_array().expect("a device has rows")
}

/// Number of timed rows. Each time is positive and within its spread; a row without a time gives the reason.
fn sound(device: &Value) -> usize {
    let mut timed = 0;
    for row in rows(device) {
        let [low, median, high] = ["low_ms", "median_ms", "high_ms"].map(|key| row[key].as_f64());
        let left_out = row["left_out"].as_str();
        match median {
            Some(median) => {
                assert!(median > 0.0 && low.unwrap() <= median && median <= high.unwrap(), "{row}");
                assert!(row["runs"].as_u64().unwrap() > 0 && left_out.is_none(), "{row}");
                timed += 1;
            }
            None => assert!(left_out.is_some_and(|why| !why.is_empty()) || row["first_ms"].as_f64().is_some(), "{row}"),
        }
        if let Some(predicted) = row["predicted_ms"].as_f64() {
            assert!(predicted > 0.0 && left_out.is_some(), "{row}");
        }
    }
    timed
}

#[test]
fn a_machine_is_measured_within_its_time_and_what_does_not_fit_is_named() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let report =
        succeed(folder.path(), &["device", "--minutes", "0.4", "--device", "cpu", "--json", "--report", "machine.md"]);
    for key in ["machine", "adapters", "minutes", "seconds", "stopped", "devices"] {
        assert!(report.get(key).is_some(), "no {key}");
    }
    assert_eq!(report["stopped"], false);
    let [cpu] = report["devices"].as_array().unwrap().as_slice() else {
        panic!("a device besides the CPU was measured");
    };
    assert_eq!(cpu["kind"], "cpu");
    let timed = sound(cpu);
    let left = rows(cpu).iter().filter(|row| row["left_out"].is_string()).count();
    assert!(timed > 0, "nothing was timed: {report}");
    // Every measure has its row, timed or not.
    for (what, network, size) in [
        ("training step", "quick", 128),
        ("prediction", "paper", 512),
        ("relit frame, network included", "quick", 512),
        ("turn of the light in the window", "quick", 1024),
    ] {
        let named = |row: &&Value| row["what"] == what && row["network"] == network && row["size"] == size;
        assert!(rows(cpu).iter().any(|row| named(&row)), "no {what} of {network} at {size}");
    }
    let seconds = report["seconds"].as_f64().unwrap();
    let table = std::fs::read_to_string(folder.path().join("machine.md")).unwrap();
    assert!(table.contains("| network | pixels | training step, ms |"), "{table}");
    assert_eq!(left > 0, table.contains("Left out:"), "{table}");
    shown!(
        Surroundings,
        "A machine is too slow for the measuring time",
        bound: "24 s",
        measured: format!("{seconds:.0} s: {timed} rows timed, {left} left out"),
    );
}

#[test]
fn the_job_of_the_window_hands_on_what_is_known_after_each_measure() {
    let _turn = turn();
    let woken = Arc::new(AtomicUsize::new(0));
    let count = woken.clone();
    let known = Arc::new(Latest::new(move || {
        count.fetch_add(1, Ordering::Relaxed);
    }));
    let job = Job::Device {
        program: env!("CARGO_BIN_EXE_afterlight").into(),
        settings: DeviceSettings { minutes: 0.1, device: gpu::DeviceChoice::Cpu, ..DeviceSettings::default() },
        known: Some(known.clone()),
    };
    let Outcome::Machine(report) = job.run(&Progress::silent()).unwrap() else {
        panic!("the job measures a machine");
    };
    assert!(woken.load(Ordering::Relaxed) > 10, "once for each measure");
    let known = known.take().unwrap();
    assert_eq!(known.devices, report.devices);
    let said = Outcome::Machine(report).sentence();
    assert!(said.starts_with("Measured this machine in 0.1 minutes: "), "{said}");
}

#[test]
fn a_measure_that_cannot_be_read_is_refused_with_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let said = fail(folder.path(), &["device", "--measure", "{}"]);
    assert!(said.contains("--measure cannot be read"), "{said}");
    let output = afterlight(folder.path(), &["device", "--minutes", "nan"]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("from 0.01 to 600"), "{said}");
}

/// Figures of one measure, in the program's own protocol; `kernels` is its kernel cache.
fn asked(measure: &Value, gpu: bool, kernels: &Path) -> Vec<Value> {
    let request = json!({ "measure": measure, "gpu": gpu, "seconds": 0.0 });
    let mut child = Command::new(env!("CARGO_BIN_EXE_afterlight"))
        .args(["device", "--measure", &request.to_string()])
        .env("AFTERLIGHT_KERNELS", kernels)
        // The process runs while this input is open.
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let open = child.stdin.take();
    let output = child.wait_with_output().unwrap();
    drop(open);
    assert_eq!(output.status.code(), Some(0), "{measure}");
    let lines = String::from_utf8(output.stdout).unwrap();
    lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn a_gpu_says_each_figure_as_it_is_known() {
    let _turn = turn();
    let adapters = gpu::adapters();
    if !test_support::require(Need::Gpu, !adapters.is_empty(), "no adapter") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let asked = |measure: Value| asked(&measure, true, folder.path());
    let [tested] = &asked(json!({ "measure": "self-test" }))[..] else {
        panic!("one figure");
    };
    assert_eq!((&tested["what"], &tested["note"]), (&"self-test".into(), &"passed".into()));

    let passes = asked(json!({ "measure": "passes", "size": 64 }));
    for sum in ["relight", "relight, f16"] {
        let pass = passes.iter().find(|pass| pass["what"] == sum).unwrap();
        assert!(pass["bytes_per_second"].as_f64().unwrap() > 0.0, "{pass}");
        assert!(pass["copy_ms"].as_f64().unwrap() > 0.0, "{pass}");
    }
    let copying = |sum: &str| {
        let pass = passes.iter().find(|pass| pass["what"] == sum).unwrap();
        pass["copy_ms"].as_f64().unwrap() * pass["bytes_per_second"].as_f64().unwrap()
    };
    // Three values for 41 lamps in four bytes or two, the picture and the matte.
    let bytes = |value: f64| 64.0 * 64.0 * (3.0 * 41.0 * value + 16.0) * 1e3;
    assert!((copying("relight") / bytes(4.0) - 1.0).abs() < 1e-6);
    assert!((copying("relight, f16") / bytes(2.0) - 1.0).abs() < 1e-6);
}

#[test]
fn a_network_says_what_its_first_run_took_before_what_the_others_took() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let first = asked(&json!({ "measure": "first-use", "size": 16 }), false, folder.path());
    let names: Vec<&str> = first.iter().map(|figure| figure["what"].as_str().unwrap()).collect();
    let [prediction, step] = ["prediction", "training step"];
    assert_eq!(names, [prediction, prediction, step, step]);
    for pair in first.chunks(2) {
        assert!(pair[0]["times"].is_null() && pair[0]["first_ms"].as_f64().unwrap() > 0.0);
        assert_eq!(pair[1]["times"]["runs"], 1, "{pair:?}");
    }
}

#[test]
fn a_gpu_stands_beside_the_cpu_in_the_report() {
    let _turn = turn();
    let adapters = gpu::adapters();
    if !test_support::require(Need::Gpu, !adapters.is_empty(), "no adapter") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["device", "--minutes", "0.3", "--device", "gpu", "--json"];
    let report = succeed(folder.path(), &arguments);
    let [gpu, cpu] = report["devices"].as_array().unwrap().as_slice() else {
        panic!("expected a GPU and the CPU");
    };
    assert_eq!((&gpu["kind"], &cpu["kind"]), (&"gpu".into(), &"cpu".into()));
    sound(gpu);
    assert!(sound(cpu) > 0, "{report}");
    for what in ["self-test", "training step", "first training step", "first prediction"] {
        let named = |row: &&Value| row["what"].as_str().unwrap().starts_with(what);
        assert!(rows(gpu).iter().any(|row| named(&row)), "no {what}");
    }
}

/// A run of some minutes in a folder, and its first figure.
#[cfg(target_os = "linux")]
fn measuring(folder: &Path) -> (Child, Vec<u32>, std::thread::JoinHandle<()>) {
    let arguments = ["device", "--minutes", "5", "--device", "cpu", "--json"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_afterlight"))
        .args(arguments)
        .args(["--report", "machine.md"])
        .current_dir(folder)
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let said = lines.find(|line| line.as_ref().unwrap().starts_with("CPU: sum, f32"));
    assert!(said.is_some(), "the run ended without a figure");
    let drain = std::thread::spawn(move || lines.for_each(drop));
    let tasks = format!("/proc/{0}/task", child.id());
    let children = std::fs::read_dir(tasks).unwrap().flat_map(|task| {
        let text = std::fs::read_to_string(task.unwrap().path().join("children")).unwrap();
        text.split_whitespace().map(|pid| pid.parse().unwrap()).collect::<Vec<u32>>()
    });
    let children: Vec<u32> = children.collect();
    assert_eq!(children.len(), 1, "one measure at a time");
    (child, children, drain)
}

/// Sends a signal to a run after its first figure, and waits until it and its children have ended.
#[cfg(target_os = "linux")]
fn ended(folder: &Path, signal: &str) -> Output {
    let (child, children, drain) = measuring(folder);
    let kill = Command::new("kill").args([signal, &child.id().to_string()]).status();
    assert!(kill.unwrap().success());
    let output = child.wait_with_output().unwrap();
    drain.join().unwrap();
    for pid in children {
        let stat = format!("/proc/{pid}/stat");
        test_support::wait_for(|| {
            let stat = std::fs::read_to_string(&stat).unwrap_or_default();
            (stat.is_empty() || stat.contains(") Z ")).then_some(())
        });
    }
    output
}

#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_ends_the_measures_and_leaves_the_report() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let began = std::time::Instant::now();
    let output = ended(folder.path(), "-INT");
    assert_eq!(output.status.code(), Some(0));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["stopped"], true);
    let timed = sound(&report["devices"][0]);
    assert!(timed > 0, "{report}");
    let table = std::fs::read_to_string(folder.path().join("machine.md")).unwrap();
    assert!(table.contains("was stopped before its end"), "{table}");
    assert!(table.contains("| sum, f32 | 512 |"), "{table}");
    let seconds = began.elapsed().as_secs_f64();

    // A killed run writes nothing more, but no child survives it.
    let killed = ended(folder.path(), "-KILL");
    assert!(killed.status.code().is_none() && killed.stdout.is_empty());
    shown!(
        Surroundings,
        "Ctrl-C while a machine is measured",
        bound: "300 s",
        measured: format!("{seconds:.0} s of the 5 minutes"),
    );
}
