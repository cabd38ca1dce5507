//! Step durations of several networks, compared on a machine with other load.

use super::config::TrainingConfig;
use super::schedule::Schedule;
use super::trainer::Trainer;
use std::time::{Duration, Instant};

/// Timed steps of a round: of `quick`'s 24 on poses and 8 on frames in the same proportion.
const PLACES: usize = 4;
/// Least number of timings of each: the first one fills caches.
const LEAST_RUNS: usize = 3;

/// Milliseconds of an undisturbed step of each trainer: they take turns for about `time`, and the shortest time of each
/// step counts.
///
/// The trainers learn nothing useful; see [`Trainer::on_noise`].
pub fn steps_ms(mut trainers: [&mut Trainer; 2], time: Duration) -> [f64; 2] {
    let mut least = [[f64::INFINITY; PLACES]; 2];
    let began = Instant::now();
    let mut runs = 0;
    while runs < LEAST_RUNS || began.elapsed() < time {
        for place in 0..PLACES {
            let share = place as f64 / PLACES as f64;
            for (trainer, least) in trainers.iter_mut().zip(&mut least) {
                least[place] = least[place].min(trainer.timed_ms(share));
            }
        }
        runs += 1;
    }
    least.map(|least| least.iter().sum::<f64>() / PLACES as f64)
}

impl TrainingConfig {
    /// This configuration for a run of this many steps, without a time limit, on this many poses and frames. Epochs are
    /// whole, so it may be some steps more.
    #[must_use]
    pub fn for_steps(self, steps: u64, poses: usize, frames: usize) -> Self {
        Self { epochs: Schedule::new(&self, poses, frames, 0).epochs_of(steps), minutes: None, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;
    use gpu::{ComputeDevice, DeviceChoice};

    #[test]
    fn a_larger_picture_takes_longer_and_the_same_as_long() {
        let device = ComputeDevice::choose(DeviceChoice::Cpu).device;
        let trainer = |size| {
            let config = Preset::Quick.config();
            let network = config.network_of(size, 4);
            Trainer::on_noise(config, network, &device).unwrap()
        };
        let (mut small, mut same, mut large) = (trainer(16), trainer(16), trainer(64));
        let time = Duration::from_millis(200);
        // Other work on the machine may slow one of them down, but not five times.
        let mut measured = Vec::new();
        let holds = (0..5).any(|_| {
            let [a, b] = steps_ms([&mut small, &mut same], time);
            // Sixteen times as many pixels.
            let [c, d] = steps_ms([&mut small, &mut large], time);
            measured.push([a, b, c, d]);
            a > 0.0 && (0.5..2.0).contains(&(a / b)) && d > 2.0 * c
        });
        assert!(holds, "{measured:?}");
    }
}
