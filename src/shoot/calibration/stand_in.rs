//! Stand-in for the interview's light.

use serde::{Deserialize, Serialize};

/// The interview's light as a sum of only the learnt lamps, for shoots where other lamps lit it too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StandIn {
    /// Share of each learnt lamp per channel: the least-squares fit, in linear light, of the poses' OLATs to their
    /// sum under all [`super::Calibration::interview_weights`].
    pub weights: Vec<[f32; 3]>,
    /// Root-mean-square difference of the two sums, relative to the sum of all lamps.
    pub residual: f32,
}
