//! Values of the subject's pixels in half floats: a quarter to a third of what all pixels take in f32.

use half::f16;
use half::slice::HalfFloatSliceExt;
use imaging::Mask;
use rayon::prelude::*;

/// A row of values for each pixel that a matte covers at all or that touches such a pixel; zeros for the others.
#[derive(Clone, Debug)]
pub struct HalfRows {
    /// Values of a row.
    length: usize,
    /// Row of each pixel. The first row is zeros.
    rows: Vec<u32>,
    values: Vec<f16>,
    /// Value of a stored 1.
    scale: f32,
}

impl HalfRows {
    /// Rows of `length` values from 0 up, which `fill` writes for a pixel: once for the scale, and once to be kept. NaN becomes 0,
    /// infinity the largest finite value.
    pub fn new(mask: &Mask, length: usize, fill: impl Fn(usize, &mut [f32]) + Sync) -> Self {
        let (width, height) = mask.size();
        let mut rows = vec![0; width * height];
        let mut pixels = Vec::new();
        for (p, row) in rows.iter_mut().enumerate() {
            let (x, y) = (p % width, p / width);
            let near = |v: usize, length: usize| v.saturating_sub(1)..(v + 2).min(length);
            let mut around = near(y, height).flat_map(|y| near(x, width).map(move |x| (x, y)));
            if around.any(|(x, y)| mask.at(x, y) > 0.0) {
                pixels.push(p);
                *row = pixels.len() as u32;
            }
        }
        let filled = |out: &mut Vec<f32>, p: usize| {
            out.clear();
            out.resize(length, 0.0);
            fill(p, out);
        };
        let largest = |out: &mut Vec<f32>, &p: &usize| {
            filled(out, p);
            let finite = out.iter().copied().filter(|v| v.is_finite());
            finite.fold(0.0, f32::max)
        };
        let scale = (pixels.par_iter().map_init(Vec::new, largest)).reduce(|| 0.0, f32::max);
        let scale = scale.max(f32::MIN_POSITIVE);
        let mut values = vec![f16::ZERO; (pixels.len() + 1) * length];
        values[length..].par_chunks_exact_mut(length.max(1)).zip(&pixels).for_each_init(Vec::new, |out, (row, &p)| {
            filled(out, p);
            for v in &mut *out {
                let share = *v / scale;
                *v = if share > 0.0 { share.min(1.0) } else { 0.0 };
            }
            row.convert_from_f32_slice(out);
        });
        Self { length, rows, values, scale }
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.rows[..]) + size_of_val(&self.values[..])
    }

    /// The values at a place between four pixels, by their shares.
    #[inline(always)]
    pub fn pull(&self, places: [(usize, f32); 4], out: &mut [f32]) {
        let row = |(p, _): (usize, f32)| self.values[self.rows[p] as usize * self.length..][..self.length].iter();
        let [a, b, c, d] = places.map(row);
        let shares = places.map(|(_, share)| share * self.scale);
        for ((((out, a), b), c), d) in out.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            let [a, b, c, d] = [a, b, c, d].map(|value| widened(*value));
            *out = shares[0] * a + shares[1] * b + shares[2] * c + shares[3] * d;
        }
    }
}

/// A finite value from 0 up. Exponents of both formats have biases of 15 and 127.
#[inline(always)]
fn widened(value: f16) -> f32 {
    const BIAS: f32 = (1u128 << (127 - 15)) as f32;
    f32::from_bits(u32::from(value.to_bits()) << 13) * BIAS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_the_subject_come_back_and_all_else_is_zero() {
        let mask = Mask::from_fn(7, 5, |x, y| f32::from(u8::from(x == 3 && y == 2)));
        let value = |p: usize, i: usize| 1e30 * (1 + p) as f32 / (1 + i) as f32;
        let rows = HalfRows::new(&mask, 100, |p, out| {
            out.iter_mut().enumerate().for_each(|(i, v)| *v = value(p, i));
        });
        let mut out = vec![1.0; 100];
        let at = |x: usize, y: usize| y * 7 + x;
        let (a, b) = (at(3, 2), at(4, 3));
        rows.pull([(a, 0.25), (b, 0.75), (at(0, 0), 0.0), (at(6, 4), 0.0)], &mut out);
        for (i, found) in out.iter().enumerate() {
            let expected = 0.25 * value(a, i) + 0.75 * value(b, i);
            assert!((found / expected - 1.0).abs() < 1e-3, "{i}: {found}");
        }
        rows.pull([(at(0, 0), 0.5), (at(6, 4), 0.5), (0, 0.0), (0, 0.0)], &mut out);
        assert!(out.iter().all(|v| *v == 0.0));
        // Nine rows of the subject, and one of zeros.
        assert_eq!(rows.bytes(), 4 * 35 + 2 * 10 * 100);
    }

    #[test]
    fn what_is_not_finite_is_bounded_and_no_subject_has_no_rows() {
        let mask = Mask::filled(4, 4, 1.0);
        let rows = HalfRows::new(&mask, 2, |p, out| {
            out.copy_from_slice(&[f32::INFINITY, if p == 3 { f32::NAN } else { 2.0 }]);
        });
        let mut out = [0.0; 2];
        rows.pull([(0, 1.0), (1, 0.0), (2, 0.0), (3, 0.0)], &mut out);
        assert_eq!(out, [2.0, 2.0]);
        rows.pull([(3, 1.0), (1, 0.0), (2, 0.0), (3, 0.0)], &mut out);
        assert_eq!(out, [2.0, 0.0]);
        let none = HalfRows::new(&mask.map(|_| 0.0), 2, |_, out| out.fill(1.0));
        none.pull([(0, 1.0), (1, 0.0), (2, 0.0), (3, 0.0)], &mut out);
        assert_eq!(out, [0.0, 0.0]);
    }
}
