//! Common learning of all methods, equal to the network's own training: Adam with a rate that warms up and falls,
//! clipped gradients, and a moving average of the weights for prediction.

use super::quiet::Quiet;
use base::error::{Error, Result};
use base::progress::Progress;
use base::turn;
use burn::module::Module;
use burn::optim::{GradientsParams, ModuleOptimizer};
use burn::tensor::Tensor;
use chacha20::ChaCha8Rng;
use rand::SeedableRng;
use std::time::Instant;
use training::schedule::learning_rate;
use training::{Adam, Preset, TrainingConfig, blend, clip};

/// Number of skipped steps in a row that ends a run.
const MOST_BAD_STEPS: u32 = 3;

/// Limits of a method's learning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Minutes of undisturbed learning, without reading pictures, as for the network.
    pub minutes: f64,
    /// Largest number of steps.
    pub steps: Option<u64>,
    /// Seed of all random draws.
    pub seed: u64,
}

/// Cost of learning.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    pub steps: u64,
    /// Seconds of the steps without other load.
    pub seconds: f64,
}

/// Random generator for one purpose at one step.
pub fn draw(seed: u64, step: u64, purpose: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ purpose.rotate_left(32));
    rng.set_stream(step);
    rng
}

/// Trains `network`, which is on an autodiff device, within the effort; `loss` is the loss of one step. Returns
/// the average, on the plain device.
///
/// # Errors
/// When the user stops, or the loss is not finite three times in a row.
pub fn learn<M: Module>(
    network: M,
    effort: &Effort,
    rate: f64,
    (stage, progress): (&'static str, &Progress),
    mut loss: impl FnMut(&M, u64) -> Tensor<1>,
) -> Result<(M, Spent)> {
    let config = TrainingConfig { learning_rate: rate, ..Preset::Quick.config() };
    let mut live = network;
    let mut average = live.valid();
    let mut optimizer = ModuleOptimizer::from(Adam::default());
    let (mut quiet, mut bad) = (Quiet::default(), 0);
    loop {
        let spent = Spent { steps: quiet.steps(), seconds: quiet.seconds() };
        let by_time = spent.seconds / (60.0 * effort.minutes);
        let by_step = |steps| spent.steps as f64 / f64::max(steps as f64, 1.0);
        let done = by_time.max(effort.steps.map_or(0.0, by_step));
        if done >= 1.0 {
            return Ok((average, spent));
        }
        progress.check("nothing was written")?;
        let turn = turn::DEVICE.lock();
        let began = Instant::now();
        let total = loss(&live, spent.steps);
        let mut gradients = GradientsParams::from_grads(total.backward(), &live);
        let norm = clip(&live, &mut gradients, config.gradient_norm);
        if norm.is_finite() {
            bad = 0;
            let rate = learning_rate(&config, spent.steps, done);
            live = optimizer.step(rate, live.clone(), gradients);
            let step = spent.steps as f32;
            let keep = config.averaging.min((step + 1.0) / (step + 10.0));
            average = blend(average, &live, keep);
        } else {
            bad += 1;
        }
        quiet.add(began.elapsed().as_secs_f64());
        drop(turn);
        if bad >= MOST_BAD_STEPS {
            return Err(Error::invalid(
                format!("{stage} failed: {bad} steps in a row had gradients that are not finite"),
                "Check the pictures for blown-out or empty exemplars",
            ));
        }
        let note = format!("step {}", quiet.steps());
        progress.step(stage, (done * 1000.0) as u64, 1000, note);
    }
}
