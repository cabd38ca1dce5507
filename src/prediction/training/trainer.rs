//! Trainer: a network, its optimiser and its training data, with one sample per step.

use super::adam::Adam;
use super::config::{TrainSettings, TrainingConfig};
use super::data::{Plate, TrainingData, TrainingSample};
use super::features::{Features, rows};
use super::loss::Criterion;
use super::pose_prediction::PosePrediction;
use super::report::StepReport;
use super::schedule::{self, SampleSource, Schedule};
use super::{augment, average, gradient};
use base::error::{Error, Result};
use base::progress::Progress;
use burn::module::Module;
use burn::optim::{GradientsParams, ModuleOptimizer};
use burn::tensor::{Device, Tensor};
use calibration::Calibration;
use project::Project;
use reflectance::checkpoint::{self, CheckpointInfo, HeldOut, Resumed, TrainingState};
use reflectance::kernels::{LossInputs, LossSettings, on_pool, serve};
use reflectance::predictor::check_fits;
use reflectance::render::{encode, light, network_input};
use reflectance::{UNet, UNetConfig};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Shift of a frame in pixels for the test of stable outputs.
const STEADY_SHIFT: i64 = 2;

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
    /// Network for prediction if a pose is held out: the average at its best score.
    best: Option<UNet>,
    hold_out: Option<usize>,
    optimizer: ModuleOptimizer,
}

impl Trainer {
    /// Trainer at the project's checkpoint, or at the start without one or if `fresh`.
    ///
    /// # Errors
    /// When pictures or the features' file cannot be read, or the checkpoint does not fit.
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
            check_resumable(&folder, project, &network)?;
        }
        let (autodiff, criterion) = prepared(&config, device)?;
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
        let start = if resume {
            Start::resumed(&folder, &data, settings.hold_out, device)?
        } else {
            autodiff.seed(seed);
            Start::fresh(network, &data, &autodiff)
        };
        Ok(Self {
            config,
            schedule,
            data,
            criterion,
            info: start.info,
            live: start.live,
            average: start.average,
            best: start.best,
            hold_out: settings.hold_out,
            optimizer: start.optimizer,
        })
    }

    /// Trainer of this network on noise, to time its steps: six poses and eight frames that share their pictures. It
    /// learns nothing useful.
    ///
    /// # Errors
    /// When the network is invalid, or the features' file cannot be read.
    pub fn on_noise(config: TrainingConfig, network: UNetConfig, device: &Device) -> Result<Self> {
        network.check()?;
        let (autodiff, criterion) = prepared(&config, device)?;
        autodiff.seed(0);
        let data = TrainingData::noise(&network, &autodiff);
        let schedule = Schedule::new(&config, data.exemplars.len(), data.frames.len(), 0);
        let start = Start::fresh(network, &data, &autodiff);
        Ok(Self {
            config,
            schedule,
            data,
            criterion,
            info: start.info,
            live: start.live,
            average: start.average,
            best: None,
            hold_out: None,
            optimizer: start.optimizer,
        })
    }

    /// Milliseconds of the step at this share of a round, from 0 to 1.
    pub(crate) fn timed_ms(&mut self, share: f64) -> f64 {
        self.info.step = (share * self.schedule.round_steps() as f64) as u64;
        let began = Instant::now();
        self.step(0.5);
        began.elapsed().as_secs_f64() * 1e3
    }

    /// Makes one step; `done` is the finished share of the run, for the learning rate.
    pub fn step(&mut self, done: f64) -> StepReport {
        on_pool(&self.data.weights.device(), || self.step_on_pool(done))
    }

    fn step_on_pool(&mut self, done: f64) -> StepReport {
        let step = self.info.step;
        let statistics = self.live.running_statistics();
        let most = (self.config.shift * self.info.network.size as f32).round() as i64;
        let (dx, dy) = self.schedule.shift(step, most);
        let source = self.schedule.source(step);
        let (plate, olats, shift) = match source {
            SampleSource::Exemplar { pose } => {
                let distances = &self.data.exemplars[pose];
                let exemplar = &distances[self.schedule.variant(step, distances.len())];
                let moved = |x: &Tensor<4>| augment::shift(x.clone(), dx, dy);
                let plate = Plate {
                    linear: moved(&exemplar.plate.linear),
                    encoded: moved(&exemplar.plate.encoded),
                    mask: moved(&exemplar.plate.mask),
                };
                (plate, Some(&exemplar.encoded_olats), [dx, dy])
            }
            SampleSource::Frame { frame } => (self.data.frames[frame].clone(), None, [0, 0]),
        };
        let network = &self.info.network;
        let lamps = self.schedule.lamps(step, self.config.lamps_per_step, network.lamps);
        let renders = olats.is_none() || step.is_multiple_of(self.config.rendering_every);
        let first = self.config.rendering;
        let last = self.config.rendering_end.unwrap_or(first);
        let weight = first + (last - first) * done.clamp(0.0, 1.0) as f32;
        // Without the rendering loss the network computes only the compared lamps.
        let alone = lamps.as_deref().filter(|_| !renders);
        let (mut olats, mut weights) = (olats.cloned(), self.data.weights.clone());
        if let Some(lamps) = alone {
            olats = olats.map(|olats| rows(olats, lamps));
            weights = rows(weights, lamps);
        }
        let input = if self.config.gain > 0.0 {
            let gain = self.schedule.gain(step, self.config.gain);
            let gain = Tensor::<1>::from_floats(gain, &plate.linear.device()).reshape([1, 3, 1, 1]);
            encode(plate.linear.clone() * gain)
        } else {
            plate.encoded.clone()
        };
        let input = network_input(input, plate.mask.clone());
        let steadies = self.config.steadiness > 0.0 && olats.is_none();
        let logits = !steadies && serve(&input) && self.criterion.takes_logits();
        let output =
            if logits { self.live.logits(input.clone(), alone) } else { self.live.forward_lamps(input.clone(), alone) };
        let unsteady = steadies.then(|| {
            let (dx, dy) = self.schedule.shift(step, STEADY_SHIFT);
            let moved = |x: Tensor<4>| augment::shift(x, dx, dy);
            let mask = moved(plate.mask.clone());
            let again = self.live.forward(moved(input));
            let change = (encode(again) - encode(moved(output.clone()))).abs() * mask.clone();
            change.mean() / mask.mean().clamp_min(1e-3)
        });
        // Pictures with random shifts are not worth caching, nor are those of a step that computes only
        // some lamps.
        let still = most == 0 && self.config.zoom == 0.0;
        let unmoved = olats.is_none() || (still && alone.is_none());
        let (total, parts) = self.criterion.losses(
            output,
            &LossInputs {
                light: light(&plate.linear, network.formulation, self.info.scale),
                mask: &plate.mask,
                olats: olats.as_ref(),
                plate: &plate.encoded,
                weights: &weights,
                settings: LossSettings {
                    gain: self.data.olat_gain,
                    shift,
                    reconstruction: self.config.reconstruction,
                    rendering: if renders { weight } else { 0.0 },
                    logits,
                },
            },
            lamps.as_deref().filter(|_| alone.is_none()),
            unmoved.then_some(source),
        );
        let total = match unsteady {
            Some(unsteady) => total + unsteady * self.config.steadiness,
            None => total,
        };
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
            self.live = self.optimizer.step(learning_rate, self.live.clone(), gradients);
            // Early on the average follows fast, so that it forgets the start.
            let keep = self.config.averaging.min((step + 1) as f32 / (step + 10) as f32);
            self.average = if self.config.averaging > 0.0 {
                average::blend(self.average.clone(), &self.live, keep)
            } else {
                self.live.valid()
            };
        } else {
            // The running statistics of this pass cannot be trusted either.
            self.live.set_running_statistics(statistics);
        }
        self.info.step += 1;
        StepReport { reconstruction, rendering, gradient_norm, learning_rate, taken }
    }

    /// Features by which pictures are compared, as text.
    pub(super) fn features(&self) -> String {
        match (&self.criterion.features, &self.config.features) {
            (Some(features), Some(path)) => {
                format!("{} from {}", features.architecture().name(), path.display())
            }
            _ => "the built-in features".to_owned(),
        }
    }

    /// Scores the averaged network on the held-out pose, and keeps it if it is the best so far. None if no pose is
    /// held out, or the device fails.
    pub fn validate(&mut self) -> Option<f32> {
        let (pose, sample) = (self.hold_out?, self.data.held_out.as_ref()?);
        let prediction = PosePrediction::new(&self.average, &self.info, sample, self.data.olat_gain);
        let decibels = prediction.decibels()?;
        if self.info.held_out.is_none_or(|best| best.decibels < decibels) {
            // A clone would share its running statistics with the average, which continues.
            self.best = Some(self.average.valid());
            self.info.held_out = Some(HeldOut { pose, step: self.info.step, decibels });
        }
        Some(decibels)
    }

    /// Lamps whose outputs are stuck at black or white on an exemplar; the exemplar number counts from 0 and
    /// wraps. None if the device fails.
    pub fn dead_lamps(&self, exemplar: usize) -> Option<Vec<usize>> {
        let sample = &self.data.exemplars[exemplar % self.data.exemplars.len()][0];
        let live = self.live.valid();
        PosePrediction::new(&live, &self.info, sample, self.data.olat_gain).dead_lamps()
    }

    /// Pose in displayed pictures, with its number: the held-out one, or the first.
    pub(super) fn shown_sample(&self) -> (usize, &TrainingSample) {
        match (self.hold_out, &self.data.held_out) {
            (Some(pose), Some(sample)) => (pose, sample),
            _ => (0, &self.data.exemplars[0][0]),
        }
    }

    /// Network for prediction.
    pub fn network(&self) -> &UNet {
        self.best.as_ref().unwrap_or(&self.average)
    }

    /// State of the run.
    pub fn info(&self) -> &CheckpointInfo {
        &self.info
    }

    /// Refuses a network with NaN or infinite weights, as from a much too high rate: it must not
    /// replace the last checkpoint.
    ///
    /// # Errors
    /// When a weight is not finite, or its square overflows.
    pub fn check_weights(&self) -> Result<()> {
        let norms = [&self.live.valid(), &self.average].map(gradient::weight_norm);
        if norms.into_iter().all(f32::is_finite) {
            return Ok(());
        }
        Err(Error::invalid(
            format!("training stopped: weights are NaN or infinite after step {}", self.info.step),
            (
                "The last checkpoint is kept. Continue from it at a lower learning rate, such as 3e-4",
                "--set learning-rate=3e-4",
            ),
        ))
    }

    /// Writes the checkpoint.
    pub fn save(&self, project: &Project) -> Result<()> {
        let optimizer =
            self.optimizer.into_bytes().map_err(|e| Error::bug(format!("cannot pack the optimiser's state: {e}")))?;
        let average = self.best.is_some().then_some(&self.average);
        let state = TrainingState {
            average_weights: average.map(checkpoint::weight_bytes).transpose()?,
            live_weights: checkpoint::weight_bytes(&self.live)?,
            optimizer,
        };
        checkpoint::save(&project.checkpoint_path(), &self.info, self.network(), &state)
    }
}

/// Device with gradients, and the losses on it.
///
/// # Errors
/// When the features' file cannot be read.
fn prepared(config: &TrainingConfig, device: &Device) -> Result<(Device, Criterion)> {
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
    Ok((autodiff, criterion))
}

/// Start of a run.
struct Start {
    info: CheckpointInfo,
    live: UNet,
    average: UNet,
    best: Option<UNet>,
    optimizer: ModuleOptimizer,
}

impl Start {
    fn fresh(network: UNetConfig, data: &TrainingData, autodiff: &Device) -> Self {
        let live = network.init(data.mean_output, autodiff).materialize();
        Self {
            info: CheckpointInfo {
                step: 0,
                seconds: 0.0,
                scale: data.scale,
                training_frames: data.frame_numbers.clone(),
                network,
                held_out: None,
            },
            average: live.valid(),
            best: None,
            live,
            optimizer: ModuleOptimizer::from(Adam::default()),
        }
    }

    fn resumed(folder: &Path, data: &TrainingData, hold_out: Option<usize>, device: &Device) -> Result<Self> {
        let Resumed { mut info, best, average, live, optimizer: moments } = checkpoint::load_training(folder, device)?;
        info.training_frames.extend(&data.frame_numbers);
        info.training_frames.sort_unstable();
        info.training_frames.dedup();
        // Scores on different poses are not comparable.
        if info.held_out.map(|h| h.pose) != hold_out {
            info.held_out = None;
        }
        let optimizer = ModuleOptimizer::from(Adam::default());
        let optimizer = match moments {
            None => optimizer,
            Some(moments) => optimizer
                .from_bytes(moments)
                .map_err(|e| Error::codec("read the optimiser's state in", folder, e, ("Start over", "--fresh")))?,
        };
        Ok(Self { best: info.held_out.is_some().then_some(best), info, live, average, optimizer })
    }
}

/// Refuses a checkpoint from which training of `network` cannot continue.
fn check_resumable(folder: &Path, project: &Project, network: &UNetConfig) -> Result<()> {
    let info = checkpoint::info(folder)?;
    check_fits(&info, project)?;
    if info.network == *network {
        return Ok(());
    }
    Err(Error::invalid(
        format!("{} holds a different network: {}", folder.display(), info.network.differences(network)),
        ("Continue with its original settings, or start over", "--fresh"),
    ))
}
