//! What a person chose for a calibration.

use super::gamma::Comparison;
use super::silhouette::Circle;
use base::error::{Error, Result};
use imaging::{DualGamma, Response};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// How a project is calibrated. What is none is found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CalibrateSettings {
    /// The mirror ball's silhouette, which the project keeps from then on.
    pub circle: Option<Circle>,
    /// Look for the silhouette in the photographs, in place of the project's.
    pub find_circle: bool,
    /// What of the exemplars and the interview is compared.
    pub comparison: Option<Comparison>,
    /// The camera's response and the exposure, set by hand.
    pub trial: Option<Trial>,
}

/// A response of the camera to be tried by hand, and the interview's exposure.
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
        Err(Error::unexpected(
            "the interview's exposure",
            format!("{} to {}", Self::EXPOSURES.start(), Self::EXPOSURES.end()),
            exposure.to_string(),
            "Give how many times as bright the interview was exposed as the OLATs, near 1",
        ))
    }

    /// Another by these differences of γ1, γ2 and the exposure, within their bounds. A power follows γ1; a
    /// standard curve stays.
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
