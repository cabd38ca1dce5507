//! Reports of a training run: figures as events, pictures in a slot that keeps the newest.

use std::sync::Arc;

/// Losses after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LossPoint {
    /// Number of steps, including earlier runs.
    pub step: u64,
    /// Training time in seconds, including earlier runs.
    pub seconds: f64,
    /// Mean reconstruction loss since the previous point; None if no step used an exemplar.
    pub reconstruction: Option<f32>,
    /// Mean rendering loss since the previous point; None if no step computed it.
    pub rendering: Option<f32>,
    /// PSNR on the held-out pose in dB, if measured since the previous point.
    pub held_out_db: Option<f32>,
}

impl LossPoint {
    /// Mean of this point, which already averages `count` points, and the next.
    pub fn joined(self, next: Self, count: u32) -> Self {
        let mean = |old: Option<f32>, new: Option<f32>| match (old, new) {
            (Some(old), Some(new)) => Some(old + (new - old) / (count + 1) as f32),
            (old, new) => old.or(new),
        };
        Self {
            reconstruction: mean(self.reconstruction, next.reconstruction),
            rendering: mean(self.rendering, next.rendering),
            held_out_db: next.held_out_db.or(self.held_out_db),
            ..next
        }
    }
}

/// Data that a training step learns from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrainingPhase {
    Exemplars,
    Interview,
}

/// The current figures of a run, a few times per second at most.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainingPoint {
    pub losses: LossPoint,
    pub phase: TrainingPhase,
    pub learning_rate: f64,
    /// Norm of all gradients of the last step, before clipping.
    pub gradient_norm: f32,
    /// Steps per second, without pauses and checks.
    pub steps_per_second: f64,
    /// Multiply-adds per prediction of the network. With the rate they predict the time of another network.
    pub multiply_adds: u64,
    /// Memory that the process holds, in bytes; None if the system does not report it.
    pub memory_bytes: Option<u64>,
    /// Steps of this run that were skipped because a loss or gradient was NaN or infinite.
    pub skipped_steps: u64,
    /// Numbers of the lamps whose outputs are stuck at black or white.
    pub dead_lamps: Vec<usize>,
}

/// One pose under every lamp: predicted and true.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainingPictures {
    /// Training steps of the network.
    pub step: u64,
    /// Number of the pose, and true if it is held out of training.
    pub pose: usize,
    pub held_out: bool,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// Encoded for display, black outside the matte: `[lamps, height, width, 3]`.
    pub predicted: Vec<u8>,
    pub truth: Arc<Vec<u8>>,
}

impl TrainingPictures {
    /// Number of lamps.
    pub fn lamps(&self) -> usize {
        self.truth.len() / self.bytes().max(1)
    }

    fn bytes(&self) -> usize {
        3 * self.size[0] * self.size[1]
    }

    /// The pose under a lamp: predicted, true, and their difference times `gain`. None if there is no such lamp.
    pub fn of_lamp(&self, lamp: usize, gain: u32) -> Option<[Vec<u8>; 3]> {
        let place = lamp * self.bytes()..(lamp + 1) * self.bytes();
        let (predicted, truth) = (self.predicted.get(place.clone())?, self.truth.get(place)?);
        let apart = |(&a, &b): (&u8, &u8)| (u32::from(a.abs_diff(b)) * gain).min(255) as u8;
        let difference = predicted.iter().zip(truth).map(apart).collect();
        Some([predicted.to_vec(), truth.to_vec(), difference])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joined_points_are_their_mean_and_a_term_that_is_missing_does_not_count() {
        let point = |step, reconstruction, held_out_db| LossPoint {
            step,
            seconds: step as f64,
            reconstruction,
            rendering: Some(step as f32),
            held_out_db,
        };
        let three =
            point(3, Some(0.3), Some(20.0)).joined(point(6, Some(0.9), None), 1).joined(point(9, None, None), 2);
        assert_eq!(three, LossPoint { rendering: Some(6.0), seconds: 9.0, ..point(9, Some(0.6), Some(20.0)) });
    }

    #[test]
    fn a_lamp_s_pictures_are_cut_out_and_their_difference_is_enlarged() {
        let pictures = TrainingPictures {
            step: 1,
            pose: 0,
            held_out: false,
            size: [2, 1],
            predicted: (0..12).collect(),
            truth: Arc::new(vec![0, 1, 2, 3, 4, 5, 0, 7, 8, 109, 10, 1]),
        };
        assert_eq!(pictures.lamps(), 2);
        let [predicted, truth, difference] = pictures.of_lamp(1, 4).unwrap();
        assert_eq!(predicted, [6, 7, 8, 9, 10, 11]);
        assert_eq!(truth, [0, 7, 8, 109, 10, 1]);
        assert_eq!(difference, [24, 0, 0, 255, 0, 40]);
        assert_eq!(pictures.of_lamp(2, 4), None);
    }
}
