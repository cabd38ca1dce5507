//! Pointwise functions: the display-like encoding, the sigmoid and the other activations, with their gradients.

use super::chunks::vectorized;

/// o in [`encode`]. It keeps the slope at black finite: 8.9; that of a pure power is infinite.
const OFFSET: f32 = 0.01;

/// The display-like encoding (max(x, 0) + o)^(1/2.2) − o^(1/2.2), with o = 0.01, and its slope, which
/// is 0 below black and that of the power from black on.
///
/// Within 2e-7 of the exact value of y + o^(1/2.2), relative to it. NaN stays NaN, +∞ stays +∞.
#[inline(always)]
pub fn encode(x: f32) -> (f32, f32) {
    let light = lifted(x);
    let root = root_2_2(light);
    let slope = if x < 0.0 { 0.0 } else { root / light * (1.0 / 2.2) };
    // The root reads the bits of a number; ∞ and NaN are excluded.
    let root = if light < f32::INFINITY { root } else { light };
    // By the same root, so that black becomes exactly 0.
    (root - root_2_2(OFFSET), slope)
}

/// The sigmoid 1/(1 + e^−x), within 1e-7. Below −87 it is 0, since e^x leaves the normal numbers there.
#[inline(always)]
pub fn sigmoid(x: f32) -> f32 {
    // Of −|x|, so that the power cannot overflow.
    let log2 = -x.abs() * std::f32::consts::LOG2_E;
    let whole = nearest_whole(log2);
    let power = exp2(whole, log2 - whole);
    let power = if x.abs() > 87.0 { 0.0 } else { power };
    (if x < 0.0 { power } else { 1.0 }) / (1.0 + power)
}

/// Function applied to a convolution's sums.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Activation {
    None,
    /// max(x, 0) + slope · min(x, 0); ReLU has slope 0.
    LeakyRelu(f32),
    /// 1 / (1 + exp(−x)).
    Sigmoid,
}

impl Activation {
    /// Applies it in place.
    pub(super) fn apply(self, values: &mut [f32]) {
        vectorized(
            #[inline(always)]
            || match self {
                Self::None => {}
                Self::LeakyRelu(slope) => {
                    for v in &mut *values {
                        *v = if *v > 0.0 { *v } else { slope * *v };
                    }
                }
                Self::Sigmoid => {
                    for v in &mut *values {
                        *v = sigmoid(*v);
                    }
                }
            },
        );
    }

    /// into = gradient · derivative, from the activation's output.
    pub(super) fn pull_back(self, gradient: &[f32], output: &[f32], into: &mut [f32]) {
        vectorized(
            #[inline(always)]
            || {
                let terms = into.iter_mut().zip(gradient).zip(output);
                match self {
                    Self::None => into.copy_from_slice(gradient),
                    Self::LeakyRelu(slope) => {
                        for ((into, g), y) in terms {
                            *into = if *y > 0.0 { *g } else { slope * g };
                        }
                    }
                    Self::Sigmoid => {
                        for ((into, g), y) in terms {
                            *into = g * y * (1.0 - y);
                        }
                    }
                }
            },
        );
    }
}

/// into = gradient · derivative of a leaky ReLU, from the places of its positive outputs.
pub(super) fn pull_back_leaky(slope: f32, gradient: &[f32], positive: &[bool], into: &mut [f32]) {
    vectorized(
        #[inline(always)]
        || {
            for ((into, g), positive) in into.iter_mut().zip(gradient).zip(positive) {
                *into = if *positive { *g } else { slope * g };
            }
        },
    );
}

/// max(x, 0) + o, where NaN stays NaN.
#[inline(always)]
fn lifted(x: f32) -> f32 {
    (if x < 0.0 { 0.0 } else { x }) + OFFSET
}

/// x^(1/2.2) of a finite x ≥ o, as 2^(log₂(x)·5/11).
#[inline(always)]
fn root_2_2(x: f32) -> f32 {
    // x = m·2^e with √½ ≤ m < √2.
    const SQRT_HALF: u32 = std::f32::consts::FRAC_1_SQRT_2.to_bits();
    let exponent = (x.to_bits().wrapping_sub(SQRT_HALF) as i32) >> 23;
    let mantissa = f32::from_bits(x.to_bits().wrapping_sub((exponent << 23) as u32));
    // e·5/11 in two parts, whole + fraction, both exact except for the division: the rounding of the
    // sum itself would show in the result.
    let exponent = exponent as f32;
    let whole = nearest_whole(exponent * (5.0 / 11.0));
    let fraction = (5.0 * exponent - 11.0 * whole) * (1.0 / 11.0);
    exp2(whole, fraction + log2(mantissa) * (5.0 / 11.0))
}

/// log₂ x for √½ ≤ x ≤ √2, within 5e-8: Chebyshev interpolation of log₂(1 + t)/t, degree 8.
#[inline(always)]
fn log2(x: f32) -> f32 {
    const COEFFICIENTS: [f32; 9] = [
        std::f32::consts::LOG2_E,
        -0.721_347_45,
        0.480_910_75,
        -0.360_693_28,
        0.287_903_25,
        -0.239_169_88,
        0.216_078_22,
        -0.205_861_88,
        0.123_109_68,
    ];
    let t = x - 1.0;
    t * polynomial(t, COEFFICIENTS)
}

/// 2^(whole + fraction) for whole numbers from −126 to 127 and |fraction| ≤ ¾, within 1e-7 of it:
/// Chebyshev interpolation of (2^t − 1)/t, degree 6.
#[inline(always)]
fn exp2(whole: f32, fraction: f32) -> f32 {
    const COEFFICIENTS: [f32; 7] = [
        std::f32::consts::LN_2,
        0.240_226_54,
        0.055_504_11,
        0.009_617_762,
        0.001_333_327_5,
        0.000_155_341_1,
        0.000_015_353_233,
    ];
    // The low bits of whole + WHOLE are those of the integer.
    let integer = (whole + WHOLE).to_bits().wrapping_sub(WHOLE.to_bits());
    let power = f32::from_bits(integer.wrapping_add(127) << 23);
    power * (1.0 + fraction * polynomial(fraction, COEFFICIENTS))
}

/// Σ coefficients[i]·tⁱ. Multiplications and additions stay separate: fused ones are slow function calls
/// on processors without them.
#[inline(always)]
fn polynomial<const N: usize>(t: f32, coefficients: [f32; N]) -> f32 {
    let lower = coefficients[..N - 1].iter().rev();
    lower.fold(coefficients[N - 1], |sum, c| sum * t + c)
}

/// At 1.5·2²³ the numbers of f32 are the integers: adding it rounds.
const WHOLE: f32 = 12_582_912.0;

/// x rounded to an integer, for |x| < 2²². (`f32::round` calls a function where the build's
/// target has no instruction for it.)
#[inline(always)]
fn nearest_whole(x: f32) -> f32 {
    (x + WHOLE) - WHOLE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::chunks::vectorized;
    use proptest::prelude::*;

    /// 0 and values from 1e-9 to 1e6, evenly in their logarithm.
    fn lights() -> Vec<f32> {
        let exponents = (0..300_000).map(|i| -9.0 + 15.0 * f64::from(i) / 299_999.0);
        exponents.map(|e| 10f64.powf(e) as f32).chain([0.0]).collect()
    }

    fn encoded(x: &[f32]) -> Vec<f32> {
        x.iter().map(|x| encode(*x).0).collect()
    }

    fn encoded_gradient(dy: &[f32], x: &[f32]) -> Vec<f32> {
        dy.iter().zip(x).map(|(dy, x)| dy * encode(*x).1).collect()
    }

    fn sigmoids(x: &[f32]) -> Vec<f32> {
        x.iter().map(|x| sigmoid(*x)).collect()
    }

    /// Largest error of `values`, relative to the `expected` value of each of `x`.
    fn largest_relative_error(x: &[f32], values: impl IntoIterator<Item = f64>, expected: impl Fn(f64) -> f64) -> f64 {
        let values = x.iter().zip(values);
        values.map(|(&x, value)| (value / expected(f64::from(x)) - 1.0).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn the_encoding_is_a_power_to_the_last_bits() {
        let x = lights();
        let offset = 0.01f64.powf(1.0 / 2.2);
        let roots = encoded(&x).into_iter().map(|y| f64::from(y) + offset);
        let error = largest_relative_error(&x, roots, |x| (x + 0.01).powf(1.0 / 2.2));
        assert!(error < 2e-7, "{error}");
    }

    #[test]
    fn the_encoding_has_the_slope_of_a_power() {
        let x = lights();
        let slopes = encoded_gradient(&vec![1.0; x.len()], &x).into_iter().map(f64::from);
        let slope = |x: f64| (x + 0.01).powf(1.0 / 2.2 - 1.0) / 2.2;
        let error = largest_relative_error(&x, slopes, slope);
        assert!(error < 3e-7, "{error}");
    }

    #[test]
    fn wide_vectors_give_the_bits_of_narrow_ones() {
        let x = lights();
        let mut wide = vec![(0.0, 0.0); x.len()];
        vectorized(
            #[inline(always)]
            || {
                for (wide, x) in wide.iter_mut().zip(&x) {
                    *wide = encode(*x);
                }
            },
        );
        assert!(x.iter().zip(wide).all(|(x, wide)| encode(*x) == wide));
    }

    #[test]
    fn black_stays_black_and_below_it_nothing_changes() {
        assert_eq!(encoded(&[0.0, -0.0, -1.0, f32::MIN, f32::NEG_INFINITY]), [0.0; 5]);
        assert_eq!(encoded_gradient(&[1.0; 3], &[-1e-9, -1.0, f32::MIN]), [0.0; 3]);
        let at_black = encoded_gradient(&[1.0; 2], &[0.0, -0.0]);
        assert!(at_black.iter().all(|slope| (slope - 5.6).abs() < 0.1), "{at_black:?}");
    }

    #[test]
    fn what_is_no_number_is_not_made_one() {
        assert!(encoded(&[f32::NAN])[0].is_nan() && sigmoids(&[f32::NAN])[0].is_nan());
        assert_eq!(encoded(&[f32::INFINITY]), [f32::INFINITY]);
        assert!(encoded_gradient(&[1.0], &[f32::NAN])[0].is_nan());
    }

    #[test]
    fn the_sigmoid_is_exact_to_a_ten_millionth() {
        let x: Vec<f32> = (-400_000..=400_000).map(|i| i as f32 / 3333.0).collect();
        for (x, y) in x.iter().zip(sigmoids(&x)) {
            let expected = 1.0 / (1.0 + (-f64::from(*x)).exp());
            assert!((f64::from(y) - expected).abs() < 1e-7, "{y} is not {expected} at {x}");
        }
        let ends = [0.0, 100.0, 1e30, f32::INFINITY, -100.0, -1e30, f32::NEG_INFINITY];
        assert_eq!(sigmoids(&ends), [0.5, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    }

    proptest! {
        #[test]
        fn every_number_has_a_finite_encoding_and_slope(x in any::<f32>()) {
            prop_assume!(x.is_finite());
            prop_assert!(encoded(&[x])[0].is_finite() && encoded(&[x])[0] >= 0.0);
            prop_assert!(encoded_gradient(&[1.0], &[x])[0].is_finite());
            prop_assert!((0.0..=1.0).contains(&sigmoids(&[x])[0]));
        }
    }
}
