//! A reflectance field in half the memory: f16 under one scale.

mod shrunk;

use super::field::ReflectanceField;
use half::f16;
use half::slice::{HalfBitsSliceExt, HalfFloatSliceExt};
use rayon::prelude::*;

/// Pixels of a tile. Their sums stay in registers while all lamps are read, 128 bytes of each.
pub const TILE: usize = 64;

/// Tiles converted by one task: it reads runs of 16 KiB from every plane.
const TASK: usize = 64;

/// A frame under each lamp, like [`ReflectanceField`], in f16. A value `v` is stored as
/// `f16(v / scale)`, where the scale is a power of two that puts the largest magnitude of the field in
/// [2¹⁴, 2¹⁵), below half's 65,504. The error is at most 2⁻¹¹·|v|, and below 2⁻²⁹ of
/// the field's largest value, where halves are denormal, at most 2⁻³⁹ of that value. Infinities and NaN stay
/// unchanged.
///
/// Tiles of `TILE` pixels lie one after the other, so that a sum over lamps reads memory from its start
/// to its end: `values[((tile · 3 + channel) · lamps + lamp) · TILE + pixel % TILE]`, pixels row by row.
/// The last tile is padded with zeros.
#[derive(Clone, Debug, PartialEq)]
pub struct HalfField {
    pub width: usize,
    pub height: usize,
    /// Number of lamps.
    pub lamps: usize,
    scale: f32,
    values: Vec<u16>,
}

impl From<&ReflectanceField> for HalfField {
    fn from(field: &ReflectanceField) -> Self {
        let exponent = stored_exponent(&field.values);
        let (pixels, tile) = (field.width * field.height, 3 * field.lamps * TILE);
        let mut values = vec![0u16; pixels.div_ceil(TILE) * tile];
        let convert = |(task, tiles): (usize, &mut [u16])| {
            let first = task * TASK * TILE;
            let run = first..pixels.min(first + TASK * TILE);
            let mut scaled = [0f32; TILE];
            for plane in 0..3 * field.lamps {
                let (channel, lamp) = (plane / field.lamps, plane % field.lamps);
                let source = &field.plane(lamp, channel)[run.clone()];
                for (tile, source) in tiles.chunks_mut(tile).zip(source.chunks(TILE)) {
                    for (scaled, value) in scaled.iter_mut().zip(source) {
                        *scaled = value * power_of_two(exponent);
                    }
                    tile[plane * TILE..][..source.len()]
                        .reinterpret_cast_mut::<f16>()
                        .convert_from_f32_slice(&scaled[..source.len()]);
                }
            }
        };
        values.par_chunks_mut((TASK * tile).max(1)).enumerate().for_each(convert);
        Self { width: field.width, height: field.height, lamps: field.lamps, scale: power_of_two(-exponent), values }
    }
}

impl HalfField {
    /// Bytes of a field with this many pixels and lamps.
    pub fn bytes(pixels: usize, lamps: usize) -> usize {
        size_of::<u16>() * pixels.div_ceil(TILE) * 3 * lamps * TILE
    }

    /// Factor on stored values, a power of two.
    #[inline]
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// All stored values, in the layout described at the type.
    pub fn values(&self) -> &[u16] {
        &self.values
    }

    /// Stored values of a tile: channel `c` under lamp `l` is at `c · lamps + l`.
    #[inline]
    pub fn tile(&self, tile: usize) -> &[[u16; TILE]] {
        let planes = 3 * self.lamps;
        &self.values.as_chunks().0[tile * planes..(tile + 1) * planes]
    }

    /// The field in f32.
    pub fn widened(&self) -> ReflectanceField {
        let pixels = self.width * self.height;
        let mut values = vec![0f32; 3 * self.lamps * pixels];
        let planes = values.par_chunks_mut(pixels.max(1)).enumerate();
        planes.for_each(|(plane, out)| {
            let (lamp, channel) = (plane / 3, plane % 3);
            for (tile, out) in out.chunks_mut(TILE).enumerate() {
                let stored = &self.tile(tile)[channel * self.lamps + lamp][..out.len()];
                stored.reinterpret_cast::<f16>().convert_to_f32_slice(&mut *out);
                out.iter_mut().for_each(|value| *value *= self.scale);
            }
        });
        ReflectanceField { width: self.width, height: self.height, lamps: self.lamps, values }
    }
}

/// The power of two that brings the largest finite magnitude to [2¹⁴, 2¹⁵), as far as f32 can hold both
/// its factor and its inverse; 0 if there is none.
fn stored_exponent(values: &[f32]) -> i32 {
    // Without the sign, the bits of floats sort like their magnitudes.
    let largest = values
        .par_chunks(1 << 16)
        .map(|chunk| {
            let magnitudes = chunk.iter().map(|v| v.to_bits() & 0x7fff_ffff);
            magnitudes.fold(0, |a, b| if b < 0x7f80_0000 { a.max(b) } else { a })
        })
        .max()
        .unwrap_or(0);
    match largest {
        0 => 0,
        bits => (14 - ((bits >> 23) as i32 - 127)).min(126),
    }
}

/// 2^`exponent` for −126 to 127.
const fn power_of_two(exponent: i32) -> f32 {
    f32::from_bits(((127 + exponent) as u32) << 23)
}

/// A half as f32, exactly. It consists of operations on whole vectors of any processor: the sum
/// of lamps is then as fast as with the processor's own conversion, because it waits for memory.
#[inline(always)]
pub fn widen(half: u16) -> f32 {
    // Exponent and mantissa move to their places, the sign stays at the top. The exponent is then too
    // small by the difference of both biases, 112, which the factor corrects, also for denormals.
    let placed = ((i32::from(half as i16) << 13) as u32) & 0x8fff_ffff;
    // A constant: a call of a function of this crate would not be inlined into the caller's loop.
    const BIASES: f32 = power_of_two(112);
    let value = f32::from_bits(placed) * BIASES;
    if half & 0x7fff < 0x7c00 { value } else { f32::from_bits(value.to_bits() | 0x7f80_0000) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(width: usize, height: usize, lamps: usize, values: Vec<f32>) -> ReflectanceField {
        ReflectanceField { width, height, lamps, values }
    }

    #[test]
    fn every_half_is_widened_as_ieee_754_has_it() {
        for bits in 0..=u16::MAX {
            let (ours, theirs) = (widen(bits), f16::from_bits(bits).to_f32());
            assert!(
                ours.to_bits() == theirs.to_bits() || (ours.is_nan() && theirs.is_nan()),
                "{bits:#x}: {ours} is not {theirs}"
            );
        }
        test_support::shown!(Pictures, "All 65,536 halves to f32 and back",
 bound: "IEEE 754, bit for bit", measured: "all the same");
    }

    #[test]
    fn no_value_moves_by_more_than_half_a_unit_of_eleven_bits() {
        // Magnitudes over 60 powers of two, with either sign, in an odd size.
        let value = |i: usize| {
            let mantissa = 1.0 + (i.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0;
            let sign = if i.is_multiple_of(3) { -1.0 } else { 1.0 };
            sign * mantissa * power_of_two((i % 60) as i32 - 40)
        };
        let field = field(13, 11, 5, (0..13 * 11 * 15).map(value).collect());
        let largest = field.values.iter().fold(0f32, |a, v| a.max(v.abs()));
        let (mut near, mut far) = (0f32, 0f32);
        for (kept, value) in HalfField::from(&field).widened().values.iter().zip(&field.values) {
            let error = (kept - value).abs();
            if value.abs() >= largest * power_of_two(-28) {
                near = near.max(error / value.abs());
            } else {
                far = far.max(error / largest);
            }
        }
        assert!(near > 0.0 && near <= power_of_two(-11), "{near}");
        assert!(far > 0.0 && far <= power_of_two(-39), "{far}");
        test_support::shown!(Pictures, "A field over 60 powers of two in f16",
 bound: "2⁻¹¹ (4.9e-4) of each value; below 2⁻²⁸ of the largest 2⁻³⁹ (1.8e-12) of that",
 measured: format!("{near:.1e}; {far:.1e}"));
    }

    #[test]
    fn units_do_not_matter() {
        let values: Vec<f32> = (0..3 * 64).map(|i| i as f32 / 192.0).collect();
        let plain = HalfField::from(&field(8, 8, 1, values.clone()));
        for exponent in [-100, -30, 20, 110] {
            let unit = power_of_two(exponent);
            let scaled = values.iter().map(|v| v * unit).collect();
            let half = HalfField::from(&field(8, 8, 1, scaled));
            assert_eq!(half.values(), plain.values());
            assert_eq!(half.scale(), plain.scale() * unit);
        }
    }

    #[test]
    fn hard_values_and_shapes_are_kept() {
        let black = field(3, 1, 2, vec![0.0; 18]);
        assert_eq!(HalfField::from(&black).widened(), black);
        for (width, height, lamps) in [(0, 0, 0), (0, 5, 2), (1, 1, 0)] {
            let empty = field(width, height, lamps, vec![]);
            assert_eq!(HalfField::from(&empty).widened(), empty);
        }
        let values = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e6, -0.0, 3e38];
        let kept = HalfField::from(&field(1, 1, 2, values.to_vec())).widened();
        assert!(kept.values[0].is_nan());
        assert_eq!(kept.values[1..3], values[1..3]);
        assert!(kept.values[5].is_finite());
        // A field of only denormals comes back as exactly as f32 can hold their scale.
        let small = f32::from_bits(0x7000);
        let kept = HalfField::from(&field(1, 1, 1, vec![small, 0.0, -small])).widened();
        assert_eq!(kept.values, [small, 0.0, -small]);
        // The sun's own pixel does not reduce the others' precision.
        let kept = HalfField::from(&field(1, 1, 1, vec![1e6, 1.0 / 3.0, 0.1])).widened();
        assert!((kept.values[1] * 3.0 - 1.0).abs() <= power_of_two(-11));
        test_support::shown!(Pictures, "A field in f16 that is empty, black, only denormals, with NaN, ∞, 3·10³⁸",
 bound: "NaN and ∞ stay, denormals come back exactly, the rest within 2⁻¹¹", measured: "holds");
    }
}
