//! Display transform of linear light as a table: any transform of colours, at the same speed on every device.
//!
//! Light goes through a logarithm and then through a cube, which is interpolated within tetrahedra as in
//! [`crate::Cube`]. `color_config` measures its error.

use crate::Image;
use crate::color::unit;
use crate::cube::Table;
use std::f32::consts::LN_2;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Entries along an axis.
const SIZE: usize = 65;
/// A channel's position among the entries is log2(1 + SLOPE · √light) / STOPS. The root spreads the entries near
/// black as displays' powers do. With these two constants, light of 1, where many transforms clip, is exactly an
/// entry.
const SLOPE: f32 = 7.0;
const STOPS: f32 = 6.0;
/// Range of codes in the table. Wider than `[0, 1]`, so that a transform that clips there does so between
/// entries.
const CODES: [f32; 2] = [-1.0, 4.0];

/// Display codes for linear Rec. 709, under a name that the user knows.
#[derive(Clone)]
pub struct DisplayTable {
    pub name: String,
    table: Table,
    identity: u64,
}

impl DisplayTable {
    /// The brightest light in the table; brighter light gives the same codes.
    pub const MOST: f32 = 81.0;

    /// Samples a transform: `encode` replaces linear light with codes.
    pub fn new(name: String, encode: impl FnOnce(&mut [[f32; 3]])) -> Self {
        let light = |i: usize| {
            let root = ((STOPS * i as f32 / (SIZE - 1) as f32).exp2() - 1.0) / SLOPE;
            root * root
        };
        let at = |i: usize| [i % SIZE, i / SIZE % SIZE, i / (SIZE * SIZE)].map(light);
        let mut values: Vec<[f32; 3]> = (0..SIZE.pow(3)).map(at).collect();
        encode(&mut values);
        let [least, most] = CODES;
        for value in values.iter_mut().flatten() {
            *value = if value.is_nan() { 0.0 } else { value.clamp(least, most) };
        }
        let mut hasher = DefaultHasher::new();
        (values.iter().flatten()).for_each(|value| value.to_bits().hash(&mut hasher));
        Self { name, table: Table { size: SIZE, least: [0.0; 3], most: [1.0; 3], values }, identity: hasher.finish() }
    }

    /// Codes of light, in `[0, 1]`. Negative light and NaN count as black.
    pub fn at(&self, light: [f32; 3]) -> [f32; 3] {
        let place = |v: f32| (SLOPE * v.max(0.0).sqrt()).ln_1p() / (STOPS * LN_2);
        self.table.cube(light.map(place)).map(unit)
    }

    /// Identifier of the codes: equal for equal tables.
    pub fn identity(&self) -> u64 {
        self.identity
    }

    /// All entries, red fastest, as a picture of 65² columns and 65 rows.
    pub fn entries(&self) -> Image {
        Image { width: SIZE * SIZE, height: SIZE, pixels: self.table.values.clone() }
    }
}

impl PartialEq for DisplayTable {
    fn eq(&self, other: &Self) -> bool {
        (&self.name, self.identity) == (&other.name, other.identity)
    }
}

impl std::fmt::Debug for DisplayTable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {:x}", self.name, self.identity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::srgb_from_linear;

    /// sRGB without its clip; the table clips.
    fn srgb(name: &str) -> DisplayTable {
        let code = |v: f32| match v {
            1.0.. => 1.0 + 0.44 * (v - 1.0),
            _ => srgb_from_linear(v),
        };
        DisplayTable::new(name.to_owned(), |pixels| {
            pixels.iter_mut().for_each(|pixel| *pixel = pixel.map(code));
        })
    }

    #[test]
    fn a_table_is_within_half_a_code_of_the_curve_that_it_was_made_of() {
        let table = srgb("sRGB");
        assert_eq!(table.at([0.0; 3]), [0.0; 3]);
        assert_eq!(table.at([1.0; 3]).map(|code| (1e6 * code).round()), [1e6; 3]);
        let mut worst = 0f32;
        for i in 0..4000 {
            let light = (i as f32 / 200.0 - 14.0).exp2();
            let found = table.at([light, 0.25 * light, 0.0]);
            let wanted = [light, 0.25 * light, 0.0].map(srgb_from_linear);
            (0..3).for_each(|c| worst = worst.max((found[c] - wanted[c]).abs()));
        }
        assert!(worst < 0.5 / 255.0, "{worst}");
    }

    #[test]
    fn channels_may_depend_on_each_other() {
        let table = DisplayTable::new("swapped".to_owned(), |pixels| {
            for [r, g, b] in pixels {
                (*r, *g, *b) = (*b, *r, (*g).min(1.0));
            }
        });
        // Entries are reproduced exactly.
        let light = [1.0, 0.0, 0.0];
        assert_eq!(table.at(light).map(|code| (1e5 * code).round()), [0.0, 1e5, 0.0]);
        let [_, green, blue] = table.at([0.5, 0.25, 0.125]);
        assert!((green - 0.5).abs() < 4e-3 && (blue - 0.25).abs() < 4e-3);
        assert_eq!(table.entries().size(), (SIZE * SIZE, SIZE));
    }

    #[test]
    fn hostile_light_and_hostile_codes_are_codes() {
        let table = DisplayTable::new("wild".to_owned(), |pixels| {
            let wild = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
            pixels.iter_mut().for_each(|pixel| *pixel = wild);
        });
        for table in [table, srgb("sRGB")] {
            for light in [f32::NAN, -1.0, f32::NEG_INFINITY, 1e30, f32::INFINITY] {
                let codes = table.at([light, 0.2, light]);
                assert!(codes.iter().all(|c| (0.0..=1.0).contains(c)), "{codes:?}");
            }
        }
        assert_eq!(srgb("a").at([f32::INFINITY; 3]), [1.0; 3]);
    }

    #[test]
    fn tables_are_the_same_if_their_names_and_codes_are() {
        assert_eq!(srgb("a"), srgb("a"));
        assert_ne!(srgb("a"), srgb("b"));
        let black = DisplayTable::new("a".to_owned(), |pixels| pixels.fill([0.0; 3]));
        assert_ne!(black, srgb("a"));
    }
}
