//! White light of a temperature and a tint as gains on linear Rec. 709 channels.
//!
//! From 5000 K up the colours are the CIE daylight locus (CIE 15, equations for S_D), up to 4000 K the Planckian
//! locus (the cubic fits of Kim et al., US patent 7024034, within 0.0003 of the locus), and between them a blend of
//! both that is linear in reciprocal temperature.

use imaging::color::{linear_from_xyz, luminance};

/// The temperature of neutral white, D65, in kelvin.
pub const NEUTRAL_K: f32 = 6504.0;
/// Range of the loci in kelvin.
pub const RANGE_K: std::ops::RangeInclusive<f32> = 1667.0..=25000.0;

/// Allowed tints, from green to magenta.
pub const RANGE_TINT: std::ops::RangeInclusive<f32> = -150.0..=150.0;

/// Linear Rec. 709 gains of luminance 1 for light of a temperature in kelvin, clamped to [`RANGE_K`], and a tint.
/// Tint 0 is on the locus; +100 is magenta and −100 green by 1/30 in CIE 1960 (u, v), across the locus (3000 steps
/// per unit, as in photo software). Colours outside Rec. 709 are clipped at 0. 6504 K without tint is exactly
/// neutral; NaN and infinity count as neutral.
pub fn gains(kelvin: f32, tint: f32) -> [f32; 3] {
    let finite = |v: f32, or: f32| if v.is_finite() { v } else { or };
    let kelvin = finite(kelvin, NEUTRAL_K).clamp(*RANGE_K.start(), *RANGE_K.end());
    let tint = finite(tint, 0.0).clamp(*RANGE_TINT.start(), *RANGE_TINT.end());
    let neutral = rgb(f64::from(NEUTRAL_K), 0.0);
    let light = rgb(f64::from(kelvin), f64::from(tint));
    let gains: [f32; 3] = std::array::from_fn(|c| (light[c] / neutral[c]).max(0.0));
    let level = luminance(gains);
    gains.map(|v| v / level)
}

fn rgb(kelvin: f64, tint: f64) -> [f32; 3] {
    let [x, y] = xy_from_uv(tinted(kelvin, tint));
    linear_from_xyz([x / y, 1.0, (1.0 - x - y) / y].map(|v| v as f32))
}

/// CIE 1931 (x, y) of white light of a temperature within [`RANGE_K`].
pub fn chromaticity(kelvin: f64) -> [f64; 2] {
    // 1 at 4000 K and below, 0 at 5000 K and above.
    let warm = ((1e6 / kelvin - 200.0) / 50.0).clamp(0.0, 1.0);
    let (a, b) = match warm {
        0.0 => return daylight(kelvin),
        1.0 => return planckian(kelvin),
        _ => (planckian(kelvin), daylight(kelvin)),
    };
    std::array::from_fn(|i| warm * a[i] + (1.0 - warm) * b[i])
}

/// The daylight locus, 4000 to 25000 K.
fn daylight(kelvin: f64) -> [f64; 2] {
    let t = 1e3 / kelvin;
    let x = if kelvin <= 7000.0 {
        ((-4.6070 * t + 2.9678) * t + 0.09911) * t + 0.244063
    } else {
        ((-2.0064 * t + 1.9018) * t + 0.24748) * t + 0.237040
    };
    [x, (-3.0 * x + 2.870) * x - 0.275]
}

/// The Planckian locus, 1667 to 25000 K.
fn planckian(kelvin: f64) -> [f64; 2] {
    let t = 1e3 / kelvin;
    let x = if kelvin <= 4000.0 {
        ((-0.2661239 * t - 0.2343589) * t + 0.8776956) * t + 0.179910
    } else {
        ((-3.0258469 * t + 2.1070379) * t + 0.2226347) * t + 0.240390
    };
    let y = if kelvin <= 2222.0 {
        ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683
    } else if kelvin <= 4000.0 {
        ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867
    } else {
        ((3.0817580 * x - 5.87338670) * x + 3.75112997) * x - 0.37001483
    };
    [x, y]
}

/// CIE 1960 (u, v) of a temperature, moved across the locus by a tint.
fn tinted(kelvin: f64, tint: f64) -> [f64; 2] {
    let uv = |kelvin: f64| {
        let [x, y] = chromaticity(kelvin);
        let scale = -2.0 * x + 12.0 * y + 3.0;
        [4.0 * x / scale, 6.0 * y / scale]
    };
    let here = uv(kelvin);
    let (cool, warm) = (uv((kelvin * 1.01).min(25000.0)), uv((kelvin * 0.99).max(1667.0)));
    let (du, dv) = (warm[0] - cool[0], warm[1] - cool[1]);
    // Across the locus and away from green, the side with the larger v.
    let step = tint / 3000.0 / du.hypot(dv);
    [here[0] + step * dv, here[1] - step * du]
}

fn xy_from_uv([u, v]: [f64; 2]) -> [f64; 2] {
    let scale = 2.0 * u - 8.0 * v + 4.0;
    [3.0 * u / scale, 2.0 * v / scale]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn published_illuminants_are_met() {
        // CIE 15:2004, table T.3: A, D50, D55, D65, D75 with their correlated colour temperatures.
        for (kelvin, x, y, within) in [
            (2856.0, 0.44757, 0.40745, 5e-4),
            (5003.0, 0.34567, 0.35850, 2e-4),
            (5503.0, 0.33242, 0.34743, 2e-4),
            (6504.0, 0.31272, 0.32903, 2e-4),
            (7504.0, 0.29902, 0.31485, 2e-4),
        ] {
            let is = chromaticity(kelvin);
            assert!((is[0] - x).abs() < within && (is[1] - y).abs() < within, "{kelvin} K: {is:?}");
        }
        // Wyszecki and Stiles, Color Science, table 1(3.11): blackbodies.
        for (kelvin, x, y) in [(2000.0, 0.5267, 0.4133), (3200.0, 0.4234, 0.3990)] {
            let is = chromaticity(kelvin);
            assert!((is[0] - x).abs() < 5e-4 && (is[1] - y).abs() < 5e-4, "{kelvin} K: {is:?}");
        }
    }

    #[test]
    fn daylight_of_6504_k_is_neutral() {
        assert!(gains(6504.0, 0.0).iter().all(|v| (v - 1.0).abs() < 1e-6));
        assert_eq!(gains(f32::NAN, f32::INFINITY), gains(6504.0, 0.0));
    }

    #[test]
    fn warm_is_red_and_plus_is_magenta() {
        let ([r, _, b], [r2, _, b2]) = (gains(3200.0, 0.0), gains(10000.0, 0.0));
        assert!(r > 1.3 && b < 0.5 && r2 < 0.9 && b2 > 1.2);
        assert!(gains(6504.0, 30.0)[1] < 0.97 && gains(6504.0, -30.0)[1] > 1.03);
    }

    proptest! {
        #[test]
        fn gains_are_light_of_luminance_1(kelvin in 0.0f32..40000.0, tint in -200.0f32..200.0) {
            let gains = gains(kelvin, tint);
            prop_assert!(gains.iter().all(|v| v.is_finite() && *v >= 0.0), "{gains:?}");
            prop_assert!((luminance(gains) - 1.0).abs() < 1e-5, "{gains:?}");
        }

        #[test]
        fn no_step_of_temperature_jumps(kelvin in 1700f32..24900.0) {
            // The fits meet at 2222, 4000 and 7000 K to within their published digits.
            let (a, b) = (gains(kelvin, 0.0), gains(kelvin * 1.001, 0.0));
            for (a, b) in a.into_iter().zip(b) {
                prop_assert!((a - b).abs() < 6e-3, "{kelvin} K: {a} {b}");
            }
        }
    }
}
