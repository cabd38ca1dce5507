//! End-to-end training, on a shoot small enough to take seconds.

use afterlight::calibration::Calibration;
use afterlight::footage::Frame;
use afterlight::gpu::DeviceChoice;
use afterlight::imaging::Raster;
use afterlight::progress::{Control, Progress, Report};
use afterlight::project::Project;
use afterlight::reflectance::checkpoint::{self, CheckpointInfo};
use afterlight::reflectance::kernels::has_bf16;
use afterlight::reflectance::{Formulation, Normalization, Precision, Predictor, ReflectanceField, Statistics};
use afterlight::training::{History, Preset, TrainSettings, TrainingConfig, checkpoints, train};
use burn::tensor::Device;
use std::path::Path;
use std::process::Stdio;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use test_shoot::TestShoot;

/// Burn's random generator is global to the process, so compared runs take turns.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A project in `folder`, of the shared shoot.
fn project(folder: &Path, name: &str) -> (Project, Calibration) {
    let shoot = TestShoot { frames: 4, working_size: 16, ..TestShoot::default() };
    shoot.calibrate(folder, name)
}

fn small() -> TrainingConfig {
    TrainingConfig { width: 8, most_channels: 16, minutes: None, decay: false, ..Preset::Quick.config() }
}

fn settings(config: TrainingConfig) -> TrainSettings {
    TrainSettings { config, exclude_frames: vec![3], hold_out: None, fresh: false, device: DeviceChoice::Cpu }
}

fn run(project: &Project, calibration: &Calibration, config: TrainingConfig) -> afterlight::training::TrainReport {
    train(project, calibration, &settings(config), &Progress::silent()).unwrap()
}

fn predicted(project: &Project, calibration: &Calibration) -> ReflectanceField {
    let frame = Frame::load(project, &calibration.response, 3).unwrap();
    Predictor::open(project, &Device::flex()).unwrap().predict(&frame).unwrap()
}

#[test]
fn a_resumed_run_equals_an_unstopped_one_bit_for_bit() {
    a_resumed_run_equals_an_unstopped_one(small());
}

/// True features first computed after a resume equal those cached by an uninterrupted run.
#[test]
fn so_it_does_with_features_from_a_file_and_sampled_lamps() {
    let weights = "data/weights/squeezenet1_1_lpips_v0_1.safetensors";
    let Some(weights) = test_support::shared(weights) else { return };
    for shift in [0.0, 0.05] {
        a_resumed_run_equals_an_unstopped_one(TrainingConfig {
            features: Some(weights.clone()),
            lamps_per_step: Some(2),
            pixel: 0.2,
            shift,
            ..small()
        });
    }
}

fn a_resumed_run_equals_an_unstopped_one(config: TrainingConfig) {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let (stopped, calibration) = project(folder.path(), "stopped");
    let (unstopped, _) = project(folder.path(), "unstopped");
    run(&stopped, &calibration, TrainingConfig { epochs: 2, ..config.clone() });
    let resumed = run(&stopped, &calibration, TrainingConfig { epochs: 6, ..config.clone() });
    let whole = run(&unstopped, &calibration, TrainingConfig { epochs: 6, ..config.clone() });
    assert_eq!(resumed.steps, whole.steps);
    assert_eq!(predicted(&stopped, &calibration).values, predicted(&unstopped, &calibration).values);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let networks = [1, 2, 7].map(|threads| {
        let (project, calibration) = project(folder.path(), &format!("{threads}"));
        let config = TrainingConfig { epochs: 3, precision: Precision::Mixed, width: 16, ..small() };
        assert_eq!(config.network(&project).multiplies_bf16(), has_bf16());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            run(&project, &calibration, config);
            predicted(&project, &calibration).values
        })
    });
    assert!(networks[0] == networks[1] && networks[0] == networks[2]);
}

#[test]
fn what_is_recomputed_on_the_way_back_changes_nothing() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let networks = [false, true].map(|recompute| {
        let (project, calibration) = project(folder.path(), &format!("{recompute}"));
        let config = TrainingConfig { epochs: 3, recompute, ..small() };
        run(&project, &calibration, config);
        predicted(&project, &calibration).values
    });
    assert_eq!(networks[0], networks[1]);
}

/// Trains for 30 epochs; then the loss has fallen and the output is neither black nor NaN.
fn learns(folder: &Path, name: &str, config: TrainingConfig) {
    let (project, calibration) = project(folder, name);
    let report = run(&project, &calibration, TrainingConfig { epochs: 30, ..config });
    assert_eq!(report.skipped_steps, 0);
    assert!(report.dead_lamps.is_empty(), "{:?}", report.dead_lamps);
    let log = std::fs::read_to_string(project.root.join("training.csv")).unwrap();
    let losses: Vec<f32> =
        log.lines().skip(1).filter_map(|line| line.split(',').nth(2).and_then(|loss| loss.parse().ok())).collect();
    let mean = |part: &[f32]| part.iter().sum::<f32>() / part.len() as f32;
    let (first, last) = (mean(&losses[..12]), mean(&losses[losses.len() - 12..]));
    assert!(last < 0.8 * first, "{name}: the reconstruction loss went from {first} to {last}");
    let field = predicted(&project, &calibration);
    let lit = field.values.iter().filter(|v| **v > 1e-3).count();
    assert!(lit * 20 > field.values.len(), "{name}: only {lit} of {} values are lit", field.values.len());
    assert!(field.values.iter().all(|v| v.is_finite()));
}

#[test]
fn training_learns_and_its_output_does_not_fall_to_black() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    for formulation in [Formulation::Direct, Formulation::Ratio] {
        let config = TrainingConfig { formulation, ..small() };
        learns(folder.path(), &format!("{formulation:?}"), config);
    }
}

/// Batch normalisation as in the paper, with one picture per step.
fn batch(statistics: Statistics) -> TrainingConfig {
    TrainingConfig { normalization: Normalization::Batch, formulation: Formulation::Direct, statistics, ..small() }
}

#[test]
fn batch_normalisation_learns_from_a_batch_of_one() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    for statistics in [Statistics::Own, Statistics::Running] {
        learns(folder.path(), &format!("{statistics:?}"), batch(statistics));
    }
}

#[test]
fn a_resumed_run_has_the_running_statistics_of_an_unstopped_one() {
    a_resumed_run_equals_an_unstopped_one(batch(Statistics::Running));
}

/// An excessive rate saturates the sigmoid, and the run lists the lamps that no longer learn.
#[test]
fn outputs_that_have_died_are_named() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path(), "film");
    let settings = TrainSettings {
        config: TrainingConfig {
            formulation: Formulation::Direct,
            learning_rate: 1.0,
            gradient_norm: 1e9,
            warm_up: 0,
            epochs: 60,
            ..small()
        },
        exclude_frames: vec![3],
        hold_out: None,
        fresh: true,
        device: DeviceChoice::Cpu,
    };
    let (report, said) = Progress::heard(|progress| train(&project, &calibration, &settings, progress).unwrap());
    let lamps = &project.settings.shoot.lamps;
    assert!(!report.dead_lamps.is_empty(), "{said}");
    assert!(report.dead_lamps.iter().all(|lamp| lamps.contains(lamp)));
    assert!(said.contains("Dead output") && said.contains("start over with a lower learning rate"), "{said}");
}

/// Killed repeatedly without warning, with a checkpoint after every step, a run always finds a readable one that is no
/// older than the last.
#[test]
fn a_killed_run_leaves_a_readable_checkpoint() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let (project, _) = project(folder.path(), "film");
    let checkpoint = project.checkpoint_path();
    let settings = ["width=8", "most-channels=16", "minutes=none", "checkpoint-seconds=0"];
    let start = || {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_afterlight"));
        command.arg("train").arg(&project.root);
        command.args(["--device", "cpu", "--hold-out", "1"]);
        command.args(settings.iter().flat_map(|setting| ["--set", setting]));
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().unwrap()
    };
    let mut step = 0;
    for attempt in 0..8 {
        let mut run = start();
        // Killed after it resumes, at a different point each time.
        let deadline = Instant::now() + Duration::from_secs(60);
        // The first run is long enough for a score of the held-out pose: from then on there is one more file.
        let far = |info: CheckpointInfo| info.step > step && info.held_out.is_some();
        while !checkpoint::info(&checkpoint).is_ok_and(far) {
            assert!(run.try_wait().unwrap().is_none() && Instant::now() < deadline);
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_micros(3700 * attempt));
        run.kill().unwrap();
        run.wait().unwrap();
        let resumed = checkpoint::load_training(&checkpoint, &Device::flex()).unwrap();
        assert!(resumed.info.step > step && resumed.optimizer.is_some());
        step = resumed.info.step;
    }
}

#[test]
fn a_training_says_what_it_adds_to_a_pose_that_was_held_out() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let (project, _) = project(folder.path(), "film");
    let train = |more: &[&str]| -> serde_json::Value {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_afterlight"));
        command.arg("train").arg(&project.root);
        command.args(["--device", "cpu", "--epochs", "1", "--fresh", "--json"]);
        command.args(["--set", "width=8", "--set", "most-channels=16"]);
        let output = command.args(more).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let found = &train(&["--hold-out", "1"])["prediction"];
    assert_eq!(found["pose"], 1);
    let [carried, corrected] = ["carried_db", "corrected_db"].map(|key| found[key].as_f64().unwrap());
    // The network takes part, but after a few steps its share is close to zero.
    assert!(carried > 15.0 && corrected != carried && (corrected - carried).abs() < 0.5, "{found}");
    assert!(train(&[])["prediction"].is_null());
}

/// Bytes of a folder's checkpoint: the table's figures, and each weight file that it names.
fn contents(folder: &Path) -> (CheckpointInfo, Vec<Vec<u8>>) {
    let table = std::fs::read_to_string(folder.join("checkpoint.toml")).unwrap();
    // The checksums, whose keys are quoted names, are not included.
    let named = (table.lines()).filter_map(|line| line.split_once(" = \"")?.1.strip_suffix('"'));
    let files = named.filter(|name| name.ends_with(".bpk"));
    let bytes = files.map(|name| std::fs::read(folder.join(name)).unwrap());
    (checkpoint::info(folder).unwrap(), bytes.collect())
}

/// Going back and forth restores every byte, also of the logs, and training after going back gives the same result as
/// the first time.
#[test]
fn a_run_that_goes_back_learns_again_what_it_learnt() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path(), "film");
    let short = TrainingConfig { epochs: 3, ..small() };
    let long = TrainingConfig { epochs: 8, ..small() };
    let first = run(&project, &calibration, short).steps;
    let present = project.checkpoint_path();
    let log = || std::fs::read_to_string(project.root.join("training.csv")).unwrap();
    let (early, early_log) = (contents(&present), log());
    let second = run(&project, &calibration, long.clone()).steps;
    let late_field = predicted(&project, &calibration).values;
    let (late, late_log) = (contents(&present), log());
    assert!(second > first && early.1 != late.1 && early.1.len() == 3);

    assert_eq!(checkpoints::go_back(&project, &first.to_string()).unwrap().step, first);
    assert_eq!((contents(&present), log()), (early.clone(), early_log.clone()));
    let listed = checkpoints::list(&project);
    assert!(listed.iter().any(|k| k.aside && k.info == late.0));
    assert!(listed.iter().any(|k| k.present && k.info == early.0));
    checkpoints::go_back(&project, &second.to_string()).unwrap();
    assert_eq!((contents(&present), log()), (late, late_log));
    assert_eq!(predicted(&project, &calibration).values, late_field);
    checkpoints::go_back(&project, &first.to_string()).unwrap();
    assert_eq!((contents(&present), log()), (early, early_log));

    run(&project, &calibration, long);
    assert_eq!(predicted(&project, &calibration).values, late_field);
    let history = History::read(&project.root).unwrap();
    let steps: Vec<u64> = history.points().iter().map(|p| p.step).collect();
    assert_eq!(steps, (1..=second).collect::<Vec<_>>());

    let refused = checkpoints::go_back(&project, "77").unwrap_err().for_terminal();
    assert!(refused.contains("77") && refused.contains("afterlight checkpoints"), "{refused}");
}

/// A fresh run sets the old network aside with its curves, and however often training saves, the list stays short.
#[test]
fn what_was_trained_before_a_new_start_is_kept_and_the_list_is_bounded() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path(), "film");
    let config = TrainingConfig { epochs: 12, checkpoint_seconds: 0.0, ..small() };
    let steps = run(&project, &calibration, config.clone()).steps;
    let passing = checkpoints::list(&project).len() as u64;
    assert!(steps > 40 && passing <= 2 * (u64::from(steps.ilog2()) + 2), "{passing} of {steps}");
    let old = contents(&project.checkpoint_path());
    let settings = TrainSettings {
        config: TrainingConfig { epochs: 1, width: 16, ..config },
        exclude_frames: vec![3],
        hold_out: None,
        fresh: true,
        device: DeviceChoice::Cpu,
    };
    train(&project, &calibration, &settings, &Progress::silent()).unwrap();
    let kept = checkpoints::list(&project);
    let aside = kept.iter().find(|kept| kept.aside).unwrap();
    let folder = project.root.join("checkpoints").join(&aside.name);
    assert_eq!(contents(&folder), old);
    let log = std::fs::read_to_string(folder.join("training.csv")).unwrap();
    assert_eq!(log.lines().count() as u64, steps + 1);
    checkpoints::go_back(&project, &aside.name).unwrap();
    assert_eq!(contents(&project.checkpoint_path()), old);
}

/// Killed repeatedly while it goes back and forth, a project always has one of the two checkpoints, readable, and loses
/// neither.
#[test]
fn a_way_back_that_is_killed_leaves_a_readable_checkpoint() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path(), "film");
    let steps = [2, 5].map(|epochs| {
        let config = TrainingConfig { epochs, ..small() };
        run(&project, &calibration, config).steps
    });
    let present = project.checkpoint_path();
    let go = |to: u64| {
        let mut back = std::process::Command::new(env!("CARGO_BIN_EXE_afterlight"));
        back.arg("checkpoints").arg(&project.root);
        back.arg("--back-to").arg(to.to_string());
        back.stdout(Stdio::null()).stderr(Stdio::null());
        back.spawn().unwrap()
    };
    let began = Instant::now();
    assert!(go(steps[0]).wait().unwrap().success());
    let whole = began.elapsed();
    let mut seen = [false; 2];
    for attempt in 0..40 {
        let to = usize::from(checkpoint::info(&present).unwrap().step == steps[0]);
        let mut back = go(steps[to]);
        // At a different point each time, from its beginning to beyond its end.
        std::thread::sleep(whole.mul_f32(1.2 * attempt as f32 / 39.0));
        back.kill().unwrap();
        back.wait().unwrap();
        let resumed = checkpoint::load_training(&present, &Device::flex()).unwrap();
        let place = steps.iter().position(|&step| step == resumed.info.step);
        seen[place.unwrap()] = true;
        assert!(resumed.optimizer.is_some());
        let kept: Vec<u64> = checkpoints::list(&project).iter().map(|k| k.info.step).collect();
        let there = |step: &u64| kept.contains(step) || *step == resumed.info.step;
        assert!(steps.iter().all(there), "{kept:?}");
    }
    assert_eq!(seen, [true; 2]);
}

/// A pause keeps the checkpoint, does not count as training, and does not change the result.
#[test]
fn a_paused_run_goes_on_as_if_it_had_not_been() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let (paused, calibration) = project(folder.path(), "paused");
    let (straight, _) = project(folder.path(), "straight");
    let config = TrainingConfig { epochs: 6, ..small() };
    run(&straight, &calibration, config.clone());
    let control = Control::default();
    let steps = AtomicU32::new(0);
    let hear = |report| match report {
        Report::Step { stage: "training", .. } if steps.fetch_add(1, Ordering::SeqCst) == 4 => {
            control.pause(true);
        }
        Report::Say(sentence) if sentence.starts_with("Paused") => {
            assert!(paused.checkpoint_path().join("checkpoint.toml").exists());
            let control = control.clone();
            std::thread::spawn(move || {
                std::thread::sleep(Duration::from_millis(300));
                control.pause(false);
            });
        }
        _ => {}
    };
    let settings = settings(config);
    let progress = Progress::new(&hear, control.clone());
    let report = train(&paused, &calibration, &settings, &progress).unwrap();
    assert!(steps.load(Ordering::SeqCst) > 5 && report.steps > 5);
    assert_eq!(predicted(&paused, &calibration).values, predicted(&straight, &calibration).values);
}

/// The predicting network is the one with the best score on the held-out pose, while training continues from the
/// latest.
#[test]
fn a_pose_held_out_judges_and_does_not_teach() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path(), "film");
    let poses = project.settings.shoot.poses.len();
    let attempt = |hold_out: usize, epochs: u32| {
        let settings = TrainSettings {
            config: TrainingConfig { epochs, ..small() },
            exclude_frames: vec![3],
            hold_out: Some(hold_out),
            fresh: false,
            device: DeviceChoice::Cpu,
        };
        train(&project, &calibration, &settings, &Progress::silent())
    };
    let refused = attempt(poses, 1).unwrap_err().to_string();
    assert!(refused.contains(&format!("{poses} poses")), "{refused}");

    let first = attempt(1, 4).unwrap().held_out.unwrap();
    assert_eq!(first.pose, 1);
    assert!(first.decibels.is_finite() && first.step > 0);
    let later = attempt(1, 40).unwrap();
    let best = later.held_out.unwrap();
    assert!(best.decibels >= first.decibels && best.step <= later.steps);
    let judged = std::fs::read_to_string(project.root.join("held_out.csv")).unwrap();
    let judged: Vec<f32> =
        judged.lines().skip(1).map(|line| line.rsplit(',').next().unwrap().parse().unwrap()).collect();
    let highest = judged.iter().copied().fold(f32::MIN, f32::max);
    assert_eq!(best.decibels, highest);
    let field = predicted(&project, &calibration);
    assert!(field.values.iter().all(|v| v.is_finite()));
}

#[test]
fn a_checkpoint_of_another_shape_is_refused_with_a_sentence() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path(), "film");
    run(&project, &calibration, TrainingConfig { epochs: 1, ..small() });
    let mut larger = project.clone();
    larger.settings.size = 32;
    let refused = Predictor::open(&larger, &Device::flex()).err().expect("another size is refused").for_terminal();
    assert!(refused.contains("32 pixels") && refused.contains("--fresh"), "{refused}");
    let settings = TrainSettings {
        config: TrainingConfig { width: 16, ..small() },
        exclude_frames: Vec::new(),
        hold_out: None,
        fresh: false,
        device: DeviceChoice::Cpu,
    };
    let refused = train(&project, &calibration, &settings, &Progress::silent()).unwrap_err().for_terminal();
    assert!(refused.contains("--fresh"), "{refused}");
}

/// Mean change of a prediction's light when a frame moves two pixels to the right.
fn moved_change(project: &Project, calibration: &Calibration) -> f32 {
    let frame = Frame::load(project, &calibration.response, 3).unwrap();
    let (w, h) = frame.mask.size();
    let from = |x: usize| x.checked_sub(2);
    let moved = Frame {
        index: frame.index,
        plate: Raster::from_fn(w, h, |x, y| from(x).map_or([0.0; 3], |x| frame.plate.at(x, y))),
        mask: Raster::from_fn(w, h, |x, y| from(x).map_or(0.0, |x| frame.mask.at(x, y))),
    };
    let predictor = Predictor::open(project, &Device::flex()).unwrap();
    let [still, moved] = [&frame, &moved].map(|frame| predictor.predict(frame).unwrap());
    let (mut change, mut light) = (0.0, 0.0);
    for lamp in 0..still.lamps {
        let (still, moved) = (still.olat(lamp), moved.olat(lamp));
        for (y, x) in (0..h).flat_map(|y| (0..w - 2).map(move |x| (y, x))) {
            let (a, b) = (still.at(x, y), moved.at(x + 2, y));
            for c in 0..3 {
                change += frame.mask.at(x, y) * (a[c] - b[c]).abs();
                light += frame.mask.at(x, y) * a[c];
            }
        }
    }
    change / light
}

#[test]
fn steadiness_makes_light_depend_less_on_where_the_subject_is() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let [free, steady] = [0.0, 20.0].map(|steadiness| {
        let (project, calibration) = project(folder.path(), &format!("{steadiness}"));
        let config = TrainingConfig { epochs: 120, steadiness, ..small() };
        run(&project, &calibration, config);
        moved_change(&project, &calibration)
    });
    assert!(steady < 0.8 * free, "{steady} with, {free} without");
}
