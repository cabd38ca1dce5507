//! Training as a whole, on a shoot small enough for seconds.

use afterlight::calibration::{Calibration, calibrate};
use afterlight::footage::{Frame, ImportSettings, import};
use afterlight::gpu::DeviceChoice;
use afterlight::progress::Progress;
use afterlight::project::Project;
use afterlight::reflectance::{Predictor, ReflectanceField};
use afterlight::training::{Preset, TrainSettings, TrainingConfig, train};
use afterlight::virtual_stage::{StageSettings, write_shoot};
use burn::tensor::Device;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The backend's random generator is one for the process, so runs that are compared take turns.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn shoot(folder: &Path) {
    let settings = StageSettings {
        frames: 4,
        size: 16,
        lamps: 6,
        ..StageSettings::default()
    };
    write_shoot(&folder.join("shoot"), &settings, &Progress::silent()).unwrap();
}

fn project(folder: &Path, name: &str) -> (Project, Calibration) {
    let settings = ImportSettings { size: 16, seed: 5 };
    let project = import(
        &folder.join(name),
        &folder.join("shoot"),
        &settings,
        &Progress::silent(),
    )
    .unwrap();
    let calibration = calibrate(&project, &Progress::silent()).unwrap();
    calibration.save(&project).unwrap();
    (project, calibration)
}

fn small() -> TrainingConfig {
    TrainingConfig {
        width: 8,
        most_channels: 16,
        minutes: None,
        decay: false,
        ..Preset::Quick.config()
    }
}

fn run(
    project: &Project,
    calibration: &Calibration,
    config: TrainingConfig,
) -> afterlight::training::TrainReport {
    let settings = TrainSettings {
        config,
        exclude_frames: vec![3],
        hold_out: None,
        fresh: false,
        device: DeviceChoice::Cpu,
    };
    train(project, calibration, &settings, &Progress::silent()).unwrap()
}

fn predicted(project: &Project, calibration: &Calibration) -> ReflectanceField {
    let frame = Frame::load(project, &calibration.response, 3).unwrap();
    Predictor::open(project, &Device::flex())
        .unwrap()
        .predict(&frame)
        .unwrap()
}

#[test]
fn a_resumed_run_equals_an_unstopped_one_bit_for_bit() {
    a_resumed_run_equals_an_unstopped_one(small());
}

/// The true features that a resumed run has not met yet are those that an unstopped one remembers.
#[test]
fn so_it_does_with_features_from_a_file_and_sampled_lamps() {
    let weights = "../shared/data/weights/squeezenet1_1_lpips_v0_1.safetensors";
    let weights = Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap()).join(weights);
    if !weights.exists() {
        eprintln!("skipped: no {}", weights.display());
        return;
    }
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
    shoot(folder.path());
    let (stopped, calibration) = project(folder.path(), "stopped");
    let (unstopped, _) = project(folder.path(), "unstopped");
    run(
        &stopped,
        &calibration,
        TrainingConfig {
            epochs: 2,
            ..config.clone()
        },
    );
    let resumed = run(
        &stopped,
        &calibration,
        TrainingConfig {
            epochs: 6,
            ..config.clone()
        },
    );
    let whole = run(
        &unstopped,
        &calibration,
        TrainingConfig {
            epochs: 6,
            ..config.clone()
        },
    );
    assert_eq!(resumed.steps, whole.steps);
    assert_eq!(
        predicted(&stopped, &calibration).values,
        predicted(&unstopped, &calibration).values
    );
}

#[test]
fn training_learns_and_its_output_does_not_fall_to_black() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    shoot(folder.path());
    for formulation in [
        afterlight::reflectance::Formulation::Direct,
        afterlight::reflectance::Formulation::Ratio,
    ] {
        let (project, calibration) = project(folder.path(), &format!("{formulation:?}"));
        let config = TrainingConfig {
            formulation,
            epochs: 30,
            ..small()
        };
        let report = run(&project, &calibration, config);
        assert_eq!(report.skipped_steps, 0);
        let log = std::fs::read_to_string(project.root.join("training.csv")).unwrap();
        let losses: Vec<f32> = log
            .lines()
            .skip(1)
            .filter_map(|line| line.split(',').nth(2).and_then(|loss| loss.parse().ok()))
            .collect();
        let mean = |part: &[f32]| part.iter().sum::<f32>() / part.len() as f32;
        let (first, last) = (mean(&losses[..12]), mean(&losses[losses.len() - 12..]));
        assert!(
            last < 0.8 * first,
            "{formulation:?}: the reconstruction loss went from {first} to {last}"
        );
        let field = predicted(&project, &calibration);
        let lit = field.values.iter().filter(|v| **v > 1e-3).count();
        assert!(
            lit * 20 > field.values.len(),
            "{formulation:?}: only {lit} of {} values are lit",
            field.values.len()
        );
        assert!(field.values.iter().all(|v| v.is_finite()));
    }
}

/// The network that predicts is the one that did best on the unseen pose, and training goes on from the
/// latest all the same.
#[test]
fn a_pose_held_out_judges_and_does_not_teach() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    shoot(folder.path());
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
    let judged: Vec<f32> = judged
        .lines()
        .skip(1)
        .map(|line| line.rsplit(',').next().unwrap().parse().unwrap())
        .collect();
    let highest = judged.iter().copied().fold(f32::MIN, f32::max);
    assert_eq!(best.decibels, highest);
    let field = predicted(&project, &calibration);
    assert!(field.values.iter().all(|v| v.is_finite()));
}

#[test]
fn a_checkpoint_of_another_shape_is_refused_with_a_sentence() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    shoot(folder.path());
    let (project, calibration) = project(folder.path(), "film");
    run(
        &project,
        &calibration,
        TrainingConfig {
            epochs: 1,
            ..small()
        },
    );
    let mut larger = project.clone();
    larger.settings.size = 32;
    let refused = Predictor::open(&larger, &Device::flex())
        .err()
        .expect("another size is refused")
        .to_string();
    assert!(
        refused.contains("32 pixels") && refused.contains("--fresh"),
        "{refused}"
    );
    let settings = TrainSettings {
        config: TrainingConfig {
            width: 16,
            ..small()
        },
        exclude_frames: Vec::new(),
        hold_out: None,
        fresh: false,
        device: DeviceChoice::Cpu,
    };
    let refused = train(&project, &calibration, &settings, &Progress::silent())
        .unwrap_err()
        .to_string();
    assert!(refused.contains("--fresh"), "{refused}");
}
