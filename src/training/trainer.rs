//! The trainer: a network, its optimiser and its pictures, and one lesson a step.

use super::adam::Adam;
use super::config::TrainingConfig;
use super::data::{self, Look, TrainingData};
use super::features::{Features, rows};
use super::judge::Attempt;
use super::loss::Criterion;
use super::run::LOOK_STEPS;
use super::schedule::{self, Schedule};
use super::{augment, average, gradient};
use base::error::{Error, Result};
use base::progress::Progress;
use burn::module::Module;
use burn::optim::{GradientsParams, ModuleOptimizer};
use burn::tensor::{Device, Tensor};
use calibration::Calibration;
use gpu::DeviceChoice;
use project::Project;
use reflectance::UNet;
use reflectance::checkpoint::{self, CheckpointInfo, HeldOut, Resumed, TrainingState};
use reflectance::kernels::{Comparison, LossSettings};
use reflectance::predictor::check_fits;
use reflectance::render::{encode, light};
use serde::Serialize;
use std::path::PathBuf;

/// What a person asks of a run.
#[derive(Clone, Debug)]
pub struct TrainSettings {
    pub config: TrainingConfig,
    /// Interview frames that training must not see.
    pub exclude_frames: Vec<usize>,
    /// A pose, from 0, that training does not see and that judges it: the network that does best there
    /// is the one that predicts.
    pub hold_out: Option<usize>,
    /// Start over, where a checkpoint would be gone on from.
    pub fresh: bool,
    pub device: DeviceChoice,
}

/// What a run did.
#[derive(Clone, Debug, Serialize)]
pub struct TrainReport {
    /// Steps made since the start, earlier runs counted in.
    pub steps: u64,
    /// Seconds of training since the start, earlier runs counted in.
    pub seconds: f64,
    /// Where the network ran and why.
    pub device: String,
    /// What pictures were compared by.
    pub features: String,
    /// Number of the network's parameters.
    pub parameters: usize,
    /// Mean over the last steps of the reconstruction loss: in encoded units by the built-in features,
    /// in units of the layers' levels by a file's.
    pub loss_rec: f32,
    /// The same of the rendering loss.
    pub loss_render: f32,
    /// Steps that were skipped because they were not finite.
    pub skipped_steps: u64,
    /// How well the network does on the pose that was held out.
    pub held_out: Option<HeldOut>,
    /// Lamps whose outputs were stuck at black or white in the last two looks at them.
    pub dead_lamps: Vec<String>,
}

/// The figures of one step.
#[derive(Clone, Copy, Debug)]
pub struct StepReport {
    /// Reconstruction loss; none for a lesson from the interview.
    pub reconstruction: Option<f32>,
    /// Rendering loss; none in a step that does without.
    pub rendering: Option<f32>,
    pub gradient_norm: f32,
    pub learning_rate: f64,
    /// Whether the weights were changed: not by a step that is not finite.
    pub taken: bool,
}

/// A network in training.
pub struct Trainer {
    config: TrainingConfig,
    pub(super) schedule: Schedule,
    pub(super) data: TrainingData,
    criterion: Criterion,
    pub(super) info: CheckpointInfo,
    /// On the autodiff device.
    live: UNet,
    /// On the plain device.
    pub(super) average: UNet,
    /// The network that predicts, where a pose is held out: the average as it was when it did best.
    best: Option<UNet>,
    hold_out: Option<usize>,
    optimizer: ModuleOptimizer,
}

impl Trainer {
    /// A trainer at the start, or where the project's checkpoint stands unless `fresh`.
    ///
    /// # Errors
    /// When pictures or the features' file cannot be read, or a checkpoint is there that does not fit.
    pub fn new(
        project: &Project,
        calibration: &Calibration,
        settings: &TrainSettings,
        device: &Device,
        progress: &Progress,
    ) -> Result<Self> {
        let config = settings.config.clone();
        let network = config.network(project);
        network.check()?;
        let folder = project.checkpoint_path();
        let resume = !settings.fresh && folder.join("checkpoint.toml").exists();
        if resume {
            let info = checkpoint::info(&folder)?;
            check_fits(&info, project)?;
            if info.network != network {
                return Err(Error::unexpected(
                    folder.display(),
                    format!("the network that was asked for ({network:?})"),
                    format!("{:?}", info.network),
                    "Go on with the settings it was begun with, or start over with --fresh",
                ));
            }
        }
        let mut autodiff = device.clone().autodiff();
        if config.recompute {
            autodiff = autodiff.gradient_checkpointing();
        }
        let open = |path: &PathBuf| Features::open(path, &autodiff);
        let criterion = Criterion {
            features: config.features.as_ref().map(open).transpose()?,
            perceptual: config.perceptual,
            pixel: config.pixel,
        };
        let data = TrainingData::load(
            project,
            calibration,
            &config,
            &settings.exclude_frames,
            settings.hold_out,
            &autodiff,
            progress,
        )?;
        let seed = project.settings.seed;
        let schedule = Schedule::new(&config, data.exemplars.len(), data.frames.len(), seed);
        let optimizer = ModuleOptimizer::from(Adam::default());
        if resume {
            let Resumed {
                mut info,
                best,
                average,
                live,
                optimizer: moments,
            } = checkpoint::load_training(&folder, device)?;
            info.training_frames.extend(&data.frame_numbers);
            info.training_frames.sort_unstable();
            info.training_frames.dedup();
            // Another pose, or none, judges anew.
            let judged = info.held_out.map(|h| h.pose);
            if judged != settings.hold_out {
                info.held_out = None;
            }
            let optimizer = match moments {
                None => optimizer,
                Some(moments) => optimizer.from_bytes(moments).map_err(|e| {
                    Error::unexpected(
                        folder.display(),
                        "an optimiser's state",
                        e.to_string(),
                        "Start over with --fresh",
                    )
                })?,
            };
            return Ok(Self {
                config,
                schedule,
                data,
                criterion,
                live,
                average,
                best: info.held_out.is_some().then_some(best),
                hold_out: settings.hold_out,
                optimizer,
                info,
            });
        }
        autodiff.seed(seed);
        let live = network.init(data.mean_output, &autodiff).materialize();
        let info = CheckpointInfo {
            step: 0,
            seconds: 0.0,
            scale: data.scale,
            training_frames: data.frame_numbers.clone(),
            network,
            held_out: None,
        };
        Ok(Self {
            average: live.valid(),
            best: None,
            hold_out: settings.hold_out,
            config,
            schedule,
            data,
            criterion,
            info,
            live,
            optimizer,
        })
    }

    /// Makes one step; `done` is the finished share of the run, for the learning rate.
    pub fn step(&mut self, done: f64) -> StepReport {
        let step = self.info.step;
        let statistics = self.live.running_statistics();
        let most = (self.config.shift * self.info.network.size as f32).round() as i64;
        let (dx, dy) = self.schedule.shift(step, most);
        let lesson = self.schedule.lesson(step);
        let (look, olats, shift) = match lesson {
            schedule::Lesson::Exemplar { pose } => {
                let distances = &self.data.exemplars[pose];
                let exemplar = &distances[self.schedule.variant(step, distances.len())];
                let moved = |x: &Tensor<4>| augment::shift(x.clone(), dx, dy);
                let look = Look {
                    linear: moved(&exemplar.look.linear),
                    encoded: moved(&exemplar.look.encoded),
                    mask: moved(&exemplar.look.mask),
                };
                (look, Some(&exemplar.encoded_olats), [dx, dy])
            }
            schedule::Lesson::Video { frame } => (self.data.frames[frame].clone(), None, [0, 0]),
        };
        let network = &self.info.network;
        let lamps = self
            .schedule
            .lamps(step, self.config.lamps_per_step, network.lamps);
        let renders = olats.is_none() || step.is_multiple_of(self.config.rendering_every);
        // Without the rendering loss the network computes no other lamps than those compared.
        let alone = lamps.as_deref().filter(|_| !renders);
        let (mut olats, mut weights) = (olats.cloned(), self.data.weights.clone());
        if let Some(lamps) = alone {
            olats = olats.map(|olats| rows(olats, lamps));
            weights = rows(weights, lamps);
        }
        let input = if self.config.gain > 0.0 {
            let gain = self.schedule.gain(step, self.config.gain);
            let gain = Tensor::<1>::from_floats(gain, &look.linear.device()).reshape([1, 3, 1, 1]);
            encode(look.linear.clone() * gain)
        } else {
            look.encoded.clone()
        };
        let output = self.live.forward_lamps(input * look.mask.clone(), alone);
        // Pictures that are moved anew each time are not worth remembering, nor are those of a step whose
        // lamps have other numbers.
        let still = most == 0 && self.config.zoom == 0.0;
        let unmoved = olats.is_none() || (still && alone.is_none());
        let (total, parts) = self.criterion.losses(
            output,
            &Comparison {
                light: light(&look.linear, network.formulation, self.info.scale),
                mask: &look.mask,
                olats: olats.as_ref(),
                look: &look.encoded,
                weights: &weights,
                settings: LossSettings {
                    gain: self.data.olat_gain,
                    shift,
                    reconstruction: self.config.reconstruction,
                    rendering: if renders { self.config.rendering } else { 0.0 },
                },
            },
            lamps.as_deref().filter(|_| alone.is_none()),
            unmoved.then_some(lesson),
        );
        let parts = parts.into_data().try_into_vec::<f32>().unwrap_or_default();
        let value = |i: usize| parts.get(i).copied().unwrap_or(f32::NAN);
        let reconstruction = olats.map(|_| value(0));
        let rendering = renders.then(|| value(1));
        let mut gradients = GradientsParams::from_grads(total.backward(), &self.live);
        let gradient_norm = gradient::clip(&self.live, &mut gradients, self.config.gradient_norm);
        let learning_rate = schedule::learning_rate(&self.config, step, done);
        let taken = gradient_norm.is_finite()
            && rendering.is_none_or(f32::is_finite)
            && reconstruction.is_none_or(f32::is_finite);
        if taken {
            self.live = self
                .optimizer
                .step(learning_rate, self.live.clone(), gradients);
            // Early on the average follows fast, so that it does not remember the start.
            let keep = self
                .config
                .averaging
                .min((step + 1) as f32 / (step + 10) as f32);
            self.average = if self.config.averaging > 0.0 {
                average::blend(self.average.clone(), &self.live, keep)
            } else {
                self.live.valid()
            };
        } else {
            // What the pass has left there is as little to be trusted.
            self.live.set_running_statistics(statistics);
        }
        self.info.step += 1;
        StepReport {
            reconstruction,
            rendering,
            gradient_norm,
            learning_rate,
            taken,
        }
    }

    /// What pictures are compared by, in words.
    pub(super) fn features(&self) -> String {
        match (&self.criterion.features, &self.config.features) {
            (Some(features), Some(path)) => {
                format!("{} from {}", features.architecture().name(), path.display())
            }
            _ => "the built-in features".to_owned(),
        }
    }

    /// Judges the averaged network by the pose that was held out, and keeps it if it is the best so far.
    /// None where no pose is, or the device fails.
    pub fn judge(&mut self) -> Option<f32> {
        let (pose, lesson) = (self.hold_out?, self.data.held_out.as_ref()?);
        let attempt = Attempt::new(&self.average, &self.info, lesson, self.data.olat_gain);
        let decibels = attempt.decibels()?;
        if self
            .info
            .held_out
            .is_none_or(|best| best.decibels < decibels)
        {
            // A clone would share its running statistics with the average, which goes on.
            self.best = Some(self.average.valid());
            self.info.held_out = Some(HeldOut {
                pose,
                step: self.info.step,
                decibels,
            });
        }
        Some(decibels)
    }

    /// Lamps whose outputs are stuck at black or white on one of the exemplars, another one each time.
    /// None where the device fails.
    pub fn dead_lamps(&self) -> Option<Vec<usize>> {
        let turn = (self.info.step / LOOK_STEPS) as usize;
        let lesson = &self.data.exemplars[turn % self.data.exemplars.len()][0];
        let live = self.live.valid();
        Attempt::new(&live, &self.info, lesson, self.data.olat_gain).dead_lamps()
    }

    /// The pose that pictures show, with its number: the one held out, or the first.
    pub(super) fn shown_lesson(&self) -> (usize, &data::Lesson) {
        match (self.hold_out, &self.data.held_out) {
            (Some(pose), Some(lesson)) => (pose, lesson),
            _ => (0, &self.data.exemplars[0][0]),
        }
    }

    /// The network that predicts.
    pub fn network(&self) -> &UNet {
        self.best.as_ref().unwrap_or(&self.average)
    }

    /// Where the run stands.
    pub fn info(&self) -> &CheckpointInfo {
        &self.info
    }

    /// Refuses a network with weights that are NaN or infinite, as far too high a rate makes them: it must not
    /// replace the last checkpoint.
    ///
    /// # Errors
    /// When a weight is not finite, or so large that its square is not.
    pub fn check_weights(&self) -> Result<()> {
        let norms = [&self.live.valid(), &self.average].map(gradient::weight_norm);
        if norms.into_iter().all(f32::is_finite) {
            return Ok(());
        }
        Err(Error::unexpected(
            "training",
            "finite weights",
            format!(
                "weights that are NaN or infinite after step {}",
                self.info.step
            ),
            "The last checkpoint is kept. Go on from it with a lower rate, such as --set learning-rate=3e-4",
        ))
    }

    /// Writes the checkpoint.
    pub fn save(&self, project: &Project) -> Result<()> {
        let optimizer = self.optimizer.into_bytes().map_err(|e| {
            Error::unexpected(
                "the optimiser",
                "a state that can be packed",
                e.to_string(),
                "Report this fault",
            )
        })?;
        let average = self.best.is_some().then_some(&self.average);
        let state = TrainingState {
            average_weights: average.map(checkpoint::weight_bytes).transpose()?,
            live_weights: checkpoint::weight_bytes(&self.live)?,
            optimizer,
        };
        checkpoint::save(
            &project.checkpoint_path(),
            &self.info,
            self.network(),
            &state,
        )
    }
}
