//! Camera response to try.

use base::error::{Error, Result};
use base::numbers;
use imaging::{DualGamma, Response};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use std::str::FromStr;

/// A camera response set by hand, with the interview's exposure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    pub response: Response,
    pub exposure: f32,
}

impl Trial {
    /// Range of trial exposures: one stop down to one stop up.
    pub const EXPOSURES: RangeInclusive<f32> = 0.5..=2.0;

    /// Builds a trial.
    ///
    /// # Errors
    /// When the exposure is outside [`Self::EXPOSURES`].
    pub fn new(response: Response, exposure: f32) -> Result<Self> {
        if Self::EXPOSURES.contains(&exposure) {
            return Ok(Self { response, exposure });
        }
        Err(Error::invalid(
            format!(
                "interview exposure {exposure} is outside {} to {}",
                Self::EXPOSURES.start(),
                Self::EXPOSURES.end()
            ),
            "Give the interview's exposure relative to the OLATs, near 1",
        ))
    }

    /// The trial changed by differences of γ1, γ2 and the exposure, clamped to their bounds. A plain power follows
    /// γ1, and so does ln K of a log curve; a standard curve does not change.
    pub fn nudged(self, [gamma1, gamma2, exposure]: [f32; 3]) -> Self {
        let within = |value: f32, bounds: RangeInclusive<f32>| value.clamp(*bounds.start(), *bounds.end());
        Self {
            response: match self.response {
                Response::Dual(curve) => Response::Dual(DualGamma {
                    gamma1: within(curve.gamma1 + gamma1, DualGamma::BOUNDS),
                    gamma2: within(curve.gamma2 + gamma2, DualGamma::BOUNDS),
                }),
                Response::Power(gamma) => Response::Power(within(gamma + gamma1, DualGamma::BOUNDS)),
                // Steps of ln K change the curve about as evenly as steps of an exponent.
                Response::Log(k) => Response::Log(within(k * gamma1.exp(), Response::LOG_BOUNDS)),
                standard => standard,
            },
            exposure: within(self.exposure + exposure, Self::EXPOSURES),
        }
    }
}

impl FromStr for Trial {
    type Err = String;

    /// Parses a response and, after another comma, an optional exposure (1 by default).
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        // Either a single name, or log and its K, or two exponents; one exponent has no exposure.
        let numbers_of_response = match text.split(',').next().and_then(Response::standard) {
            Some(_) => 1,
            None => 2,
        };
        let (response, exposure) = match text.match_indices(',').nth(numbers_of_response - 1) {
            Some((comma, _)) => (&text[..comma], &text[comma + 1..]),
            None => (text, "1"),
        };
        let [exposure] = numbers(exposure, "an exposure such as 1.1")?;
        Self::new(response.parse()?, exposure as f32).map_err(|e| e.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_response_is_a_name_or_exponents_and_an_exposure_may_follow() {
        let dual = Response::Dual(DualGamma { gamma1: 2.5, gamma2: 1.75 });
        for (text, response, exposure) in [
            ("2.5,1.75", dual, 1.0),
            ("2.2", Response::Power(2.2), 1.0),
            ("2.5, 1.75, 1.25", dual, 1.25),
            ("srgb", Response::Srgb, 1.0),
            ("Rec709,0.5", Response::Rec709, 0.5),
            ("linear", Response::Linear, 1.0),
            ("log,30", Response::Log(30.0), 1.0),
            ("log,30,1.25", Response::Log(30.0), 1.25),
        ] {
            assert_eq!(text.parse(), Ok(Trial { response, exposure }), "{text}");
        }
        for text in ["", "9", "log", "srgb,", "srgb,9", "9,9", "2.5,1.75,1,1", "nan,2"] {
            assert!(text.parse::<Trial>().is_err(), "{text}");
        }
    }
}
