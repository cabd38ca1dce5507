//! Camera responses: the fitted dual gamma, a plain power, and standard curves.

use super::color::unit;
use super::dual_gamma::{DualGamma, decode_with, map_values};
use super::raster::{Encoded, Image};
use base::error::Error;
use base::numbers;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// A camera's response: encoded values in `[0, 1]` ↔ linear ones in `[0, 1]`. Every curve runs from 0 to 1 and
/// never decreases. Values outside `[0, 1]` are clipped, NaN gives 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "Stored", try_from = "Stored")]
pub enum Response {
    /// The fitted curve with two exponents.
    Dual(DualGamma),
    /// I' = I^γ, γ within [`DualGamma::BOUNDS`]: the dual gamma with two equal exponents. 2.4 is the display of
    /// ITU-R BT.1886.
    Power(f32),
    /// IEC 61966-2-1.
    Srgb,
    /// The inverse of the camera curve of ITU-R BT.709, with the constants of BT.2020: the same curve without a
    /// gap between its two parts.
    Rec709,
    /// Encoded values are linear already.
    Linear,
    /// I' = ((1 + K)^I − 1)/K, K within [`Response::LOG_BOUNDS`]: the logarithm of light, as in cameras' log
    /// profiles above their darkest tones. Lifts middle tones more than any dual gamma.
    Log(f32),
}

/// BT.2020's α and β, to the last digit of an f64.
const ALPHA: f64 = 1.099_296_826_809_443;
const BETA: f64 = 0.018_053_968_510_807_81;

impl Response {
    /// Range of a log curve's K.
    pub const LOG_BOUNDS: RangeInclusive<f32> = 1.0..=1000.0;

    /// The standard curve with this name, in any spacing and case.
    pub fn standard(name: &str) -> Option<Self> {
        [Self::Srgb, Self::Rec709, Self::Linear].into_iter().find(|curve| {
            let own = curve.name().replace([' ', '.'], "");
            own.eq_ignore_ascii_case(name.trim())
        })
    }

    /// The log curve with parameter K.
    ///
    /// # Errors
    /// When K is not within [`Self::LOG_BOUNDS`].
    pub fn log(k: f32) -> Result<Self, Error> {
        if Self::LOG_BOUNDS.contains(&k) {
            return Ok(Self::Log(k));
        }
        Err(Error::invalid(
            format!("K = {k} of a log curve is not from {} to {}", Self::LOG_BOUNDS.start(), Self::LOG_BOUNDS.end()),
            "Cameras have about 10 to 60",
        ))
    }

    /// The curve's name in sentences and in the window.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Dual(_) => "dual gamma",
            Self::Power(_) => "power",
            Self::Srgb => "sRGB",
            Self::Rec709 => "Rec. 709",
            Self::Linear => "linear",
            Self::Log(_) => "log",
        }
    }

    /// γ1 and γ2 if the curve is a dual gamma or a plain power, else `None`.
    pub fn exponents(&self) -> Option<[f32; 2]> {
        match *self {
            Self::Dual(DualGamma { gamma1, gamma2 }) => Some([gamma1, gamma2]),
            Self::Power(gamma) => Some([gamma; 2]),
            _ => None,
        }
    }

    /// The dual gamma nearest to the curve, see [`DualGamma::nearest`], and its distance. A dual gamma returns
    /// itself and 0.
    pub fn nearest_dual_gamma(&self) -> (DualGamma, f32) {
        match self {
            Self::Dual(curve) => (*curve, 0.0),
            _ => DualGamma::nearest(|encoded| self.decode_value(encoded)),
        }
    }

    /// Linear value of an encoded one.
    pub fn decode_value(&self, encoded: f32) -> f32 {
        let x = f64::from(unit(encoded));
        let light = match self {
            Self::Dual(curve) => return curve.decode_value(encoded),
            Self::Power(gamma) => x.powf(f64::from(*gamma)),
            Self::Srgb if x <= 0.040_45 => x / 12.92,
            Self::Srgb => ((x + 0.055) / 1.055).powf(2.4),
            Self::Rec709 if x <= 4.5 * BETA => x / 4.5,
            Self::Rec709 => ((x + ALPHA - 1.0) / ALPHA).powf(1.0 / 0.45),
            Self::Linear => x,
            Self::Log(k) => {
                let k = f64::from(*k);
                (x * k.ln_1p()).exp_m1() / k
            }
        };
        light as f32
    }

    /// Encoded value of a linear one, to far below 1e-6.
    pub fn encode_value(&self, linear: f32) -> f32 {
        let y = f64::from(unit(linear));
        let code = match self {
            Self::Dual(curve) => return curve.encode_value(linear),
            Self::Power(gamma) => y.powf(1.0 / f64::from(*gamma)),
            Self::Srgb if y <= 0.040_45 / 12.92 => 12.92 * y,
            Self::Srgb => 1.055 * y.powf(1.0 / 2.4) - 0.055,
            Self::Rec709 if y <= BETA => 4.5 * y,
            Self::Rec709 => ALPHA * y.powf(0.45) - (ALPHA - 1.0),
            Self::Linear => y,
            Self::Log(k) => {
                let k = f64::from(*k);
                (k * y).ln_1p() / k.ln_1p()
            }
        };
        code as f32
    }

    /// d linear / d encoded at an encoded value; finite everywhere, and 0 at black if the curve starts flat.
    pub fn slope(&self, encoded: f32) -> f32 {
        let x = f64::from(unit(encoded));
        let slope = match self {
            Self::Dual(curve) => return curve.slope(encoded),
            Self::Power(gamma) => f64::from(*gamma) * x.powf(f64::from(*gamma) - 1.0),
            Self::Srgb if x <= 0.040_45 => 1.0 / 12.92,
            Self::Srgb => 2.4 / 1.055 * ((x + 0.055) / 1.055).powf(1.4),
            Self::Rec709 if x <= 4.5 * BETA => 1.0 / 4.5,
            Self::Rec709 => ((x + ALPHA - 1.0) / ALPHA).powf(1.0 / 0.45 - 1.0) / (0.45 * ALPHA),
            Self::Linear => 1.0,
            Self::Log(k) => {
                let k = f64::from(*k);
                (x * k.ln_1p()).exp() * k.ln_1p() / k
            }
        };
        slope as f32
    }

    /// Linear light of an encoded picture.
    pub fn decode(&self, picture: &Encoded) -> Image {
        decode_with(picture, |value| self.decode_value(value))
    }

    /// The picture that this camera makes of linear light.
    pub fn encode(&self, picture: &Image) -> Encoded {
        Encoded(map_values(picture, |value| self.encode_value(value)))
    }
}

impl From<DualGamma> for Response {
    fn from(curve: DualGamma) -> Self {
        Self::Dual(curve)
    }
}

/// The curve with its exponents or its K, for sentences.
impl fmt::Display for Response {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Dual(curve) => write!(f, "γ1 = {:.3}, γ2 = {:.3}", curve.gamma1, curve.gamma2),
            Self::Power(gamma) => write!(f, "γ = {gamma:.3}"),
            Self::Log(k) => write!(f, "log, K = {k:.1}"),
            _ => f.write_str(self.name()),
        }
    }
}

/// A response in a file: a standard curve by name, a log curve by its K, or a dual gamma by its exponents, which
/// are equal for a power.
#[derive(Serialize, Deserialize)]
struct Stored {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    curve: Option<Standard>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    gamma1: Option<f32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    gamma2: Option<f32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    log_k: Option<f32>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Standard {
    Power,
    Srgb,
    Rec709,
    Linear,
    Log,
}

impl From<Response> for Stored {
    fn from(response: Response) -> Self {
        let [gamma1, gamma2] = response.exponents().map_or([None; 2], |exponents| exponents.map(Some));
        let curve = match response {
            Response::Dual(_) => None,
            Response::Power(_) => Some(Standard::Power),
            Response::Srgb => Some(Standard::Srgb),
            Response::Rec709 => Some(Standard::Rec709),
            Response::Linear => Some(Standard::Linear),
            Response::Log(_) => Some(Standard::Log),
        };
        let log_k = match response {
            Response::Log(k) => Some(k),
            _ => None,
        };
        Self { curve, gamma1, gamma2, log_k }
    }
}

impl TryFrom<Stored> for Response {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        let dual = || DualGamma::new(stored.gamma1.unwrap_or(f32::NAN), stored.gamma2.unwrap_or(f32::NAN));
        Ok(match stored.curve {
            None => Self::Dual(dual()?),
            Some(Standard::Power) => Self::Power(dual()?.gamma1),
            Some(Standard::Srgb) => Self::Srgb,
            Some(Standard::Rec709) => Self::Rec709,
            Some(Standard::Linear) => Self::Linear,
            Some(Standard::Log) => Self::log(stored.log_k.unwrap_or(f32::NAN))?,
        })
    }
}

impl FromStr for Response {
    type Err = String;

    /// Parses `srgb`, `rec709`, `linear`, `log,30` for a log curve with K = 30, the exponent of a power curve
    /// such as `2.2`, or the two of a dual gamma such as `2.6,2.1`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        if let Some(curve) = Self::standard(text) {
            return Ok(curve);
        }
        let name = text.split(',').next().unwrap_or_default().trim();
        if let (true, Some((_, k))) = (name.eq_ignore_ascii_case("log"), text.split_once(',')) {
            let [k] = numbers(k, "log,K with a number for K, such as log,30")?;
            return Self::log(k as f32).map_err(|e| e.to_string());
        }
        let names = "srgb, rec709, linear, log,K such as log,30, an exponent such as 2.2, or two such as 2.6,2.1";
        if !text.contains(',') {
            let [gamma] = numbers(text, names)?;
            let curve = DualGamma::new(gamma as f32, gamma as f32).map_err(|e| e.to_string())?;
            return Ok(Self::Power(curve.gamma1));
        }
        let [gamma1, gamma2] = numbers(text, names)?;
        let curve = DualGamma::new(gamma1 as f32, gamma2 as f32).map_err(|e| e.to_string())?;
        Ok(curve.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Raster;
    use proptest::prelude::*;

    fn curves() -> impl Strategy<Value = Response> {
        let exponent = || prop_oneof![Just(1.0f32), Just(4.0f32), 1.0f32..=4.0];
        prop_oneof![
            (exponent(), exponent()).prop_map(|(gamma1, gamma2)| Response::Dual(DualGamma { gamma1, gamma2 })),
            exponent().prop_map(Response::Power),
            Just(Response::Srgb),
            Just(Response::Rec709),
            Just(Response::Linear),
            (1.0f32..=1000.0).prop_map(Response::Log),
        ]
    }

    #[test]
    fn codes_and_light_round_trip() {
        let largest = std::cell::Cell::new(0.0f32);
        proptest!(|(curve in curves(), x in 0.0f32..=1.0)| {
            // A code so dark that its light is denormal cannot make the round trip.
            prop_assume!(x == 0.0 || curve.decode_value(x) > f32::MIN_POSITIVE);
            let there = (curve.encode_value(curve.decode_value(x)) - x).abs();
            let back = (curve.decode_value(curve.encode_value(x)) - x).abs();
            prop_assert!(there <= 1e-6);
            prop_assert!(back <= 1e-6);
            largest.set(largest.get().max(there).max(back));
        });
        test_support::shown!(Pictures, "Codes to light and back, under every kind of response", bound: "1e-6", measured: format!("{:.1e}", largest.get()));
    }

    proptest! {
        #[test]
        fn more_light_is_a_higher_code(curve in curves(), x in 0.0f32..1.0, step in 1e-5f32..0.1) {
            prop_assert!(curve.encode_value(x) < curve.encode_value((x + step).min(1.0)));
        }

        #[test]
        fn the_slope_is_that_of_the_curve(curve in curves(), x in 0.01f32..0.99) {
            let h = 2e-3;
            let rise = f64::from(curve.decode_value(x + h)) - f64::from(curve.decode_value(x - h));
            // Bound: the curvature of the steepest curve, γ = 4, over the step. At the corner of the two curves
            // with a straight foot only the first derivative is continuous.
            prop_assert!((rise / f64::from((x + h) - (x - h)) - f64::from(curve.slope(x))).abs() < 4e-3);
        }

        #[test]
        fn two_equal_exponents_are_a_plain_power(gamma in 1.0f32..=4.0, x in 0.0f32..=1.0) {
            let dual = DualGamma { gamma1: gamma, gamma2: gamma };
            prop_assert!((dual.decode_value(x) - Response::Power(gamma).decode_value(x)).abs() <= 1e-7);
        }
    }

    fn all() -> [Response; 8] {
        [
            Response::Dual(DualGamma { gamma1: 1.0, gamma2: 4.0 }),
            Response::Dual(DualGamma { gamma1: 4.0, gamma2: 1.0 }),
            Response::Power(1.0),
            Response::Power(4.0),
            Response::Srgb,
            Response::Rec709,
            Response::Linear,
            Response::Log(30.0),
        ]
    }

    #[test]
    fn every_curve_runs_from_black_to_white_with_finite_slopes() {
        for curve in all() {
            for end in [0.0, 1.0] {
                assert_eq!(curve.decode_value(end), end, "{curve:?}");
                assert_eq!(curve.encode_value(end), end, "{curve:?}");
                assert!((0.0..=4.0).contains(&curve.slope(end)), "{curve:?}");
            }
            for (hostile, end) in [(f32::NAN, 0.0), (-1.0, 0.0), (f32::INFINITY, 1.0)] {
                assert_eq!(curve.decode_value(hostile), end);
                assert_eq!(curve.encode_value(hostile), end);
                assert!(curve.slope(hostile).is_finite());
            }
        }
    }

    #[test]
    fn the_standards_have_their_published_values() {
        // IEC 61966-2-1: mid-grey code 188 is 0.50289 of light. BT.709: 18 % grey is E' = 0.409.
        assert!((Response::Srgb.decode_value(188.0 / 255.0) - 0.502_886).abs() < 1e-5);
        assert!((Response::Rec709.encode_value(0.18) - 0.409_008).abs() < 5e-4);
        for i in 0..=1000 {
            let x = i as f32 / 1000.0;
            let known = crate::color::linear_from_srgb(x);
            assert!((Response::Srgb.decode_value(x) - known).abs() < 1e-6);
        }
    }

    #[test]
    fn a_file_keeps_every_curve_and_refuses_what_is_none() {
        #[derive(PartialEq, Debug, Serialize, Deserialize)]
        struct File {
            #[serde(flatten)]
            response: Response,
            other: f32,
        }
        for response in all() {
            let file = File { response, other: 1.0 };
            let text = toml::to_string(&file).unwrap();
            assert_eq!(toml::from_str::<File>(&text).unwrap(), file, "{text}");
        }
        for text in [
            "",
            "gamma1 = 2.0",
            "gamma1 = nan\ngamma2 = 2.0",
            "curve = \"log\"",
            "curve = \"log\"\nlog_k = 0.5",
            "curve = \"film\"",
        ] {
            assert!(toml::from_str::<File>(&format!("other = 1.0\n{text}")).is_err());
        }
    }

    #[test]
    fn a_log_curve_is_typed_with_its_k_and_lifts_middle_tones() {
        for text in ["log,30", " Log, 30 "] {
            assert_eq!(text.parse(), Ok(Response::Log(30.0)));
        }
        for text in ["", "log", "log,", "log,0", "log,nan", "log,3000", "log,30,2", "9,9"] {
            assert!(text.parse::<Response>().is_err(), "{text}");
        }
        // ln(1 + 30·0.18)/ln 31 = 0.5406.
        assert!((Response::Log(30.0).encode_value(0.18) - 0.540_6).abs() < 1e-4);
    }

    #[test]
    fn pictures_are_decoded_and_encoded_like_their_values() {
        let picture = Encoded(Raster::from_fn(256, 2, |x, y| [x as f32 / 255.0, (x + y) as f32 / 300.0, 0.5]));
        for curve in all() {
            let light = curve.decode(&picture);
            for (pixel, code) in light.pixels.iter().zip(&picture.0.pixels) {
                assert_eq!(*pixel, code.map(|v| curve.decode_value(v)));
            }
            let back = curve.encode(&light);
            assert_eq!(back.0.at(7, 1)[2], curve.encode_value(light.at(7, 1)[2]));
        }
    }

    #[test]
    fn a_log_curve_runs_from_black_to_white_and_lifts_the_middle() {
        let log = Response::Log(30.0);
        assert_eq!(log.decode_value(0.0), 0.0);
        assert!((log.decode_value(1.0) - 1.0).abs() < 1e-6);
        assert!(log.decode_value(0.5) < Response::Srgb.decode_value(0.5));
    }

    #[test]
    fn the_nearest_dual_gamma_is_the_curve_itself_or_close_to_it() {
        let own = DualGamma { gamma1: 1.4, gamma2: 3.0 };
        assert_eq!(Response::Dual(own).nearest_dual_gamma(), (own, 0.0));
        let power = Response::Power(2.4).nearest_dual_gamma();
        assert!((power.0.gamma1 - 2.4).abs() < 1e-2 && (power.0.gamma2 - 2.4).abs() < 1e-2);
        assert!(power.1 < 1e-4);
        let srgb = Response::Srgb.nearest_dual_gamma();
        assert!((1e-4..0.02).contains(&srgb.1), "{srgb:?}");
    }
}
