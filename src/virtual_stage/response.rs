//! The camera's response: the curves of [`imaging::Response`], and one that is like a camera's log.

use base::numbers;
use imaging::{DualGamma, Response};
use serde::Serialize;
use std::str::FromStr;

/// Encoded → linear, both from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Curve {
    Known(Response),
    /// Encoded = ln(1 + K·linear) / ln(1 + K): middle tones are lifted as by a camera's log curve, which no dual
    /// gamma matches.
    Log {
        log: f32,
    },
}

impl Curve {
    /// Linear value of an encoded one.
    pub fn decode_value(&self, encoded: f32) -> f32 {
        match self {
            Self::Known(response) => response.decode_value(encoded),
            Self::Log { log } => {
                let k = f64::from(*log);
                ((f64::from(encoded) * k.ln_1p()).exp_m1() / k) as f32
            }
        }
    }

    /// The dual gamma whose encoded values are nearest to this curve's, see [`DualGamma::nearest`].
    pub fn nearest_dual_gamma(&self) -> (DualGamma, f32) {
        match self {
            Self::Known(Response::Dual(curve)) => (*curve, 0.0),
            _ => DualGamma::nearest(|encoded| self.decode_value(encoded)),
        }
    }
}

impl From<DualGamma> for Curve {
    fn from(curve: DualGamma) -> Self {
        Self::Known(curve.into())
    }
}

impl FromStr for Curve {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some(k) = text.trim().strip_prefix("log,") else {
            return Ok(Self::Known(text.parse()?));
        };
        let [k] = numbers(k, "log,K with K from 1 to 1000, such as log,30")?;
        if (1.0..=1000.0).contains(&k) {
            return Ok(Self::Log { log: k as f32 });
        }
        Err(format!("{text:?} is not log,K with K from 1 to 1000"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_read_as_they_are_typed() {
        let dual = Curve::from(DualGamma {
            gamma1: 2.9,
            gamma2: 1.9,
        });
        assert_eq!("2.9,1.9".parse(), Ok(dual));
        assert_eq!("srgb".parse(), Ok(Curve::Known(Response::Srgb)));
        assert_eq!("log,30".parse(), Ok(Curve::Log { log: 30.0 }));
        for text in ["", "log", "log,", "log,0", "log,nan", "9,9"] {
            assert!(text.parse::<Curve>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_log_curve_runs_from_black_to_white_and_lifts_the_middle() {
        let log = Curve::Log { log: 30.0 };
        assert_eq!(log.decode_value(0.0), 0.0);
        assert!((log.decode_value(1.0) - 1.0).abs() < 1e-6);
        assert!(log.decode_value(0.5) < Curve::Known(Response::Srgb).decode_value(0.5));
    }

    #[test]
    fn the_nearest_dual_gamma_is_the_curve_itself_or_close_to_it() {
        let own = DualGamma {
            gamma1: 1.4,
            gamma2: 3.0,
        };
        assert_eq!(Curve::from(own).nearest_dual_gamma(), (own, 0.0));
        let power = Curve::Known(Response::Power(2.4)).nearest_dual_gamma();
        assert!((power.0.gamma1 - 2.4).abs() < 1e-2 && (power.0.gamma2 - 2.4).abs() < 1e-2);
        assert!(power.1 < 1e-4);
        let srgb = Curve::Known(Response::Srgb).nearest_dual_gamma();
        assert!((1e-4..0.02).contains(&srgb.1), "{srgb:?}");
    }
}
