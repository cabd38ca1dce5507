//! Functions of single values: the display-like encoding and the sigmoid, with their gradients.

use super::chunks::{WORTH_A_THREAD, each_chunk};

/// o in [`encode`]. It keeps the slope at black finite: 8.9, where a pure power has none.
const OFFSET: f32 = 0.01;
/// o^(1/2.2)
const ENCODED_OFFSET: f32 = 0.123_284_67;

/// The display-like encoding (max(x, 0) + o)^(1/2.2) − o^(1/2.2), with o = 0.01.
///
/// Within 2e-7 of the exact value of y + o^(1/2.2), relative to it. NaN stays NaN, +∞ stays +∞.
pub fn encode(x: &[f32], y: &mut [f32]) {
    assert_eq!(x.len(), y.len());
    each_chunk(
        y,
        WORTH_A_THREAD,
        #[inline(always)]
        |index, y| {
            for (y, &x) in y.iter_mut().zip(&x[index * WORTH_A_THREAD..]) {
                let light = lifted(x);
                let root = root_2_2(light);
                // The root reads the bits of a number; ∞ and NaN are none.
                let root = if light < f32::INFINITY { root } else { light };
                *y = root - ENCODED_OFFSET;
            }
        },
    );
}

/// The gradient of [`encode`]: dx = dy·(x + o)^(1/2.2 − 1)/2.2 where x ≥ 0, and 0 elsewhere.
pub fn encode_backward(dy: &[f32], x: &[f32], dx: &mut [f32]) {
    assert_eq!((dy.len(), x.len()), (dx.len(), dx.len()));
    each_chunk(
        dx,
        WORTH_A_THREAD,
        #[inline(always)]
        |index, dx| {
            let start = index * WORTH_A_THREAD;
            for ((dx, &dy), &x) in dx.iter_mut().zip(&dy[start..]).zip(&x[start..]) {
                let light = lifted(x);
                let slope = root_2_2(light) / light * (1.0 / 2.2);
                *dx = if x < 0.0 { 0.0 } else { dy * slope };
            }
        },
    );
}

/// The sigmoid 1/(1 + e^−x), within 1e-7. Below −87 it is 0, as e^x leaves the normal numbers there.
#[inline(always)]
pub fn sigmoid(x: f32) -> f32 {
    // Of −|x|, so that the power cannot overflow.
    let log2 = -x.abs() * std::f32::consts::LOG2_E;
    let whole = nearest_whole(log2);
    let power = exp2(whole, log2 - whole);
    let power = if x.abs() > 87.0 { 0.0 } else { power };
    (if x < 0.0 { power } else { 1.0 }) / (1.0 + power)
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
    // e·5/11 in two parts, whole + fraction, both exact but for the division: the rounding of the
    // sum itself would be seen in the result.
    let exponent = exponent as f32;
    let whole = nearest_whole(exponent * (5.0 / 11.0));
    let fraction = (5.0 * exponent - 11.0 * whole) * (1.0 / 11.0);
    exp2(whole, fraction + log2(mantissa) * (5.0 / 11.0))
}

/// log₂ x for √½ ≤ x ≤ √2, within 5e-8: Chebyshev interpolation of log₂(1 + t)/t, degree 8.
#[inline(always)]
fn log2(x: f32) -> f32 {
    const COEFFICIENTS: [f32; 9] = [
        1.442_695,
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
    t * polynomial(t, &COEFFICIENTS)
}

/// 2^(whole + fraction) for whole numbers from −126 to 127 and |fraction| ≤ ¾, within 1e-7 of it:
/// Chebyshev interpolation of (2^t − 1)/t, degree 6.
#[inline(always)]
fn exp2(whole: f32, fraction: f32) -> f32 {
    const COEFFICIENTS: [f32; 7] = [
        0.693_147_2,
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
    power * (1.0 + fraction * polynomial(fraction, &COEFFICIENTS))
}

/// Σ coefficients[i]·t^i. Multiplications and additions stay apart, see [the kernels](crate).
#[inline(always)]
fn polynomial(t: f32, coefficients: &[f32]) -> f32 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c)
}

/// At 1.5·2²³ the numbers of f32 are the integers: adding it rounds.
const WHOLE: f32 = 12_582_912.0;

/// x rounded to a whole number, for |x| < 2²². (`f32::round` calls a function where the build's
/// target has no instruction for it.)
#[inline(always)]
fn nearest_whole(x: f32) -> f32 {
    (x + WHOLE) - WHOLE
}
