//! A training run: steps until the end of its time, with checkpoints, logs and warnings.

use super::checkpoints::{self, Reason};
use super::config::TrainSettings;
use super::log::Log;
use super::monitor::Monitor;
use super::report::{StepReport, TrainReport};
use super::trainer::Trainer;
use base::error::{Error, Result};
use base::progress::Progress;
use base::turn;
use burn::module::Module;
use calibration::Calibration;
use gpu::ComputeDevice;
use project::Project;
use std::time::Instant;

/// Steps between two checks of the network, each of which costs a prediction or two.
const CHECK_STEPS: u64 = 100;
/// Number of skipped steps in a row that ends a run.
const MAX_BAD_STEPS: u32 = 3;

/// Trains the project's network until the end of the schedule or the time, or until the user stops; in
/// each case the checkpoint is written. Every step's losses go to `training.csv`. Its checkpoints,
/// including the initial one, are kept in a list that thins out with age.
///
/// If a file cannot be written, as on a full disk, and a user is present, it waits ([`Progress::retry`]).
///
/// # Errors
/// When pictures cannot be read, the checkpoint cannot be written, the GPU is lost, three steps in a row are skipped, or
/// weights are not finite: then the last good checkpoint stays.
pub fn train(
    project: &Project,
    calibration: &Calibration,
    settings: &TrainSettings,
    progress: &Progress,
) -> Result<TrainReport> {
    let compute = ComputeDevice::choose(settings.device);
    progress.say(format!("The network runs on the {}", compute.description));
    compute.guarded(|| {
        let trainer = Trainer::new(project, calibration, settings, &compute.device, progress)?;
        let mut run = Run::start(project, settings, trainer, progress)?;
        run.learn()?;
        run.finish(&compute)
    })
}

/// State of a run.
struct Run<'a> {
    project: &'a Project,
    settings: &'a TrainSettings,
    progress: &'a Progress<'a>,
    trainer: Trainer,
    logs: Logs,
    losses: SmoothedLosses,
    monitor: Monitor,
    dead: DeadLamps,
    /// Steps of earlier runs.
    first_step: u64,
    /// Skipped steps in a row.
    bad_steps: u32,
    last: Option<StepReport>,
    saved: Instant,
}

impl<'a> Run<'a> {
    /// Announces the training, and saves the earlier checkpoint.
    fn start(
        project: &'a Project,
        settings: &'a TrainSettings,
        trainer: Trainer,
        progress: &'a Progress<'a>,
    ) -> Result<Self> {
        progress.say(format!(
            "The network: {}; the pictures take {} MB more",
            trainer.info.network.cost(),
            trainer.data.bytes() / 1_000_000
        ));
        progress.say(format!("Pictures are compared by {}", trainer.features()));
        // An earlier checkpoint is never lost.
        if settings.fresh {
            checkpoints::set_aside(project)?;
        } else if project.checkpoint_path().join("checkpoint.toml").exists() {
            checkpoints::keep(project, Reason::Automatic)?;
        }
        let first_step = trainer.info.step;
        Ok(Self {
            project,
            settings,
            progress,
            logs: Logs::open(project, settings.hold_out.is_some(), first_step == 0)?,
            trainer,
            losses: SmoothedLosses::default(),
            monitor: Monitor::default(),
            dead: DeadLamps::default(),
            first_step,
            bad_steps: 0,
            last: None,
            saved: Instant::now(),
        })
    }

    /// Makes steps until the run is done or the user stops.
    fn learn(&mut self) -> Result<()> {
        loop {
            let done = self.done();
            if done >= 1.0 || self.progress.cancelled() {
                return Ok(());
            }
            if self.progress.paused() {
                self.pause()?;
            } else {
                self.step(done)?;
            }
        }
    }

    /// Finished share of the run, by time or by steps.
    fn done(&self) -> f64 {
        let info = &self.trainer.info;
        let minutes = self.settings.config.minutes;
        let by_time = minutes.map_or(0.0, |minutes| info.seconds / (60.0 * minutes));
        let by_step = info.step as f64 / self.trainer.schedule.steps().max(1) as f64;
        by_time.max(by_step).min(1.0)
    }

    /// Writes the checkpoint and waits for the end of a pause.
    fn pause(&mut self) -> Result<()> {
        self.trainer.check_weights()?;
        self.progress.retry(|| self.trainer.save(self.project))?;
        self.progress.retry(|| self.logs.flush())?;
        self.progress.say(format!("Paused after step {}", self.trainer.info.step));
        self.progress.wait_while_paused();
        self.saved = Instant::now();
        Ok(())
    }

    /// Makes a step, and what is due after it; `done` is the finished share of the run.
    fn step(&mut self, done: f64) -> Result<()> {
        // Only learning counts as time, not waiting for the device or the user.
        let turn = turn::DEVICE.lock();
        let began = Instant::now();
        let report = self.trainer.step(done);
        let seconds = began.elapsed().as_secs_f64();
        self.trainer.info.seconds += seconds;
        drop(turn);
        let (config, progress) = (&self.settings.config, self.progress);
        progress.retry(|| self.logs.steps.step(&self.trainer.info, &report))?;
        self.monitor.step(&report, seconds);
        self.monitor.estimate(&self.trainer, config.minutes, progress);
        self.note(&report)?;
        let step = self.trainer.info.step;
        progress.step("training", (done * 1000.0) as u64, 1000, self.losses.note(step));
        if step.is_multiple_of(CHECK_STEPS) {
            self.check()?;
        }
        self.monitor.report(&self.trainer, &report, &self.dead.confirmed, progress);
        self.monitor.show(&self.trainer, false, progress);
        if self.saved.elapsed().as_secs_f64() >= config.checkpoint_seconds {
            self.save()?;
        }
        self.last = Some(report);
        Ok(())
    }

    /// Records the losses of a step, or that it was skipped.
    fn note(&mut self, report: &StepReport) -> Result<()> {
        if report.taken {
            self.bad_steps = 0;
            self.losses.add(report);
            return Ok(());
        }
        self.bad_steps += 1;
        self.progress
            .say(format!("Step {} was skipped: a loss or gradient was NaN or infinite", self.trainer.info.step));
        if self.bad_steps < MAX_BAD_STEPS {
            return Ok(());
        }
        Err(Error::invalid(
            format!("training stopped: {} steps in a row had losses that are not finite", self.bad_steps),
            "The last checkpoint is kept. Check the pictures for blown-out or empty exemplars",
        ))
    }

    /// Scores the network on the held-out pose, and checks one exemplar after another for dead lamps.
    fn check(&mut self) -> Result<()> {
        self.validate()?;
        let exemplar = (self.trainer.info.step / CHECK_STEPS) as usize;
        let dead = self.trainer.dead_lamps(exemplar).unwrap_or_default();
        if self.dead.update(dead) {
            let lamps = &self.project.settings.shoot.lamps;
            self.progress.advise(self.dead.warning(lamps), "--fresh --set learning-rate=3e-4");
        }
        Ok(())
    }

    /// Scores the network on the held-out pose, if there is one.
    fn validate(&mut self) -> Result<()> {
        let Some(decibels) = self.trainer.validate() else { return Ok(()) };
        self.losses.held_out = Some(decibels);
        self.monitor.validated(decibels);
        let (progress, info) = (self.progress, self.trainer.info());
        self.logs.held_out.iter_mut().try_for_each(|log| progress.retry(|| log.held_out_score(info, decibels)))
    }

    /// Writes the checkpoint and keeps it in the list.
    fn save(&mut self) -> Result<()> {
        let progress = self.progress;
        self.trainer.check_weights()?;
        progress.retry(|| self.trainer.save(self.project))?;
        progress.retry(|| self.logs.flush())?;
        if let Err(e) = checkpoints::keep(self.project, Reason::Automatic) {
            // The checkpoint itself is written; a failure to list it does not end a run.
            progress.report(e.to_string(), &e);
        }
        progress.saved();
        self.saved = Instant::now();
        Ok(())
    }

    /// Writes the last checkpoint and reports.
    fn finish(mut self, compute: &ComputeDevice) -> Result<TrainReport> {
        self.validate()?;
        self.save()?;
        let (progress, info) = (self.progress, self.trainer.info());
        if let Some(report) = self.last {
            self.monitor.report(&self.trainer, &report, &self.dead.confirmed, progress);
            self.monitor.show(&self.trainer, true, progress);
        }
        progress.step("training", 1000, 1000, self.losses.note(info.step));
        if progress.cancelled() {
            progress.say(format!(
                "Stopped after {} steps; the checkpoint is kept, and training continues from it",
                info.step - self.first_step
            ));
        } else if info.step == self.first_step {
            progress.advise(
                "The run was already complete: give it more time, or start over",
                "--minutes or --epochs, or --fresh",
            );
        }
        Ok(TrainReport {
            steps: info.step,
            seconds: info.seconds,
            device: compute.description.clone(),
            features: self.trainer.features(),
            parameters: self.trainer.average.num_params(),
            loss_rec: self.losses.reconstruction.unwrap_or(f32::NAN),
            loss_render: self.losses.rendering.unwrap_or(f32::NAN),
            skipped_steps: self.monitor.skipped(),
            held_out: info.held_out,
            prediction: None,
            dead_lamps: self.dead.names(&self.project.settings.shoot.lamps),
        })
    }
}

/// The logs of a run.
struct Logs {
    steps: Log,
    /// None if no pose is held out.
    held_out: Option<Log>,
}

impl Logs {
    fn open(project: &Project, held_out: bool, fresh: bool) -> Result<Self> {
        // A run without a held-out pose drops the scores of an earlier run.
        let log = Log::held_out(project, fresh)?;
        Ok(Self { steps: Log::steps(project, fresh)?, held_out: held_out.then_some(log) })
    }

    fn flush(&mut self) -> Result<()> {
        self.steps.flush()?;
        self.held_out.iter_mut().try_for_each(Log::flush)
    }
}

/// Lamps whose outputs have stopped learning.
#[derive(Default)]
struct DeadLamps {
    /// Dead lamps of the last check.
    previous: Vec<usize>,
    /// Dead lamps of the last two checks: in a single check a lamp may just be passing through black or white.
    confirmed: Vec<usize>,
}

impl DeadLamps {
    /// Records the result of a check; returns true if lamps have newly died.
    fn update(&mut self, found: Vec<usize>) -> bool {
        let mut sure = found.clone();
        sure.retain(|lamp| self.previous.contains(lamp));
        self.previous = found;
        let new = sure.iter().any(|lamp| !self.confirmed.contains(lamp));
        self.confirmed = sure;
        new
    }

    fn names(&self, lamps: &[String]) -> Vec<String> {
        self.confirmed.iter().map(|&lamp| lamps[lamp].clone()).collect()
    }

    fn warning(&self, lamps: &[String]) -> String {
        format!(
            "Dead output: {} of {} lamps ({}) are stuck at black or white and hardly learn any more. Stop, and \
             start over with a lower learning rate, such as 3e-4",
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
    fn add(&mut self, report: &StepReport) {
        let smooth = |old: Option<f32>, new: f32| Some(old.map_or(new, |old| 0.95 * old + 0.05 * new));
        if let Some(rendering) = report.rendering {
            self.rendering = smooth(self.rendering, rendering);
        }
        if let Some(reconstruction) = report.reconstruction {
            self.reconstruction = smooth(self.reconstruction, reconstruction);
        }
    }

    fn note(&self, step: u64) -> String {
        let show = |loss: Option<f32>| loss.map_or("–".to_owned(), |l| format!("{l:.4}"));
        let mut note = format!("step {step}, OLATs {}, relit {}", show(self.reconstruction), show(self.rendering));
        if let Some(decibels) = self.held_out {
            note += &format!(", held-out pose {decibels:.2} dB");
        }
        note
    }
}
