//! Colour: luminance, the sRGB transfer function and CIE XYZ.

/// Relative luminance of linear Rec.709 RGB (ITU-R BT.709).
pub fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Linear Rec.709 RGB from CIE XYZ relative to D65 (the matrix of IEC 61966-2-1). Colours outside the primaries'
/// triangle have negative channels.
pub fn linear_from_xyz([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.240_97 * x - 1.537_383_2 * y - 0.498_610_76 * z,
        -0.969_243_65 * x + 1.875_967_5 * y + 0.041_555_06 * z,
        0.055_630_08 * x - 0.203_976_96 * y + 1.056_971_5 * z,
    ]
}

/// `x` clamped to `[0, 1]`; NaN becomes 0, where `f32::clamp` would return NaN.
pub fn unit(x: f32) -> f32 {
    if x >= 1.0 {
        1.0
    } else if x > 0.0 {
        x
    } else {
        0.0
    }
}

/// sRGB encoding of a linear value (IEC 61966-2-1). Values outside `[0, 1]` are clipped, NaN gives 0.
pub fn srgb_from_linear(linear: f32) -> f32 {
    let x = unit(linear);
    // The formula itself gives 0.99999994 at 1.
    if x <= 0.003_130_8 {
        12.92 * x
    } else if x < 1.0 {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    } else {
        1.0
    }
}

/// Linear value of an sRGB-encoded one (IEC 61966-2-1), for encoded values in `[0, 1]`.
pub fn linear_from_srgb(encoded: f32) -> f32 {
    let x = unit(encoded);
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// Code of linear light for a reference monitor of ITU-R BT.1886 with a perfect black: a power of 2.4. Values
/// outside `[0, 1]` are clipped, NaN gives 0.
pub fn bt1886_from_linear(linear: f32) -> f32 {
    unit(linear).powf(1.0 / 2.4)
}

/// The 8-bit code of a value in `[0, 1]`, rounded to nearest.
pub fn byte_from_unit(value: f32) -> u8 {
    (unit(value) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_round_trips() {
        for i in 0..=1000 {
            let x = i as f32 / 1000.0;
            assert!((linear_from_srgb(srgb_from_linear(x)) - x).abs() < 1e-5);
        }
    }

    #[test]
    fn the_white_of_xyz_is_white() {
        let white = linear_from_xyz([0.950_455_9, 1.0, 1.089_057_8]);
        assert!(white.iter().all(|v| (v - 1.0).abs() < 1e-4), "{white:?}");
        assert!((luminance(linear_from_xyz([0.3, 0.7, 0.2])) - 0.7).abs() < 1e-3);
    }

    #[test]
    fn hostile_values_encode_to_the_ends() {
        assert_eq!(srgb_from_linear(f32::NAN), 0.0);
        assert_eq!(srgb_from_linear(f32::NEG_INFINITY), 0.0);
        assert_eq!(srgb_from_linear(f32::INFINITY), 1.0);
        assert_eq!(byte_from_unit(f32::NAN), 0);
    }
}
