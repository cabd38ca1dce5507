//! Catmull-Rom cubic: a smooth curve through evenly spaced values.

/// Four samples along one axis, and their weights for a point between the second and the third. The sum of the weights is 1.
#[derive(Clone, Copy)]
pub(crate) struct Taps {
    pub places: [usize; 4],
    pub shares: [f32; 4],
}

impl Taps {
    /// For the position `at` among `count` samples at 0, 1, 2 …; the outer samples repeat beyond the ends.
    pub fn at(at: f32, count: usize) -> Self {
        let last = count.saturating_sub(1);
        let at = at.clamp(0.0, last as f32);
        let first = (at as usize).min(last);
        let t = at - first as f32;
        Self {
            places: [0, 1, 2, 3].map(|k| (first + k).saturating_sub(1).min(last)),
            shares: [
                t * (-0.5 + t * (1.0 - 0.5 * t)),
                1.0 + t * t * (1.5 * t - 2.5),
                t * (0.5 + t * (2.0 - 1.5 * t)),
                t * t * (0.5 * t - 0.5),
            ],
        }
    }

    /// The weighted sum of `value` at the four samples.
    pub fn sum<const N: usize>(&self, value: impl Fn(usize) -> [f32; N]) -> [f32; N] {
        let mut sum = [0.0; N];
        for (place, share) in self.places.into_iter().zip(self.shares) {
            let value = value(place);
            (0..N).for_each(|c| sum[c] += share * value[c]);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_stays_one_and_ends_go_on() {
        let at = |place: f32| Taps::at(place, 9).sum(|i| [(i * i) as f32, 1.0]);
        for place in [1.0, 1.25, 3.5, 6.9] {
            let [square, one] = at(place);
            assert!((square - place * place).abs() < 1e-4 && (one - 1.0).abs() < 1e-6);
        }
        assert_eq!((at(-3.0), at(20.0)), ([0.0, 1.0], [64.0, 1.0]));
        assert_eq!(Taps::at(0.4, 1).sum(|i| [i as f32 + 5.0]), [5.0]);
    }
}
