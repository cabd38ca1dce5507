//! Thousands of training steps on pictures with nothing to learn.

use afterlight::gpu::DeviceChoice;
use afterlight::imaging::{Encoded, Image, file};
use afterlight::progress::Progress;
use afterlight::project::Project;
use afterlight::reflectance::kernels::has_bf16;
use afterlight::reflectance::{Normalization, Precision, Statistics};
use afterlight::training::{Preset, TrainSettings, Trainer, TrainingConfig};
use burn::tensor::Device;
use std::path::Path;
use test_shoot::TestShoot;
use test_support::shown;

const STEPS: usize = 2000;
const SIZE: usize = 16;

/// Codes by picture, pixel and channel.
type Codes = fn(usize, usize) -> f32;

fn noise(picture: usize, i: usize) -> f32 {
    ((picture * 1_000_003 + i).wrapping_mul(2_654_435_761) >> 8 & 0xff) as f32 / 255.0
}

fn settings(normalization: Normalization, precision: Precision) -> TrainSettings {
    TrainSettings {
        config: TrainingConfig {
            width: 16,
            most_channels: 16,
            normalization,
            statistics: Statistics::Own,
            precision,
            minutes: None,
            decay: false,
            ..Preset::Quick.config()
        },
        exclude_frames: Vec::new(),
        hold_out: None,
        fresh: true,
        device: DeviceChoice::Cpu,
    }
}

/// Sets all OLATs and frames to these codes.
fn paint(project: &Project, codes: Codes) {
    let shoot = &project.settings.shoot;
    let olats = (0..shoot.poses.len())
        .flat_map(|pose| (0..shoot.lamps.len()).map(move |lamp| project.olat_picture(pose, lamp)));
    let frames = (0..shoot.frames.len()).map(|frame| project.frame_picture(frame));
    for (number, path) in olats.chain(frames).enumerate() {
        // A ball of 16 pixels would be too small, so pictures are twice the working size.
        let picture =
            Image::from_fn(2 * SIZE, 2 * SIZE, |x, y| [0, 1, 2].map(|c| codes(number, 3 * (y / 2 * SIZE + x / 2) + c)));
        file::write_png(path.file(), &Encoded(picture)).unwrap();
    }
}

/// A project with the light and camera of a small shoot.
fn project(folder: &Path) -> (Project, afterlight::calibration::Calibration) {
    let shoot = TestShoot { frames: 2, lamps: 6, size: 2 * SIZE, working_size: SIZE };
    shoot.calibrate(folder, "film")
}

/// Mean losses on exemplars over the first and the last hundred steps; all must be finite, and every step taken.
fn losses(trainer: &mut Trainer) -> [f64; 2] {
    let mut losses = Vec::with_capacity(STEPS);
    for step in 0..STEPS {
        let report = trainer.step(0.0);
        assert!(report.taken, "step {step}: {report:?}");
        if let Some(loss) = report.reconstruction {
            losses.push(f64::from(loss + report.rendering.unwrap_or(0.0)));
        }
    }
    trainer.check_weights().unwrap();
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    [mean(&losses[..20]), mean(&losses[losses.len() - 100..])]
}

#[test]
fn two_thousand_steps_on_noise_black_and_one_grey_end_no_worse_than_they_began() {
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path());
    let kinds: [(&str, Codes); 3] = [
        ("noise", noise),
        // Pure black is refused; this is the darkest code.
        ("black", |_, _| 1.0 / 255.0),
        ("grey", |_, _| 0.5),
    ];
    let mut measured = Vec::new();
    for (name, codes) in kinds {
        paint(&project, codes);
        for (normalization, precision) in
            [(Normalization::Group, Precision::Full), (Normalization::Batch, Precision::Mixed)]
        {
            let (device, silent) = (Device::flex(), Progress::silent());
            let settings = settings(normalization, precision);
            let mut trainer = Trainer::new(&project, &calibration, &settings, &device, &silent).unwrap();
            let rounds = trainer.info().network.multiplies_bf16();
            assert_eq!(rounds, precision == Precision::Mixed && has_bf16());
            let [first, last] = losses(&mut trainer);
            println!("{name}, {normalization:?}, {precision:?}: {first:.4} to {last:.4}");
            assert!(last <= first, "{name}, {normalization:?}: {first} became {last}");
            measured.push(format!("{name} {first:.1e} to {last:.1e}"));
        }
    }
    shown!(Network, "2,000 steps on noise, on the darkest code and on one grey, by group and by batch normalisation, f32 and bf16",
        bound: "every step taken, all weights finite, the loss of the last 100 steps at most that of the first 20",
        measured: measured.join(", "));
}

#[test]
fn black_olats_are_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = project(folder.path());
    paint(&project, |_, _| 0.0);
    let (device, silent) = (Device::flex(), Progress::silent());
    let settings = settings(Normalization::Group, Precision::Full);
    let refused = Trainer::new(&project, &calibration, &settings, &device, &silent);
    let sentence = refused.err().expect("black teaches nothing").to_string();
    assert!(sentence.contains("has light on it"), "{sentence}");
    shown!(Network, "Training on OLATs that are fully black",
        done: "refused with a message that names the mattes' folder");
}
