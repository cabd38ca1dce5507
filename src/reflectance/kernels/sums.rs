//! Sums in a fixed order, so that they are the same on every processor and number of threads.

/// Elements that are added side by side. Two of the widest vectors, so that two chains of additions
/// hide each other's latency.
const LANES: usize = 32;

/// Elements after which a sum in f32 is handed on to f64: 128 additions a lane, whose rounding
/// stays near 1e-6, and 16 KB, so that a second look at a block finds it in the nearest cache.
pub const BLOCK: usize = 4096;

/// A running sum in f32, split over lanes: element i of a slice goes to lane i mod 32.
#[derive(Clone, Copy)]
pub struct Lanes([f32; LANES]);

impl Lanes {
    pub const ZERO: Self = Self([0.0; LANES]);

    /// Adds `term(a, b)` for all pairs of the two slices, which are of one length.
    #[inline(always)]
    pub fn add(&mut self, a: &[f32], b: &[f32], term: impl Fn(f32, f32) -> f32) {
        assert_eq!(a.len(), b.len());
        let mut lanes = self.0;
        let (whole_a, rest_a) = a.as_chunks::<LANES>();
        let (whole_b, rest_b) = b.as_chunks::<LANES>();
        for (a, b) in whole_a.iter().zip(whole_b) {
            for ((lane, &a), &b) in lanes.iter_mut().zip(a).zip(b) {
                *lane += term(a, b);
            }
        }
        for ((lane, &a), &b) in lanes.iter_mut().zip(rest_a).zip(rest_b) {
            *lane += term(a, b);
        }
        self.0 = lanes;
    }

    /// The sum over the lanes, by halves.
    #[inline(always)]
    pub fn total(self) -> f64 {
        let mut sums = self.0.map(f64::from);
        let mut width = LANES / 2;
        while width > 0 {
            for i in 0..width {
                sums[i] += sums[i + width];
            }
            width /= 2;
        }
        sums[0]
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
    use super::super::chunks::tests::noise;

    #[test]
    fn every_element_is_added_once() {
        for count in [0, 1, 31, 32, 33, 4096] {
            let x: Vec<f32> = (0..count).map(|i| i as f32).collect();
            let expected = (count * count.max(1) - count) as f64 / 2.0;
            assert!((sum_of(&x, |x| x) - expected).abs() <= 1e-6 * expected);
        }
    }

    #[test]
    fn pairs_are_summed_as_in_f64() {
        let (a, b) = (noise(4001, 1), noise(4001, 2));
        let expected: f64 = a
            .iter()
            .zip(&b)
            .map(|(&a, &b)| f64::from(a - b).powi(2))
            .sum();
        let sum = sum_of_pairs(&a, &b, |a, b| (a - b) * (a - b));
        assert!((sum / expected - 1.0).abs() < 1e-6);
    }
}
