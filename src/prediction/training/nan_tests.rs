//! Losses, gradients and weights that are NaN or infinite, and OLATs near black.

use super::config::{Preset, TrainSettings, TrainingConfig};
use super::run::train;
use super::trainer::Trainer;
use base::progress::Progress;
use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Device, Tensor};
use calibration::Calibration;
use gpu::DeviceChoice;
use project::Project;
use reflectance::checkpoint;
use reflectance::kernels::has_bf16;
use reflectance::{Normalization, Precision, Statistics, UNet};
use std::path::Path;
use test_shoot::TestShoot;
use test_support::accident::contents;

fn project(folder: &Path) -> (Project, Calibration) {
    let shoot = TestShoot { frames: 2, lamps: 6, working_size: 16, ..TestShoot::default() };
    shoot.calibrate(folder, "film")
}

fn settings(config: TrainingConfig) -> TrainSettings {
    TrainSettings {
        config: TrainingConfig { width: 16, most_channels: 16, minutes: None, decay: false, warm_up: 0, ..config },
        exclude_frames: Vec::new(),
        hold_out: None,
        fresh: false,
        device: DeviceChoice::Cpu,
    }
}

fn quick() -> TrainingConfig {
    Preset::Quick.config()
}

/// All weights and running statistics, in order.
fn values(network: &UNet) -> Vec<f32> {
    #[derive(Default)]
    struct Values(Vec<f32>);
    impl ModuleVisitor for Values {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            let values = param.val().into_data().try_into_vec::<f32>();
            self.0.extend(values.unwrap());
        }
    }
    let mut values = Values::default();
    network.visit(&mut values);
    values.0
}

/// Trained weights and their average, from a checkpoint.
fn kept(trainer: &Trainer, project: &Project) -> [Vec<f32>; 2] {
    trainer.save(project).unwrap();
    let kept = checkpoint::load_training(&project.checkpoint_path(), &Device::flex()).unwrap();
    [values(&kept.live), values(&kept.average)]
}

/// Multiplies every input picture of the network.
fn spoil(trainer: &mut Trainer, by: f32) {
    let samples = trainer.data.exemplars.iter_mut().flatten();
    let plates = samples.map(|sample| &mut sample.plate);
    for plate in plates.chain(&mut trainer.data.frames) {
        plate.encoded = plate.encoded.clone() * by;
    }
}

#[test]
fn a_step_that_is_not_finite_leaves_no_trace() {
    for (normalization, statistics, precision) in [
        (Normalization::Group, Statistics::Own, Precision::Mixed),
        (Normalization::Batch, Statistics::Own, Precision::Full),
        (Normalization::Batch, Statistics::Running, Precision::Mixed),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let (project, calibration) = project(folder.path());
        let config = TrainingConfig { normalization, statistics, precision, ..quick() };
        let settings = settings(config);
        let trainer = || {
            let (device, silent) = (Device::flex(), Progress::silent());
            Trainer::new(&project, &calibration, &settings, &device, &silent).unwrap()
        };
        let mut spoilt = trainer();
        let rounds = spoilt.info.network.multiplies_bf16();
        assert_eq!(rounds, precision == Precision::Mixed && has_bf16());
        assert!((0..3).all(|_| spoilt.step(0.0).taken));
        let before = kept(&spoilt, &project);
        // It continues from the checkpoint, and passes over the sample that the other skips.
        let mut clean = trainer();
        for by in [f32::NAN, f32::INFINITY] {
            let pictures = (spoilt.data.exemplars.clone(), spoilt.data.frames.clone());
            spoil(&mut spoilt, by);
            let report = spoilt.step(0.0);
            assert!(!report.taken, "{by}: {report:?}");
            (spoilt.data.exemplars, spoilt.data.frames) = pictures;
            clean.info.step += 1;
        }
        assert_eq!(kept(&spoilt, &project), before, "{normalization:?}");
        for trainer in [&mut spoilt, &mut clean] {
            assert!((0..3).all(|_| trainer.step(0.0).taken));
        }
        let [spoilt, clean] = [&spoilt, &clean].map(|trainer| kept(trainer, &project));
        assert!(spoilt.iter().flatten().all(|v| v.is_finite()));
        assert_eq!(spoilt, clean, "{normalization:?}");
        assert_ne!(spoilt, before);
    }
    test_support::shown!(
        Network,
        "A picture is NaN or infinite, f32 and bf16",
        bound: "equal bit for bit",
        measured: "equal",
    );
}

/// Encoded 14 stops down, they are darker than in linear light.
#[test]
fn lamps_that_are_black_or_14_stops_down_cost_no_step() {
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path());
    let mut measured = Vec::new();
    for precision in [Precision::Full, Precision::Mixed] {
        let settings = settings(TrainingConfig { precision, ..quick() });
        let (device, silent) = (Device::flex(), Progress::silent());
        for (name, lamps) in [
            ("five black", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            ("all 14 stops down", [2f32.powi(-14); 6]),
            ("black, dark and lit", [0.0, 2f32.powi(-14), 1.0, 0.0, 2f32.powi(-14), 1.0]),
        ] {
            let mut trainer = Trainer::new(&project, &calibration, &settings, &device, &silent).unwrap();
            let factors = Tensor::<1>::from_floats(lamps, &device.clone().autodiff());
            let factors = factors.reshape([6, 1, 1, 1]);
            for sample in trainer.data.exemplars.iter_mut().flatten() {
                sample.encoded_olats = sample.encoded_olats.clone() * factors.clone();
            }
            let mut losses = Vec::new();
            for step in 0..200 {
                let report = trainer.step(0.0);
                assert!(report.taken, "{name}, {precision:?}, step {step}: {report:?}");
                losses.extend(report.reconstruction);
            }
            trainer.check_weights().unwrap();
            let mean = |part: &[f32]| part.iter().sum::<f32>() / part.len() as f32;
            let tenth = losses.len() / 10;
            let [first, last] = [&losses[..tenth], &losses[losses.len() - tenth..]].map(mean);
            assert!(last < first, "{name}, {precision:?}: {first} became {last}");
            measured.push(format!("{name} {first:.1e} to {last:.1e}"));
        }
    }
    test_support::shown!(
        Network,
        "OLATs that are black, or 14 stops down, beside others and alone, f32 and bf16",
        bound: "200 steps taken, the loss falls",
        measured: measured.join(", "),
    );
}

#[test]
fn gradients_that_overflow_are_not_taken_and_end_a_run_without_a_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path());
    // Losses are finite, and so are these multiples of them: their gradients' squares are not.
    let settings = settings(TrainingConfig {
        reconstruction: 1e37,
        rendering: 1e37,
        checkpoint_seconds: 0.0,
        epochs: 9,
        ..quick()
    });
    let mut trainer = Trainer::new(&project, &calibration, &settings, &Device::flex(), &Progress::silent()).unwrap();
    let report = trainer.step(0.0);
    let losses = [report.reconstruction, report.rendering];
    assert!(losses.iter().flatten().all(|loss| loss.is_finite()));
    assert!(!report.gradient_norm.is_finite() && !report.taken, "{report:?}");
    let said = train(&project, &calibration, &settings, &Progress::silent()).unwrap_err().to_string();
    assert!(said.contains("3 steps in a row had losses that are not finite"), "{said}");
    test_support::shown!(
        Network,
        "Gradients overflow step after step",
        done: "after three such steps training stops with a message",
    );
}

#[test]
fn weights_that_are_not_finite_are_never_saved() {
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path());
    let silent = Progress::silent();
    let good = settings(TrainingConfig { epochs: 1, ..quick() });
    let steps = train(&project, &calibration, &good, &silent).unwrap().steps;
    let before = contents(&project.checkpoint_path());
    // Saved after each step, or only at the end.
    for (learning_rate, checkpoint_seconds) in [(1e30, 0.0), (1e30, 1e9), (f64::NAN, 0.0)] {
        let wild = settings(TrainingConfig { learning_rate, checkpoint_seconds, epochs: 2, ..quick() });
        let said = train(&project, &calibration, &wild, &silent).unwrap_err().to_string();
        assert!(said.contains("The last checkpoint is kept"), "{said}");
        assert!(contents(&project.checkpoint_path()) == before);
    }
    let gone_on = settings(TrainingConfig { epochs: 2, ..quick() });
    let report = train(&project, &calibration, &gone_on, &silent).unwrap();
    assert!(report.steps > steps && report.skipped_steps == 0);
    test_support::shown!(
        Network,
        "The learning rate is so high that weights become NaN, and each step is saved",
        done: "weights are checked before they are saved; training stops, and the last network stays",
    );
}

/// The best network once shared its running statistics with the average, which continues.
#[test]
fn the_best_network_stays_as_it_was_validated() {
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path());
    let settings = TrainSettings {
        hold_out: Some(0),
        ..settings(TrainingConfig { normalization: Normalization::Batch, statistics: Statistics::Running, ..quick() })
    };
    let (device, silent) = (Device::flex(), Progress::silent());
    let mut trainer = Trainer::new(&project, &calibration, &settings, &device, &silent).unwrap();
    trainer.step(0.0);
    assert!(trainer.validate().unwrap().is_finite());
    let validated = values(trainer.network());
    assert!((0..3).all(|_| trainer.step(0.0).taken));
    assert!(values(trainer.network()) == validated);
    assert!(values(&trainer.average) != validated);
}
