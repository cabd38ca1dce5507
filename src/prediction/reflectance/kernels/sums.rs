//! Sums in a fixed order, so that they are the same on every processor and number of threads.

/// Elements added side by side: many vectors of any width, so that no addition waits for
/// the one before it.
const LANES: usize = 256;

/// Elements after which a sum in f32 is moved to f64: few additions per lane, whose rounding
/// stays below 1e-6, and 16 KB, so that a second pass over a block finds it in the nearest cache.
pub const BLOCK: usize = 4096;

/// A running sum in f32, split over lanes. Element i of a slice goes to lane i mod 256.
#[derive(Clone, Copy)]
pub struct Lanes([f32; LANES]);

impl Lanes {
    pub const ZERO: Self = Self([0.0; LANES]);

    /// Adds `term(a, b)` for all pairs of the two slices, which have the same length.
    #[inline(always)]
    pub fn add(&mut self, a: &[f32], b: &[f32], term: impl Fn(f32, f32) -> f32) {
        assert_eq!(a.len(), b.len());
        // Chunks whose length is not known to the compiler: it turns loops over arrays into long
        // sequences of single additions.
        for (a, b) in a.chunks(LANES).zip(b.chunks(LANES)) {
            for ((lane, &a), &b) in self.0.iter_mut().zip(a).zip(b) {
                *lane += term(a, b);
            }
        }
    }

    /// The sum over the lanes, by halves.
    #[inline(always)]
    pub fn total(self) -> f64 {
        let mut sums = self.0.map(f64::from);
        let mut rest = &mut sums[..];
        while rest.len() > 1 {
            let (low, high) = rest.split_at_mut(rest.len() / 2);
            for (low, high) in low.iter_mut().zip(high) {
                *low += *high;
            }
            rest = low;
        }
        rest[0]
    }
}

/// Σ term(x) over at most a [`BLOCK`].
#[inline(always)]
pub fn sum_of(x: &[f32], term: impl Fn(f32) -> f32) -> f64 {
    sum_of_pairs(x, x, |x, _| term(x))
}

/// Σ term(a, b) over at most a [`BLOCK`].
#[inline(always)]
pub fn sum_of_pairs(a: &[f32], b: &[f32], term: impl Fn(f32, f32) -> f32) -> f64 {
    let mut lanes = Lanes::ZERO;
    lanes.add(a, b, term);
    lanes.total()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::chunks::tests::noise;
    use crate::kernels::chunks::vectorized;

    #[test]
    fn every_element_is_added_once() {
        for count in [0, 1, 255, 256, 257, 4096] {
            let x: Vec<f32> = (0..count).map(|i| i as f32).collect();
            let expected = (count * count.max(1) - count) as f64 / 2.0;
            assert!((sum_of(&x, |x| x) - expected).abs() <= 1e-6 * expected);
        }
    }

    #[test]
    fn wide_vectors_give_the_bits_of_narrow_ones() {
        let (a, b) = (noise(4001, 1), noise(4001, 2));
        let sum = || sum_of_pairs(&a, &b, |a, b| a * b);
        let wide = vectorized(
            #[inline(always)]
            || sum_of_pairs(&a, &b, |a, b| a * b),
        );
        assert_eq!(std::hint::black_box(sum)().to_bits(), wide.to_bits());
    }

    #[test]
    fn pairs_are_summed_as_in_f64() {
        let (a, b) = (noise(4001, 1), noise(4001, 2));
        let expected: f64 = a.iter().zip(&b).map(|(&a, &b)| f64::from(a - b).powi(2)).sum();
        let sum = sum_of_pairs(&a, &b, |a, b| (a - b) * (a - b));
        assert!((sum / expected - 1.0).abs() < 1e-6);
    }
}
