//! Reports of training: of one step, and of a whole run.

use reflectance::checkpoint::HeldOut;
use serde::Serialize;

/// Result of a run.
#[derive(Clone, Debug, Serialize)]
pub struct TrainReport {
    /// Steps since the start, including earlier runs.
    pub steps: u64,
    /// Seconds of training since the start, including earlier runs.
    pub seconds: f64,
    /// Device of the network, and the reason for the choice.
    pub device: String,
    /// Features by which pictures were compared.
    pub features: String,
    /// Number of the network's parameters.
    pub parameters: usize,
    /// Mean over the last steps of the reconstruction loss: in encoded units with the built-in features,
    /// in units of the layers' levels with those of a file; NaN without a value.
    pub loss_rec: f32,
    /// The same of the rendering loss.
    pub loss_render: f32,
    /// Steps skipped because a loss or gradient was NaN or infinite.
    pub skipped_steps: u64,
    /// The best score on the held-out pose.
    pub held_out: Option<HeldOut>,
    /// Prediction of the held-out pose. [`crate::train`] leaves it out; a later prediction fills it in.
    pub prediction: Option<Prediction>,
    /// Lamps whose outputs were stuck at black or white in the last two checks.
    pub dead_lamps: Vec<String>,
}

/// Prediction of the held-out pose from the other poses: PSNR of its OLATs in dB. The pose also selected the network, so
/// the second figure is a little optimistic.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// Number of the pose, from 0.
    pub pose: usize,
    /// By the exemplars alone.
    pub carried_db: f64,
    /// By the trained network.
    pub corrected_db: f64,
}

/// Figures of one step.
#[derive(Clone, Copy, Debug)]
pub struct StepReport {
    /// Reconstruction loss. None for a frame of the interview.
    pub reconstruction: Option<f32>,
    /// Rendering loss. None in a step without it.
    pub rendering: Option<f32>,
    pub gradient_norm: f32,
    pub learning_rate: f64,
    /// True if the weights were changed; a step with a NaN or infinite loss or gradient is skipped.
    pub taken: bool,
}
