//! A run of training: steps until its time is over, with checkpoints, logs and warnings as it goes.

use super::kept::{self, Why};
use super::log::Log;
use super::trainer::{StepReport, TrainReport, TrainSettings, Trainer};
use super::watch::Watch;
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
/// What cannot be written, as on a full disk, is waited for where a person is there ([`Progress::insist`]).
///
/// # Errors
/// When pictures cannot be read, the checkpoint cannot be written, the GPU is lost, or three steps in a row or the
/// weights are not finite: then the last good checkpoint stays.
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
        kept::put_aside(project)?;
    } else if project.checkpoint_path().join("checkpoint.toml").exists() {
        kept::keep(project, Why::Passing)?;
    }
    let fresh = trainer.info.step == 0;
    let mut logs = Logs::open(project, settings.hold_out.is_some(), fresh)?;
    let first_step = trainer.info.step;
    let config = &settings.config;
    let limit = config.minutes.map(|minutes| minutes * 60.0);
    let mut saved = Instant::now();
    let mut bad = 0;
    let (mut recent, mut watch) = (Recent::default(), Watch::default());
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
            trainer.check_weights()?;
            progress.insist(|| trainer.save(project))?;
            progress.insist(|| logs.flush())?;
            progress.say(format!("Paused after step {}", trainer.info.step));
            progress.wait_while_paused();
            saved = Instant::now();
            continue;
        }
        // Seconds count while the network learns: not while it waits for its turn or for a person.
        let turn = turn::DEVICE.take();
        let began = Instant::now();
        let report = trainer.step(done);
        let seconds = began.elapsed().as_secs_f64();
        trainer.info.seconds += seconds;
        drop(turn);
        progress.insist(|| logs.steps.step(&trainer.info, &report))?;
        watch.step(&report, seconds);
        watch.predict(&trainer, config.minutes, progress);
        if report.taken {
            bad = 0;
            recent.add(&report);
        } else {
            bad += 1;
            progress.say(format!(
                "Step {} was not finite and has been skipped",
                trainer.info.step
            ));
            if bad == MOST_BAD_STEPS {
                return Err(Error::unexpected(
                    "training",
                    "finite losses",
                    format!("{bad} steps in a row that are not"),
                    "The last checkpoint is kept. Check the pictures for blown or empty exemplars",
                ));
            }
        }
        progress.step(
            "training",
            (done * 1000.0) as u64,
            1000,
            recent.note(trainer.info.step),
        );
        if trainer.info.step.is_multiple_of(LOOK_STEPS) {
            recent.judge(&mut trainer, &mut logs, &mut watch, progress)?;
            if dead.look(trainer.dead_lamps().unwrap_or_default()) {
                progress.say(dead.warning(names));
            }
        }
        watch.tell(&trainer, &report, &dead.sure, progress);
        watch.show(&trainer, false, progress);
        if saved.elapsed().as_secs_f64() >= config.checkpoint_seconds {
            save(project, &trainer, &mut logs, progress)?;
            saved = Instant::now();
        }
        last = Some(report);
    }
    recent.judge(&mut trainer, &mut logs, &mut watch, progress)?;
    save(project, &trainer, &mut logs, progress)?;
    if let Some(report) = last {
        watch.tell(&trainer, &report, &dead.sure, progress);
        watch.show(&trainer, true, progress);
    }
    progress.step("training", 1000, 1000, recent.note(trainer.info.step));
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
        loss_rec: recent.reconstruction.unwrap_or(f32::NAN),
        loss_render: recent.rendering.unwrap_or(f32::NAN),
        skipped_steps: watch.skipped(),
        held_out: trainer.info.held_out,
        dead_lamps: dead.names(names),
    })
}

/// Writes the checkpoint and keeps it in the list.
fn save(project: &Project, trainer: &Trainer, logs: &mut Logs, progress: &Progress) -> Result<()> {
    trainer.check_weights()?;
    progress.insist(|| trainer.save(project))?;
    progress.insist(|| logs.flush())?;
    if let Err(e) = kept::keep(project, Why::Passing) {
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
    judgements: Option<Log>,
}

impl Logs {
    fn open(project: &Project, judged: bool, fresh: bool) -> Result<Self> {
        // A run without a judge forgets what another's said.
        let judgements = Log::judgements(project, fresh)?;
        Ok(Self {
            steps: Log::steps(project, fresh)?,
            judgements: judged.then_some(judgements),
        })
    }

    fn flush(&mut self) -> Result<()> {
        self.steps.flush()?;
        self.judgements.iter_mut().try_for_each(Log::flush)
    }
}

/// Lamps whose outputs have stopped learning.
#[derive(Default)]
struct DeadLamps {
    /// Those of the last look.
    seen: Vec<usize>,
    /// Those of the last two: one look may meet a lamp on its way.
    sure: Vec<usize>,
}

impl DeadLamps {
    /// Takes in what a look found; whether there is something new to say.
    fn look(&mut self, found: Vec<usize>) -> bool {
        let mut sure = found.clone();
        sure.retain(|lamp| self.seen.contains(lamp));
        self.seen = found;
        let new = sure.iter().any(|lamp| !self.sure.contains(lamp));
        self.sure = sure;
        new
    }

    fn names(&self, lamps: &[String]) -> Vec<String> {
        self.sure.iter().map(|&lamp| lamps[lamp].clone()).collect()
    }

    fn warning(&self, lamps: &[String]) -> String {
        format!(
            "Dead output: {} of {} lamps ({}) are stuck at black or white and hardly learn any more. Stop, and \
             start over with --fresh and a lower rate, such as --set learning-rate=3e-4",
            self.sure.len(),
            lamps.len(),
            self.names(lamps).join(", ")
        )
    }
}

/// Losses smoothed over about twenty steps.
#[derive(Default)]
struct Recent {
    reconstruction: Option<f32>,
    rendering: Option<f32>,
    held_out: Option<f32>,
}

impl Recent {
    /// Judges by the pose that was held out, where one was.
    fn judge(
        &mut self,
        trainer: &mut Trainer,
        logs: &mut Logs,
        watch: &mut Watch,
        progress: &Progress,
    ) -> Result<()> {
        let Some(decibels) = trainer.judge() else {
            return Ok(());
        };
        self.held_out = Some(decibels);
        watch.judged(decibels);
        logs.judgements
            .iter_mut()
            .try_for_each(|log| progress.insist(|| log.judgement(trainer.info(), decibels)))
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
