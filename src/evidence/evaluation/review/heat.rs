//! Colour scale for errors.

use super::Metric;

/// Dark purple to pale yellow, as used by FLIP's authors: matplotlib's colour map magma at nine points, as sRGB codes.
const MAGMA: [[u8; 3]; 9] = [
    [0, 0, 4],
    [28, 16, 68],
    [79, 18, 123],
    [129, 37, 129],
    [181, 54, 122],
    [229, 80, 100],
    [251, 135, 97],
    [254, 194, 135],
    [252, 253, 191],
];

/// sRGB codes (0 to 1) for an error from 0 to 1, interpolated linearly. NaN counts as 0.
pub fn heat(error: f32) -> [f32; 3] {
    let place = imaging::color::unit(error) * (MAGMA.len() - 1) as f32;
    let (low, share) = (place.floor() as usize, place.fract());
    let high = (low + 1).min(MAGMA.len() - 1);
    std::array::from_fn(|c| {
        let [a, b] = [MAGMA[low][c], MAGMA[high][c]].map(f32::from);
        (a + share * (b - a)) / 255.0
    })
}

impl Metric {
    /// Scores drawn as no error and as the largest error.
    pub fn range(self) -> [f64; 2] {
        match self {
            Self::Psnr => [40.0, 20.0],
            Self::Ssim => [1.0, 0.5],
            Self::Flip => [0.0, 0.25],
        }
    }
}

/// Maps a score to an error from 0 to 1 within its metric's range.
pub fn badness(metric: Metric, value: f64) -> f32 {
    let [good, bad] = metric.range();
    (((value - good) / (bad - good)) as f32).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worse_is_brighter_by_any_figure() {
        let bright = |metric, value| heat(badness(metric, value)).iter().sum::<f32>();
        for metric in Metric::ALL {
            let [good, bad] = metric.range();
            let values: Vec<f32> =
                (0..=20).map(|i| bright(metric, good + (bad - good) * f64::from(i) / 20.0)).collect();
            assert!(values.windows(2).all(|w| w[1] > w[0]), "{values:?}");
            assert_eq!(bright(metric, bad + 9.0 * (bad - good)), values[20]);
        }
        assert_eq!(heat(f32::NAN), heat(0.0));
    }
}
