//! Time of training steps. Training is limited by steps: a time limit would cost steps of whichever network is training
//! while the machine has other work.

use super::ladder::Rung;
use base::error::Result;
use gpu::ComputeDevice;
use std::collections::BTreeMap;
use std::time::Duration;
use training::{Trainer, steps_ms};

/// Share of a rung's minutes for timing its steps, and its upper limit.
const SHARE: f64 = 0.03;
const MOST: Duration = Duration::from_secs(3);

/// Step times.
#[derive(Default)]
pub struct Pace {
    /// Names of networks, and their step times as multiples of the base's.
    times: BTreeMap<String, f64>,
}

impl Pace {
    /// Milliseconds of a training step of the base.
    ///
    /// # Errors
    /// When the network's features cannot be read, or the device fails.
    pub fn base_ms(&mut self, base: &Rung, compute: &ComputeDevice) -> Result<f64> {
        let [once, again] = timed(base, base, compute)?;
        Ok(once.min(again))
    }

    /// Step time of a rung as a multiple of the base's.
    ///
    /// # Errors
    /// As [`Self::base_ms`].
    pub fn times(&mut self, rung: &Rung, base: &Rung, compute: &ComputeDevice) -> Result<f64> {
        if rung.steps_as(base) {
            return Ok(1.0);
        }
        if let Some(times) = self.times.get(&rung.network.name) {
            return Ok(*times);
        }
        let [base_ms, ms] = timed(base, rung, compute)?;
        self.times.insert(rung.network.name.clone(), ms / base_ms);
        Ok(ms / base_ms)
    }
}

/// Milliseconds of a training step of each of two rungs, timed in turn.
fn timed(one: &Rung, other: &Rung, compute: &ComputeDevice) -> Result<[f64; 2]> {
    let trainer = |rung: &Rung| {
        let network = &rung.network;
        let shape = network.config.network_of(network.size, network.lamps);
        Trainer::on_noise(network.config.clone(), shape, &compute.device)
    };
    let time = Duration::from_secs_f64(SHARE * 60.0 * other.minutes).min(MOST);
    Ok(steps_ms([&mut trainer(one)?, &mut trainer(other)?], time))
}
