//! The camera's response: I' = (1 − I)·I^γ1 + I·I^γ2 (the paper's dual gamma, section 3.1).

use serde::{Deserialize, Serialize};

/// A dual gamma curve: encoded I in `[0, 1]` → linear I' in `[0, 1]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DualGamma {
    /// Exponent that rules dark pixels.
    pub gamma1: f32,
    /// Exponent that rules bright pixels.
    pub gamma2: f32,
}
