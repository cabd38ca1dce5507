//! What training reports: of one step, and of a whole run.

use reflectance::checkpoint::HeldOut;
use serde::Serialize;

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
    /// Reconstruction loss; none for a sample from the interview.
    pub reconstruction: Option<f32>,
    /// Rendering loss; none in a step that does without.
    pub rendering: Option<f32>,
    pub gradient_norm: f32,
    pub learning_rate: f64,
    /// Whether the weights were changed: not by a step that is not finite.
    pub taken: bool,
}
