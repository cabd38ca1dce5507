//! The settings of a calibration.

use super::gamma::Comparison;
use super::silhouette::Circle;
use base::error::{Error, Result};
use imaging::{DualGamma, Response};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// How a project is calibrated. What is `None` is found automatically.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CalibrateSettings {
    /// The mirror ball's silhouette; the project keeps it.
    pub circle: Option<Circle>,
    /// Find the silhouette in the photographs instead of using the project's.
    pub find_circle: bool,
    /// How exemplars and interview are compared.
    pub comparison: Option<Comparison>,
    /// The camera's response and the exposure, set by hand.
    pub trial: Option<Trial>,
}

/// A camera response set by hand, and the interview's exposure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    pub response: Response,
    pub exposure: f32,
}

impl Trial {
    /// Exposures that can be tried: a stop down and up.
    pub const EXPOSURES: RangeInclusive<f32> = 0.5..=2.0;

    /// A trial.
    ///
    /// # Errors
    /// When the exposure is not within [`Self::EXPOSURES`].
    pub fn new(response: Response, exposure: f32) -> Result<Self> {
        if Self::EXPOSURES.contains(&exposure) {
            return Ok(Self { response, exposure });
        }
        Err(Error::invalid(
            format!(
                "an exposure of the interview of {exposure} is not from {} to {}",
                Self::EXPOSURES.start(),
                Self::EXPOSURES.end()
            ),
            "Give the interview's exposure as a factor of the OLATs', near 1",
        ))
    }

    /// This response changed by differences of γ1, γ2 and the exposure, kept within their bounds. A plain power
    /// follows γ1; a standard curve does not change.
    pub fn nudged(self, [gamma1, gamma2, exposure]: [f32; 3]) -> Self {
        let within =
            |value: f32, bounds: RangeInclusive<f32>| value.clamp(*bounds.start(), *bounds.end());
        Self {
            response: match self.response {
                Response::Dual(curve) => Response::Dual(DualGamma {
                    gamma1: within(curve.gamma1 + gamma1, DualGamma::BOUNDS),
                    gamma2: within(curve.gamma2 + gamma2, DualGamma::BOUNDS),
                }),
                Response::Power(gamma) => {
                    Response::Power(within(gamma + gamma1, DualGamma::BOUNDS))
                }
                standard => standard,
            },
            exposure: within(self.exposure + exposure, Self::EXPOSURES),
        }
    }
}
