//! The dual gamma: I' = (1 − I)·I^γ1 + I·I^γ2 (section 3.1 of the paper).

use super::color::unit;
use super::raster::{Encoded, Image, Raster};
use base::error::{Error, Result};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// A dual gamma curve: encoded I in `[0, 1]` → linear I' in `[0, 1]`. The curve runs from 0 to 1;
/// its slope is 0 at black (1 when γ1 = 1) and γ2 at white.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DualGamma {
    /// Exponent of the dark tones.
    pub gamma1: f32,
    /// Exponent of the bright tones.
    pub gamma2: f32,
}

impl DualGamma {
    /// Range of camera exponents: from linear to far beyond any video standard.
    pub const BOUNDS: RangeInclusive<f32> = 1.0..=4.0;

    /// A curve with two exponents.
    ///
    /// # Errors
    /// When an exponent is NaN or outside [`Self::BOUNDS`], or the curve decreases anywhere.
    pub fn new(gamma1: f32, gamma2: f32) -> Result<Self> {
        let curve = Self { gamma1, gamma2 };
        // NaN is in no range, so it is rejected here too.
        if [gamma1, gamma2].iter().all(|g| Self::BOUNDS.contains(g)) && curve.is_monotone() {
            return Ok(curve);
        }
        Err(Error::invalid(
            format!(
                "a camera response of γ1 = {gamma1}, γ2 = {gamma2} cannot be used: both exponents must be from {} to \
                 {}, and the curve must never fall",
                Self::BOUNDS.start(),
                Self::BOUNDS.end()
            ),
            "Run the calibration again, or give exponents near 2.2",
        ))
    }

    /// True if the curve never decreases, checked at 1025 points.
    pub fn is_monotone(&self) -> bool {
        (0..=1024).all(|i| self.value_and_slope(f64::from(i) / 1024.0).1 >= 0.0)
    }

    /// Linear value of an encoded one. Values outside `[0, 1]` are clipped, NaN gives 0.
    pub fn decode_value(&self, encoded: f32) -> f32 {
        self.value_and_slope(f64::from(unit(encoded))).0 as f32
    }

    /// Encoded value of a linear one, solved to far below 1e-6. Values outside `[0, 1]` are clipped, NaN gives 0.
    /// The curve must be monotone.
    pub fn encode_value(&self, linear: f32) -> f32 {
        let y = f64::from(unit(linear));
        if y == 0.0 || y == 1.0 {
            return y as f32;
        }
        let (g1, g2) = (f64::from(self.gamma1), f64::from(self.gamma2));
        // The curve is a mean of I^γ1 and I^γ2, so the solution lies between their inverses.
        let (mut low, mut high) = (y.powf(1.0 / g1.min(g2)), y.powf(1.0 / g1.max(g2)));
        (low, high) = (low.min(high), low.max(high));
        let mut x = 0.5 * (low + high);
        // Newton steps inside a bracket that shrinks every time; 64 halvings exhaust f64.
        for _ in 0..64 {
            let (value, slope) = self.value_and_slope(x);
            if value < y {
                low = x
            } else {
                high = x
            }
            let newton = x - (value - y) / slope;
            let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
            if (next - x).abs() <= 1e-9 * next {
                return next as f32;
            }
            x = next;
        }
        x as f32
    }

    /// d linear / d encoded at an encoded value: 0 at black (1 when γ1 = 1) and γ2 at white.
    pub fn slope(&self, encoded: f32) -> f32 {
        self.value_and_slope(f64::from(unit(encoded))).1 as f32
    }

    /// Linear light of an encoded picture.
    pub fn decode(&self, picture: &Encoded) -> Image {
        decode_with(picture, |value| self.decode_value(value))
    }

    /// The picture that this camera makes of linear light.
    pub fn encode(&self, picture: &Image) -> Encoded {
        Encoded(map_values(picture, |value| self.encode_value(value)))
    }

    /// The dual gamma nearest to a curve from encoded to linear, by root mean square of the encoded values over
    /// the encoded range, and that distance.
    pub fn nearest(decode: impl Fn(f32) -> f32) -> (Self, f32) {
        const CODES: usize = 64;
        let codes = (0..CODES).map(|i| (i as f32 + 0.5) / CODES as f32);
        let levels: Vec<(f32, f32)> = codes.map(|x| (x, decode(x))).collect();
        let distance = |curve: &Self| {
            let off = levels.iter().map(|&(x, y)| (curve.encode_value(y) - x).powi(2));
            (off.sum::<f32>() / CODES as f32).sqrt()
        };
        let mut best = (Self { gamma1: 2.2, gamma2: 2.2 }, f32::INFINITY);
        // Each round searches around the best of the previous one with a third of its step.
        for round in 0..8 {
            let (centre, step) = (best.0, 0.6 / 3f32.powi(round));
            for i in -3..=3 {
                for j in -3..=3 {
                    let near = |gamma: f32, steps: i32| {
                        (gamma + step * steps as f32).clamp(*Self::BOUNDS.start(), *Self::BOUNDS.end())
                    };
                    let curve = Self::new(near(centre.gamma1, i), near(centre.gamma2, j));
                    if let Ok(curve) = curve
                        && distance(&curve) < best.1
                    {
                        best = (curve, distance(&curve));
                    }
                }
            }
        }
        best
    }

    /// I' and dI'/dI for encoded I in `[0, 1]`.
    fn value_and_slope(&self, x: f64) -> (f64, f64) {
        let (g1, g2) = (f64::from(self.gamma1), f64::from(self.gamma2));
        // I^(γ−1) is finite at 0 because γ ≥ 1, so no division by I is needed.
        let (a, b) = (x.powf(g1 - 1.0), x.powf(g2));
        ((1.0 - x) * a * x + x * b, g1 * a - (g1 + 1.0) * a * x + (g2 + 1.0) * b)
    }
}

/// Decodes a picture through a curve. The 256 values of 8-bit pictures come from a table, all others are
/// computed.
pub(super) fn decode_with(picture: &Encoded, decode: impl Fn(f32) -> f32 + Sync) -> Image {
    let codes: [f32; 256] = std::array::from_fn(|code| code as f32 / 255.0);
    let table = codes.map(&decode);
    map_values(&picture.0, |value| {
        let code = (value * 255.0 + 0.5) as usize & 255;
        if codes[code] == value { table[code] } else { decode(value) }
    })
}

/// A picture with every channel of every pixel mapped.
pub(super) fn map_values(picture: &Raster<[f32; 3]>, value: impl Fn(f32) -> f32 + Sync) -> Raster<[f32; 3]> {
    let pixels = picture.pixels.par_iter().with_min_len(4096).map(|pixel| pixel.map(&value)).collect();
    Raster { width: picture.width, height: picture.height, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn exponents() -> impl Strategy<Value = DualGamma> {
        let exponent = || prop_oneof![Just(1.0f32), Just(4.0f32), 1.0f32..=4.0];
        (exponent(), exponent()).prop_map(|(gamma1, gamma2)| DualGamma { gamma1, gamma2 })
    }

    proptest! {
        #[test]
        fn every_curve_within_the_bounds_is_accepted(curve in exponents()) {
            prop_assert_eq!(DualGamma::new(curve.gamma1, curve.gamma2).unwrap(), curve);
        }

        #[test]
        fn codes_and_light_round_trip(curve in exponents(), x in 0.0f32..=1.0) {
            // A code so dark that its light is denormal cannot make the round trip.
            prop_assume!(x == 0.0 || curve.decode_value(x) > f32::MIN_POSITIVE);
            prop_assert!((curve.encode_value(curve.decode_value(x)) - x).abs() <= 1e-6);
            prop_assert!((curve.decode_value(curve.encode_value(x)) - x).abs() <= 1e-6);
        }

        #[test]
        fn more_light_is_a_higher_code(curve in exponents(), x in 0.0f32..1.0, step in 1e-5f32..0.1) {
            prop_assert!(curve.encode_value(x) < curve.encode_value((x + step).min(1.0)));
        }
    }

    #[test]
    fn black_and_white_stay() {
        for (g1, g2) in [(1.0, 1.0), (1.0, 4.0), (4.0, 1.0), (2.6, 2.1)] {
            let curve = DualGamma::new(g1, g2).unwrap();
            for end in [0.0, 1.0] {
                assert_eq!(curve.decode_value(end), end);
                assert_eq!(curve.encode_value(end), end);
            }
        }
    }

    #[test]
    fn the_slope_is_finite_at_both_ends() {
        for (g1, g2) in [(1.0, 1.0), (1.0, 4.0), (4.0, 1.0), (2.6, 2.1)] {
            let curve = DualGamma { gamma1: g1, gamma2: g2 };
            assert_eq!(curve.value_and_slope(0.0).1, if g1 == 1.0 { 1.0 } else { 0.0 });
            assert!((curve.value_and_slope(1.0).1 - f64::from(g2)).abs() < 1e-12);
        }
    }

    #[test]
    fn hostile_values_go_to_the_ends() {
        let curve = DualGamma::new(2.6, 2.1).unwrap();
        for (value, end) in [(f32::NAN, 0.0), (-1.0, 0.0), (f32::NEG_INFINITY, 0.0), (2.0, 1.0), (f32::INFINITY, 1.0)] {
            assert_eq!(curve.decode_value(value), end);
            assert_eq!(curve.encode_value(value), end);
        }
        assert!((0.0..1e-6).contains(&curve.encode_value(f32::from_bits(1))));
    }

    #[test]
    fn impossible_exponents_are_refused() {
        for (g1, g2) in [(f32::NAN, 2.0), (2.0, f32::INFINITY), (0.9, 2.0), (2.0, 4.1), (-2.0, 2.0)] {
            assert!(DualGamma::new(g1, g2).is_err(), "({g1}, {g2})");
        }
        assert!(!DualGamma { gamma1: 1.0, gamma2: 20.0 }.is_monotone());
    }

    #[test]
    fn a_picture_is_decoded_like_its_values() {
        let curve = DualGamma::new(2.3, 1.9).unwrap();
        let picture = Encoded(Raster::from_fn(300, 4, |x, y| {
            [x as f32 / 255.0, (x * y) as f32 / 1017.0, if x == 7 { f32::NAN } else { -(y as f32) }]
        }));
        let light = curve.decode(&picture);
        for (pixel, code) in light.pixels.iter().zip(&picture.0.pixels) {
            assert_eq!(*pixel, code.map(|v| curve.decode_value(v)));
        }
        for (pixel, code) in curve.encode(&light).0.pixels.iter().zip(&picture.0.pixels) {
            assert!((pixel[1] - code[1].clamp(0.0, 1.0)).abs() < 1e-6);
        }
    }
}
