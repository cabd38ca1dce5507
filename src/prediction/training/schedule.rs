//! Schedule of samples: a pure function of the step, so that a resumed run continues exactly.

use super::config::TrainingConfig;
use chacha20::ChaCha8Rng;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};

/// Source of one step's learning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SampleSource {
    /// Exemplar number `pose`, with both losses.
    Exemplar { pose: usize },
    /// Interview frame number `frame` among those allowed, only with the rendering loss.
    Frame { frame: usize },
}

/// Order of the samples of a run.
#[derive(Clone, Debug)]
pub struct Schedule {
    poses: usize,
    frames: usize,
    exemplar_epochs: u32,
    video_epochs: u32,
    frames_per_epoch: usize,
    epochs: u32,
    seed: u64,
}

impl Schedule {
    /// The schedule of `config` over `poses` exemplars and `frames` interview frames. Without frames
    /// only exemplars are used.
    pub fn new(config: &TrainingConfig, poses: usize, frames: usize, seed: u64) -> Self {
        Self {
            poses,
            frames,
            exemplar_epochs: config.exemplar_epochs.max(1),
            video_epochs: if frames == 0 { 0 } else { config.video_epochs },
            frames_per_epoch: config.frames_per_epoch.unwrap_or(frames).min(frames),
            epochs: config.epochs,
            seed,
        }
    }

    /// Steps in one round: the exemplars' epochs, then the interview's.
    pub fn round_steps(&self) -> u64 {
        u64::from(self.exemplar_epochs) * self.poses as u64
            + u64::from(self.video_epochs) * self.frames_per_epoch as u64
    }

    /// Steps of the whole run.
    pub fn steps(&self) -> u64 {
        let round = u64::from(self.exemplar_epochs + self.video_epochs);
        let (rounds, rest) = (u64::from(self.epochs) / round, u64::from(self.epochs) % round);
        let exemplar = rest.min(u64::from(self.exemplar_epochs));
        rounds * self.round_steps() + exemplar * self.poses as u64 + (rest - exemplar) * self.frames_per_epoch as u64
    }

    /// Fewest epochs with this many steps; at least 1.
    pub fn epochs_of(&self, steps: u64) -> u32 {
        let has = |epochs| Self { epochs, ..self.clone() }.steps() >= steps;
        let (mut low, mut high) = (1, u32::MAX);
        while low < high {
            let middle = low + (high - low) / 2;
            if has(middle) {
                high = middle;
            } else {
                low = middle + 1;
            }
        }
        low
    }

    /// Source of step number `step`, from 0. Each epoch has its own order, drawn from the seed.
    pub fn source(&self, step: u64) -> SampleSource {
        let (round, within) = (step / self.round_steps(), step % self.round_steps());
        let exemplar_steps = u64::from(self.exemplar_epochs) * self.poses as u64;
        let epochs = u64::from(self.exemplar_epochs + self.video_epochs);
        if within < exemplar_steps {
            let (epoch, place) = (within / self.poses as u64, within % self.poses as u64);
            SampleSource::Exemplar { pose: self.shuffled(round * epochs + epoch, self.poses)[place as usize] }
        } else {
            let per_epoch = self.frames_per_epoch as u64;
            let (epoch, place) = ((within - exemplar_steps) / per_epoch, (within - exemplar_steps) % per_epoch);
            let epoch = round * epochs + u64::from(self.exemplar_epochs) + epoch;
            SampleSource::Frame { frame: self.shuffled(epoch, self.frames)[place as usize] }
        }
    }

    fn shuffled(&self, epoch: u64, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        order.shuffle(&mut draw(self.seed, epoch, 0));
        order
    }

    /// Shift in pixels of step `step`'s exemplar, at most `most` on each axis.
    pub fn shift(&self, step: u64, most: i64) -> (i64, i64) {
        let mut rng = draw(self.seed, step, 1);
        (rng.random_range(-most..=most), rng.random_range(-most..=most))
    }

    /// Number of the exemplar variant, of `count`, in step `step`.
    pub fn variant(&self, step: u64, count: usize) -> usize {
        draw(self.seed, step, 3).random_range(0..count)
    }

    /// Factors on the input's channels: up to `stops` up or down.
    pub fn gain(&self, step: u64, stops: f32) -> [f32; 3] {
        let mut rng = draw(self.seed, step, 4);
        let common: f32 = rng.random_range(-1.0..=1.0);
        std::array::from_fn(|_| {
            let own: f32 = rng.random_range(-1.0..=1.0);
            (stops * (0.75 * common + 0.25 * own)).exp2()
        })
    }

    /// Lamps, in ascending order, whose OLATs step `step` compares: `count` of `lamps`, each set
    /// equally likely. None means all.
    pub fn lamps(&self, step: u64, count: Option<usize>, lamps: usize) -> Option<Vec<usize>> {
        let count = count.filter(|count| *count < lamps)?;
        let mut order: Vec<usize> = (0..lamps).collect();
        order.shuffle(&mut draw(self.seed, step, 2));
        order.truncate(count.max(1));
        order.sort_unstable();
        Some(order)
    }
}

/// Random generator for one purpose at one place of the run.
fn draw(seed: u64, place: u64, purpose: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ purpose.rotate_left(32));
    rng.set_stream(place);
    rng
}

/// Learning rate at `step`, with `done` the finished share of the run in `[0, 1]`.
pub fn learning_rate(config: &TrainingConfig, step: u64, done: f64) -> f64 {
    let warm = ((step + 1) as f64 / config.warm_up.max(1) as f64).min(1.0);
    let fall = if config.decay {
        0.02 + 0.98 * 0.5 * (1.0 + (std::f64::consts::PI * done.clamp(0.0, 1.0)).cos())
    } else {
        1.0
    };
    config.learning_rate * warm * fall
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;

    #[test]
    fn the_paper_alternates_a_hundred_epochs_with_four() {
        let schedule = Schedule::new(&Preset::Paper.config(), 6, 100, 1);
        assert_eq!(schedule.steps(), 10 * (100 * 6 + 4 * 100));
        for step in 0..600 {
            assert!(matches!(schedule.source(step), SampleSource::Exemplar { .. }));
        }
        for step in 600..1000 {
            assert!(matches!(schedule.source(step), SampleSource::Frame { .. }));
        }
        assert!(matches!(schedule.source(1000), SampleSource::Exemplar { .. }));
    }

    #[test]
    fn every_epoch_visits_each_picture_once_in_its_own_order() {
        let schedule = Schedule::new(&Preset::Paper.config(), 6, 40, 7);
        let epoch = |e: u64| (0..6).map(|i| schedule.source(e * 6 + i)).collect::<Vec<_>>();
        let mut orders = std::collections::HashSet::new();
        for e in 0..20 {
            let samples = epoch(e);
            for pose in 0..6 {
                assert!(samples.contains(&SampleSource::Exemplar { pose }));
            }
            orders.insert(format!("{samples:?}"));
        }
        assert!(orders.len() > 10);
        assert_eq!(epoch(3), epoch(3));
    }

    #[test]
    fn the_fewest_epochs_are_found_that_have_so_many_steps() {
        // A round is four epochs of six poses and one of eight frames.
        let schedule = Schedule::new(&Preset::Quick.config(), 6, 40, 7);
        for (steps, epochs) in [(0, 1), (6, 1), (7, 2), (24, 4), (25, 5), (32, 5), (33, 6)] {
            assert_eq!(schedule.epochs_of(steps), epochs, "{steps} steps");
        }
    }

    #[test]
    fn an_interview_without_frames_leaves_the_exemplars() {
        let schedule = Schedule::new(&Preset::Quick.config(), 3, 0, 1);
        assert!((0..500).all(|s| matches!(schedule.source(s), SampleSource::Exemplar { .. })));
    }

    #[test]
    fn every_lamp_is_sampled_equally_often_and_none_twice_in_a_step() {
        let schedule = Schedule::new(&Preset::Quick.config(), 6, 40, 7);
        let mut times = [0u32; 41];
        const STEPS: u64 = 4000;
        for step in 0..STEPS {
            let lamps = schedule.lamps(step, Some(8), 41).unwrap();
            assert!(lamps.len() == 8 && lamps.is_sorted_by(|a, b| a < b));
            assert_eq!(schedule.lamps(step, Some(8), 41), Some(lamps.clone()));
            lamps.into_iter().for_each(|lamp| times[lamp] += 1);
        }
        // Binomial: five standard deviations of each lamp's count.
        let (mean, share) = (STEPS as f64 * 8.0 / 41.0, 8.0 / 41.0);
        let bound = 5.0 * (mean * (1.0 - share)).sqrt();
        assert!(times.iter().all(|t| (f64::from(*t) - mean).abs() < bound));
        assert_eq!(schedule.lamps(0, None, 41), None);
        assert_eq!(schedule.lamps(0, Some(41), 41), None);
    }

    #[test]
    fn the_rate_warms_up_and_falls() {
        let config = Preset::Quick.config();
        assert!(learning_rate(&config, 0, 0.0) < 0.05 * config.learning_rate);
        assert!((learning_rate(&config, 1000, 0.0) / config.learning_rate - 1.0).abs() < 1e-9);
        assert!((learning_rate(&config, 1000, 1.0) / config.learning_rate - 0.02).abs() < 1e-9);
    }
}
