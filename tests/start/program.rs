//! Trains the network that others start from, on virtual subjects alone: `make start`.

use base::Result;
use base::progress::{Progress, Report};
use calibration::{CalibrateSettings, Calibration, calibrate};
use chacha20::ChaCha8Rng;
use clap::Parser;
use footage::{ImportSettings, import};
use gpu::{ComputeDevice, DeviceChoice};
use project::Project;
use rand::{RngExt, SeedableRng};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use training::{Preset, Stage, TrainingConfig, train_together};
use virtual_stage::{Hair, LightKind, StageSettings, TroubleSettings, write_shoot};

/// Makes virtual subjects and trains one network on all of them.
#[derive(Debug, Parser)]
struct Options {
    /// How many subjects.
    #[arg(long, default_value_t = 32)]
    subjects: u64,
    /// The seed of the first one. Nothing else may be measured on these seeds.
    #[arg(long, default_value_t = 50_001)]
    first: u64,
    /// Working sizes in pixels, one after the other: a small one learns fast what a larger one goes on with.
    #[arg(long, value_delimiter = ',', default_values_t = [64])]
    sizes: Vec<usize>,
    /// Minutes of training at each size.
    #[arg(long, value_delimiter = ',', default_values_t = [15.0])]
    minutes: Vec<f64>,
    /// Where the subjects are kept: those that are there are not made again.
    #[arg(long, default_value = "target/start")]
    work: PathBuf,
    /// Where the network is written.
    #[arg(long, default_value = "assets/start")]
    to: PathBuf,
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    let say = |report: Report| {
        if let Report::Say(text) = report {
            println!("{text}");
        }
    };
    let progress = Progress::new(&say, base::progress::Control::default());
    let mut stages = Vec::new();
    for (&size, &minutes) in options.sizes.iter().zip(&options.minutes) {
        let mut projects = Vec::new();
        for seed in options.first..options.first + options.subjects {
            println!("subject {seed} at {size} pixels");
            projects.push(subject(options, seed, size)?);
        }
        stages.push(Stage { projects, minutes });
    }
    let config = TrainingConfig {
        // A longer memory than one subject's: each step shows another.
        averaging: 0.999,
        ..Preset::Quick.config()
    };
    let compute = ComputeDevice::choose(DeviceChoice::Cpu);
    train_together(&stages, &config, &options.to, &compute.device, &progress)?;
    println!("{} is written", options.to.display());
    Ok(())
}

/// A subject of its own build, skin and hair, in light of its own.
fn settings(seed: u64, size: usize) -> StageSettings {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut within = |low: f32, high: f32| low + (high - low) * random.random::<f32>();
    let hair = [Hair::Black, Hair::Brown, Hair::Red, Hair::Blond, Hair::Grey];
    let hair = hair.get(within(0.0, 8.0) as usize).copied();
    let interview_light = match within(0.0, 1.0) {
        x if x < 0.6 => LightKind::Banks,
        x if x < 0.8 => LightKind::Window,
        _ => LightKind::Softboxes,
    };
    StageSettings {
        frames: 1,
        size,
        seed,
        trouble: TroubleSettings {
            skin: Some(within(0.0, 1.0)),
            shine: Some(within(0.0, 1.0)),
            hair,
            glasses: Some(within(0.0, 1.0) < 0.25),
            build: Some([(); 3].map(|()| within(0.86, 1.14))),
            reseated: Some(within(0.0, 0.03)),
            interview_light: Some(interview_light),
            ambient: Some(within(0.0, 0.2)),
            ..TroubleSettings::NONE
        },
        ..StageSettings::default()
    }
}

/// Makes, imports and calibrates a subject, as far as that was not done before.
fn subject(options: &Options, seed: u64, size: usize) -> Result<(Project, Calibration)> {
    let silent = Progress::silent();
    let folder = options.work.join(seed.to_string());
    let (shoot, root) = (folder.join("shoot"), folder.join(format!("project-{size}")));
    if !shoot.join("manifest.json").exists() {
        let largest = options.sizes.iter().copied().max().unwrap_or(size);
        write_shoot(&shoot, &settings(seed, largest), &silent)?;
    }
    let import_settings = ImportSettings { size, seed };
    let mut project = opened(&root, || import(&root, &shoot, &import_settings, &silent))?;
    if !project.calibration_path().exists() {
        calibrate(&mut project, &CalibrateSettings::default(), &silent)?.save(&project)?;
    }
    let calibration = Calibration::load(&project)?;
    Ok((project, calibration))
}

fn opened(root: &Path, make: impl FnOnce() -> Result<Project>) -> Result<Project> {
    if root.join("project.toml").exists() {
        Project::open(root)
    } else {
        make()
    }
}
