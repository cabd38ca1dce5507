//! A run of training: steps until its time is over, with checkpoints, logs and warnings as it goes.

use super::checkpoints::{self, Reason};
use super::log::Log;
use super::monitor::Monitor;
use super::trainer::{StepReport, TrainReport, TrainSettings, Trainer};
use base::error::{Error, Result};
use base::progress::Progress;
use base::turn;
use burn::module::Module;
use calibration::Calibration;
use gpu::ComputeDevice;
use project::Project;
use std::time::Instant;

/// Steps between two looks at the network from outside: each costs a prediction or two.
pub(super) const LOOK_STEPS: u64 = 100;
/// This many steps in a row that are not finite end a run.
const MOST_BAD_STEPS: u32 = 3;

/// Trains the project's network until the schedule or the time is over or a stop is asked for; in
/// each case the checkpoint is written. Every step's losses go to `training.csv`. Checkpoints that it
/// passes are kept in a list that thins out as they age, and the one that it begins at is in that list.
///
/// What cannot be written, as on a full disk, is waited for where a person is there ([`Progress::retry`]).
///
/// # Errors
/// When pictures cannot be read, the checkpoint cannot be written, the GPU is lost, or three steps in a row are not
/// finite: then the last good checkpoint stays.
pub fn train(
    project: &Project,
    calibration: &Calibration,
    settings: &TrainSettings,
    progress: &Progress,
) -> Result<TrainReport> {
    let compute = ComputeDevice::choose(settings.device);
    progress.say(format!("The network runs on the {}", compute.description));
    compute.guarded(|| learn(project, calibration, settings, &compute, progress))
}

fn learn(
    project: &Project,
    calibration: &Calibration,
    settings: &TrainSettings,
    compute: &ComputeDevice,
    progress: &Progress,
) -> Result<TrainReport> {
    let mut trainer = Trainer::new(project, calibration, settings, &compute.device, progress)?;
    progress.say(format!(
        "The network: {}; the pictures take {} MB more",
        trainer.info.network.cost(),
        trainer.data.bytes() / 1_000_000
    ));
    progress.say(format!("Pictures are compared by {}", trainer.features()));
    // Nothing that was trained before is lost, whatever becomes of this run.
    if settings.fresh {
        checkpoints::set_aside(project)?;
    } else if project.checkpoint_path().join("checkpoint.toml").exists() {
        checkpoints::keep(project, Reason::Automatic)?;
    }
    let fresh = trainer.info.step == 0;
    let mut logs = Logs::open(project, settings.hold_out.is_some(), fresh)?;
    let first_step = trainer.info.step;
    let config = &settings.config;
    let limit = config.minutes.map(|minutes| minutes * 60.0);
    let mut saved = Instant::now();
    let mut bad = 0;
    let (mut losses, mut monitor) = (SmoothedLosses::default(), Monitor::default());
    let mut last = None;
    let (mut dead, names) = (DeadLamps::default(), &project.settings.shoot.lamps);
    loop {
        let by_time = limit.map_or(0.0, |limit| trainer.info.seconds / limit);
        let steps = trainer.schedule.steps();
        let by_step = trainer.info.step as f64 / steps.max(1) as f64;
        let done = by_time.max(by_step).min(1.0);
        if done >= 1.0 || progress.cancelled() {
            break;
        }
        if progress.paused() {
            progress.retry(|| trainer.save(project))?;
            progress.retry(|| logs.flush())?;
            progress.say(format!("Paused after step {}", trainer.info.step));
            progress.wait_while_paused();
            saved = Instant::now();
            continue;
        }
        // Seconds count while the network learns: not while it waits for its turn or for a person.
        let turn = turn::DEVICE.lock();
        let began = Instant::now();
        let report = trainer.step(done);
        let seconds = began.elapsed().as_secs_f64();
        trainer.info.seconds += seconds;
        drop(turn);
        progress.retry(|| logs.steps.step(&trainer.info, &report))?;
        monitor.step(&report, seconds);
        monitor.estimate(&trainer, config.minutes, progress);
        if report.taken {
            bad = 0;
            losses.add(&report);
        } else {
            bad += 1;
            progress.say(format!(
                "Step {} was not finite and has been skipped",
                trainer.info.step
            ));
            if bad == MOST_BAD_STEPS {
                return Err(Error::invalid(
                    format!(
                        "training stopped: {bad} steps in a row had losses that are not finite"
                    ),
                    "The last checkpoint is kept. Check the pictures for blown-out or empty exemplars",
                ));
            }
        }
        progress.step(
            "training",
            (done * 1000.0) as u64,
            1000,
            losses.note(trainer.info.step),
        );
        if trainer.info.step.is_multiple_of(LOOK_STEPS) {
            losses.validate(&mut trainer, &mut logs, &mut monitor, progress)?;
            if dead.update(trainer.dead_lamps().unwrap_or_default()) {
                progress.say(dead.warning(names));
            }
        }
        monitor.report(&trainer, &report, &dead.confirmed, progress);
        monitor.show(&trainer, false, progress);
        if saved.elapsed().as_secs_f64() >= config.checkpoint_seconds {
            save(project, &trainer, &mut logs, progress)?;
            saved = Instant::now();
        }
        last = Some(report);
    }
    losses.validate(&mut trainer, &mut logs, &mut monitor, progress)?;
    save(project, &trainer, &mut logs, progress)?;
    if let Some(report) = last {
        monitor.report(&trainer, &report, &dead.confirmed, progress);
        monitor.show(&trainer, true, progress);
    }
    progress.step("training", 1000, 1000, losses.note(trainer.info.step));
    if progress.cancelled() {
        progress.say(format!(
            "Stopped after {} steps; the checkpoint is kept, and training goes on from it",
            trainer.info.step - first_step
        ));
    } else if trainer.info.step == first_step {
        progress.say(
            "The run was complete before: ask for more with --minutes or --epochs, or start over with --fresh",
        );
    }
    Ok(TrainReport {
        steps: trainer.info.step,
        seconds: trainer.info.seconds,
        device: compute.description.clone(),
        features: trainer.features(),
        parameters: trainer.average.num_params(),
        loss_rec: losses.reconstruction.unwrap_or(f32::NAN),
        loss_render: losses.rendering.unwrap_or(f32::NAN),
        skipped_steps: monitor.skipped(),
        held_out: trainer.info.held_out,
        dead_lamps: dead.names(names),
    })
}

/// Writes the checkpoint and keeps it in the list.
fn save(project: &Project, trainer: &Trainer, logs: &mut Logs, progress: &Progress) -> Result<()> {
    progress.retry(|| trainer.save(project))?;
    progress.retry(|| logs.flush())?;
    if let Err(e) = checkpoints::keep(project, Reason::Automatic) {
        // The checkpoint itself is written: that there is no way back to it ends no run.
        progress.say(e.to_string());
    }
    progress.saved();
    Ok(())
}

/// What a run writes down.
struct Logs {
    steps: Log,
    /// Where a pose is held out.
    held_out: Option<Log>,
}

impl Logs {
    fn open(project: &Project, held_out: bool, fresh: bool) -> Result<Self> {
        // A run that holds out no pose forgets the scores of one that did.
        let log = Log::held_out(project, fresh)?;
        Ok(Self {
            steps: Log::steps(project, fresh)?,
            held_out: held_out.then_some(log),
        })
    }

    fn flush(&mut self) -> Result<()> {
        self.steps.flush()?;
        self.held_out.iter_mut().try_for_each(Log::flush)
    }
}

/// Lamps whose outputs have stopped learning.
#[derive(Default)]
struct DeadLamps {
    /// Those of the last check.
    previous: Vec<usize>,
    /// Those of the last two: one check may meet a lamp on its way.
    confirmed: Vec<usize>,
}

impl DeadLamps {
    /// Takes in what a check found; whether there is something new to say.
    fn update(&mut self, found: Vec<usize>) -> bool {
        let mut sure = found.clone();
        sure.retain(|lamp| self.previous.contains(lamp));
        self.previous = found;
        let new = sure.iter().any(|lamp| !self.confirmed.contains(lamp));
        self.confirmed = sure;
        new
    }

    fn names(&self, lamps: &[String]) -> Vec<String> {
        self.confirmed
            .iter()
            .map(|&lamp| lamps[lamp].clone())
            .collect()
    }

    fn warning(&self, lamps: &[String]) -> String {
        format!(
            "Dead output: {} of {} lamps ({}) are stuck at black or white and hardly learn any more. Stop, and \
             start over with --fresh and a lower rate, such as --set learning-rate=3e-4",
            self.confirmed.len(),
            lamps.len(),
            self.names(lamps).join(", ")
        )
    }
}

/// Losses smoothed over about twenty steps.
#[derive(Default)]
struct SmoothedLosses {
    reconstruction: Option<f32>,
    rendering: Option<f32>,
    held_out: Option<f32>,
}

impl SmoothedLosses {
    /// Judges by the pose that was held out, where one was.
    fn validate(
        &mut self,
        trainer: &mut Trainer,
        logs: &mut Logs,
        monitor: &mut Monitor,
        progress: &Progress,
    ) -> Result<()> {
        let Some(decibels) = trainer.validate() else {
            return Ok(());
        };
        self.held_out = Some(decibels);
        monitor.validated(decibels);
        logs.held_out
            .iter_mut()
            .try_for_each(|log| progress.retry(|| log.held_out_score(trainer.info(), decibels)))
    }

    fn add(&mut self, report: &StepReport) {
        let smooth =
            |old: Option<f32>, new: f32| Some(old.map_or(new, |old| 0.95 * old + 0.05 * new));
        if let Some(rendering) = report.rendering {
            self.rendering = smooth(self.rendering, rendering);
        }
        if let Some(reconstruction) = report.reconstruction {
            self.reconstruction = smooth(self.reconstruction, reconstruction);
        }
    }

    fn note(&self, step: u64) -> String {
        let show = |loss: Option<f32>| loss.map_or("–".to_owned(), |l| format!("{l:.4}"));
        let mut note = format!(
            "step {step}, OLATs {}, relit {}",
            show(self.reconstruction),
            show(self.rendering)
        );
        if let Some(decibels) = self.held_out {
            note += &format!(", unseen pose {decibels:.2} dB");
        }
        note
    }
}
