//! Live figures of a run a few times a second, and pictures now and then.

use super::pose_prediction::PosePrediction;
use super::report::StepReport;
use super::schedule::SampleSource;
use super::trainer::Trainer;
use base::memory;
use base::progress::{LossPoint, Progress, TrainingPhase, TrainingPictures, TrainingPoint};
use base::turn;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two reports.
const POINT_INTERVAL: Duration = Duration::from_millis(250);
/// Least time between two sets of pictures …
const PICTURES_INTERVAL: Duration = Duration::from_secs(2);
/// … and least multiple of the last set's duration, so that pictures cost at most a hundredth of training.
const PICTURES_SHARE: u32 = 100;
/// Number of steps before the run's duration is estimated.
const FIRST_STEPS: u64 = 20;

/// Events since the last report.
#[derive(Default)]
pub(super) struct Monitor {
    reconstruction: Mean,
    rendering: Mean,
    held_out_db: Option<f32>,
    /// Mean duration of a step, over about twenty.
    step_seconds: Option<f64>,
    steps: u64,
    skipped: u64,
    reported: Option<Instant>,
    pictures_due: Option<Instant>,
    truth: Option<Arc<Vec<u8>>>,
}

#[derive(Default)]
struct Mean {
    sum: f32,
    count: u32,
}

impl Mean {
    fn add(&mut self, value: Option<f32>) {
        self.sum += value.unwrap_or_default();
        self.count += u32::from(value.is_some());
    }

    fn take(&mut self) -> Option<f32> {
        let Self { sum, count } = std::mem::take(self);
        (count > 0).then(|| sum / count as f32)
    }
}

impl Monitor {
    /// Records a step and its seconds.
    pub fn step(&mut self, report: &StepReport, seconds: f64) {
        self.steps += 1;
        self.skipped += u64::from(!report.taken);
        if report.taken {
            self.reconstruction.add(report.reconstruction);
            self.rendering.add(report.rendering);
        }
        // The first step allocates and tunes.
        if self.steps > 1 {
            let old = self.step_seconds.unwrap_or(seconds);
            self.step_seconds = Some(old + 0.05 * (seconds - old));
        }
    }

    /// Records the score on the held-out pose.
    pub fn validated(&mut self, decibels: f32) {
        self.held_out_db = Some(decibels);
    }

    /// Number of skipped steps.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Reports the state of the run after step `report`, if a report is due or the held-out pose was scored; `dead` are
    /// the lamps whose outputs have died.
    pub fn report(&mut self, trainer: &Trainer, report: &StepReport, dead: &[usize], progress: &Progress) {
        let due = self.reported.is_none_or(|reported| reported.elapsed() >= POINT_INTERVAL);
        if !due && self.held_out_db.is_none() {
            return;
        }
        self.reported = Some(Instant::now());
        let info = trainer.info();
        let phase = match trainer.schedule.source(info.step.saturating_sub(1)) {
            SampleSource::Exemplar { .. } => TrainingPhase::Exemplars,
            SampleSource::Frame { .. } => TrainingPhase::Interview,
        };
        progress.training(TrainingPoint {
            losses: LossPoint {
                step: info.step,
                seconds: info.seconds,
                reconstruction: self.reconstruction.take(),
                rendering: self.rendering.take(),
                held_out_db: self.held_out_db.take(),
            },
            phase,
            learning_rate: report.learning_rate,
            gradient_norm: report.gradient_norm,
            steps_per_second: self.step_seconds.map_or(0.0, |seconds| 1.0 / seconds.max(1e-9)),
            multiply_adds: info.network.cost().multiply_adds,
            memory_bytes: memory::held(),
            skipped_steps: self.skipped,
            dead_lamps: dead.to_vec(),
        });
    }

    /// Announces once, after the first steps, the duration of the run if it ends after `minutes`.
    pub fn estimate(&self, trainer: &Trainer, minutes: Option<f64>, progress: &Progress) {
        if self.steps != FIRST_STEPS {
            return;
        }
        let Some(step) = self.step_seconds else { return };
        let info = trainer.info();
        let left = trainer.schedule.steps().saturating_sub(info.step);
        let by_steps = left as f64 * step;
        let by_time = minutes.map_or(f64::INFINITY, |minutes| 60.0 * minutes - info.seconds);
        let seconds = by_steps.min(by_time).max(0.0);
        progress.say(format!(
            "A step takes {step:.3} s: about {:.0} more steps in {:.1} minutes",
            seconds / step.max(1e-9),
            seconds / 60.0
        ));
    }

    /// Shows a predicted pose, the held-out one or the first, if a viewer is open and it is due or the `last` time.
    pub fn show(&mut self, trainer: &Trainer, last: bool, progress: &Progress) {
        let began = Instant::now();
        let due = last || self.pictures_due.is_none_or(|due| began >= due);
        if !progress.wants_pictures() || !due {
            return;
        }
        let pictures = {
            let _turn = turn::DEVICE.lock();
            self.pictures(trainer)
        };
        if let Some(pictures) = pictures {
            progress.show(pictures);
        }
        let pause = (began.elapsed() * PICTURES_SHARE).max(PICTURES_INTERVAL);
        self.pictures_due = Some(Instant::now() + pause);
    }

    fn pictures(&mut self, trainer: &Trainer) -> Option<TrainingPictures> {
        let (pose, sample) = trainer.shown_sample();
        let info = trainer.info();
        let prediction = PosePrediction::new(&trainer.average, info, sample, trainer.data.olat_gain);
        let truth = match &self.truth {
            Some(truth) => truth.clone(),
            None => Arc::new(prediction.truth_bytes()?),
        };
        self.truth = Some(truth.clone());
        Some(TrainingPictures {
            step: info.step,
            pose,
            held_out: trainer.data.held_out.is_some(),
            size: prediction.picture_size(),
            predicted: prediction.predicted_bytes()?,
            truth,
        })
    }
}
