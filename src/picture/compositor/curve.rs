//! Curve over light as a table: logarithms and powers dominate the cost of a pass.

/// log2 of the lowest light with a segment of its own.
const DARKEST: i32 = -16;
/// log2 of the most light.
const BRIGHTEST: i32 = 16;

/// Bits of the position within an octave: 128 segments per octave.
const DROPPED: u32 = 16;

/// Piecewise linear curve with 128 segments per octave from 2⁻¹⁶ to 2¹⁶, and one segment from 0 to
/// there. A power or a logarithm is accurate to 10⁻⁵ of its value.
pub(super) struct Curve {
    at_zero: f32,
    values: Vec<f32>,
}

impl Curve {
    pub fn new(curve: impl Fn(f32) -> f32) -> Self {
        let [first, last] = [DARKEST, BRIGHTEST].map(|e| (e as f32).exp2().to_bits() >> DROPPED);
        Self { at_zero: curve(0.0), values: (first..=last + 1).map(|i| curve(f32::from_bits(i << DROPPED))).collect() }
    }

    /// The curve at `x`; negative values and NaN count as 0.
    #[inline]
    pub fn at(&self, x: f32) -> f32 {
        const LEAST: f32 = 1.0 / 65536.0;
        const MOST: f32 = 65536.0;
        let x = if x > 0.0 { x.min(MOST) } else { 0.0 };
        if x < LEAST {
            return self.at_zero + x / LEAST * (self.values[0] - self.at_zero);
        }
        let place = x.to_bits() - LEAST.to_bits();
        let piece = (place >> DROPPED) as usize;
        let within = (place & 0xffff) as f32 / 65536.0;
        let [a, b] = [self.values[piece], self.values[piece + 1]];
        a + within * (b - a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::color::srgb_from_linear;

    #[test]
    fn a_table_is_the_curve_that_it_was_made_of() {
        let srgb = Curve::new(srgb_from_linear);
        let log = Curve::new(|x| x.max(1e-10).log2());
        for i in 0..20_000 {
            let x = (i as f32 / 1000.0 - 15.9).exp2();
            assert!((srgb.at(x) - srgb_from_linear(x)).abs() < 1e-5, "{x}");
            assert!((log.at(x) - x.log2()).abs() < 2e-5, "{x}");
        }
        assert_eq!(srgb.at(1.0), 1.0);
    }

    #[test]
    fn hostile_values_are_at_the_ends() {
        let curve = Curve::new(|x| 1.0 + x);
        for (x, wanted) in [
            (f32::NAN, 1.0),
            (f32::NEG_INFINITY, 1.0),
            (-0.0, 1.0),
            (1e-30, 1.0),
            (f32::INFINITY, 65537.0),
            (1e30, 65537.0),
        ] {
            assert_eq!(curve.at(x), wanted, "{x}");
        }
    }
}
