//! One network for many subjects, which others start from.

use super::config::{StartsFrom, TrainSettings, TrainingConfig};
use super::data::TrainingData;
use super::trainer::Trainer;
use base::error::{Error, Result};
use base::progress::Progress;
use burn::tensor::Device;
use calibration::Calibration;
use gpu::DeviceChoice;
use project::Project;
use reflectance::checkpoint;
use reflectance::start::StartLamps;
use std::path::Path;
use std::time::Instant;

/// Every how many steps a line says how it goes.
const SAID: u64 = 500;

/// A part of the training: projects of one working size, and its minutes.
pub struct Stage {
    pub projects: Vec<(Project, Calibration)>,
    pub minutes: f64,
}

/// Trains one network on the poses of all projects, which have the same lamps and as many poses, a pose of another project
/// in each step, and writes it into the folder `to` as what others start from. A stage at a larger size goes on with the
/// network of the one before.
///
/// # Errors
/// When there is no project, a file cannot be read or written, lamps or poses differ, or a stop was asked for.
pub fn train_together(
    stages: &[Stage],
    config: &TrainingConfig,
    to: &Path,
    device: &Device,
    progress: &Progress,
) -> Result<()> {
    let config = TrainingConfig {
        start: StartsFrom::Nothing,
        // Light that nobody photographed says nothing that holds for others.
        video_epochs: 0,
        ..config.clone()
    };
    let mut before: Option<Trainer> = None;
    for stage in stages {
        before = Some(train_stage(stage, before, &config, to, device, progress)?);
    }
    Ok(())
}

fn train_stage(
    stage: &Stage,
    before: Option<Trainer>,
    config: &TrainingConfig,
    to: &Path,
    device: &Device,
    progress: &Progress,
) -> Result<Trainer> {
    let Some((first, calibration)) = stage.projects.first() else {
        return Err(Error::invalid(
            "there are no projects to learn from",
            "Name one at least",
        ));
    };
    let settings = TrainSettings {
        config: config.clone(),
        exclude_frames: Vec::new(),
        hold_out: None,
        fresh: true,
        device: DeviceChoice::Cpu,
    };
    let mut trainer = Trainer::new(first, calibration, &settings, device, progress)?;
    if let Some(before) = before {
        trainer.go_on_from(&before)?;
    }
    let autodiff = device.clone().autodiff();
    let (lamps, poses) = (trainer.info.network.lamps, trainer.data.exemplars.len());
    let mut others = Vec::with_capacity(stage.projects.len());
    let mut mean_output = f64::from(trainer.data.mean_output);
    for (project, calibration) in &stage.projects[1..] {
        let silent = Progress::silent();
        let data = TrainingData::load(project, calibration, config, &[], None, &autodiff, &silent)?;
        if calibration.rig.lamps.len() != lamps || data.exemplars.len() != poses {
            return Err(Error::invalid(
                format!(
                    "{} has {} lamps and {} poses, not {lamps} and {poses} as the first",
                    project.root.display(),
                    calibration.rig.lamps.len(),
                    data.exemplars.len()
                ),
                "Leave it out",
            ));
        }
        mean_output += f64::from(data.mean_output);
        others.push(data);
    }
    let start = Instant::now();
    let (mut sum, mut count) = (0.0, 0);
    for step in 1u64.. {
        let done = start.elapsed().as_secs_f64() / (60.0 * stage.minutes);
        progress.check("the stages before are written")?;
        if done >= 1.0 {
            break;
        }
        // All in turn, each with all of its poses.
        if let Some(place) = (step as usize).checked_rem(others.len()) {
            let next = others.remove(place);
            let old = trainer.exchange(next);
            others.push(old);
        }
        let report = trainer.step(done);
        if let (true, Some(loss)) = (report.taken, report.reconstruction) {
            (sum, count) = (sum + f64::from(loss), count + 1);
        }
        if step.is_multiple_of(SAID) {
            progress.say(format!(
                "step {step}, {:.0} %: OLATs {:.4}",
                100.0 * done,
                sum / f64::from(count.max(1))
            ));
            (sum, count) = (0.0, 0);
        }
    }
    trainer.check_weights()?;
    trainer.save(first)?;
    checkpoint::pack(&first.checkpoint_path(), to)?;
    let mean_output = (mean_output / stage.projects.len() as f64) as f32;
    StartLamps::of(&calibration.rig, mean_output).save(to)?;
    Ok(trainer)
}
