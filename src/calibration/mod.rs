//! Calibration: where the lamps are, how strong they are, which sum of them is the interview's
//! light, and how the camera encoded all of it.

pub mod gamma;
pub mod mirror_ball;
pub mod probe;

use crate::imaging::DualGamma;
use crate::light::Rig;
use serde::{Deserialize, Serialize};

/// Everything the calibration found, as kept in `calibration.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// The camera's response: encoded → linear.
    pub response: DualGamma,
    /// Factor between the OLAT session and the interview that the mirror balls do not explain:
    /// interview = exposure · Σ interview_weights_i · OLAT_i.
    pub exposure: f32,
    /// For each lamp and channel, its share in the interview's light.
    pub interview_weights: Vec<[f32; 3]>,
    /// Share of the interview probe's energy from where no lamp is.
    pub uncovered_energy: f32,
    /// Relative residual of the interview probe after the fit, 0 when lamps explain all of it.
    pub probe_residual: f32,
    /// Root-mean-square distance of the encoded quantiles that γ was fitted to.
    pub gamma_residual: f32,
    /// The lamps.
    pub rig: Rig,
}
