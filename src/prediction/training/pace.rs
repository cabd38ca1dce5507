//! Time of a step of one network beside a step of another, on a machine that may do other work.

use super::config::TrainingConfig;
use super::schedule::Schedule;
use super::trainer::Trainer;
use std::time::{Duration, Instant};

/// Steps of a round that are timed: of `quick`'s 24 on poses and 8 on frames as many of each as it makes.
const PLACES: usize = 4;
/// Each is timed at least so often: the first time pays for what is kept.
const LEAST_RUNS: usize = 3;

/// Milliseconds of a step of each trainer when nothing else slowed it down: they take turns for about `time`, and of each
/// step the shortest time counts.
///
/// The trainers learn nothing worth keeping; see [`Trainer::on_noise`].
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
    /// This for a run of so many steps, whatever time they take, on so many poses and frames of the interview. Epochs are
    /// whole, so it may be some steps more.
    #[must_use]
    pub fn for_steps(self, steps: u64, poses: usize, frames: usize) -> Self {
        Self {
            epochs: Schedule::new(&self, poses, frames, 0).epochs_of(steps),
            minutes: None,
            ..self
        }
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
        let [a, b] = steps_ms([&mut small, &mut same], time);
        assert!(a > 0.0 && (0.5..2.0).contains(&(a / b)), "{a} {b}");
        // Sixteen times as many pixels.
        let [a, b] = steps_ms([&mut small, &mut large], time);
        assert!(b > 2.0 * a, "{a} {b}");
    }
}
