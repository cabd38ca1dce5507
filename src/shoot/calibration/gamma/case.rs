//! Accounts of the pictures, and credible intervals over both.

use crate::trial::Trial;
use imaging::{DualGamma, Response};
use serde::{Deserialize, Serialize};

/// One account of the pictures: the exposure of the camera was either unchanged or changed between the balls and
/// the filming.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// True if the exposure was changed.
    pub changed: bool,
    /// Probability, 0 to 1; the two cases add up to 1.
    pub probability: f32,
    /// Most probable response and exposure.
    pub gamma1: f32,
    pub gamma2: f32,
    pub exposure: f32,
    /// Mean and standard deviation of γ1, γ2 and ln exposure.
    pub mean: [f32; 3],
    pub deviation: [f32; 3],
}

impl Case {
    /// Most probable response.
    pub fn response(&self) -> Response {
        Response::Dual(DualGamma { gamma1: self.gamma1, gamma2: self.gamma2 })
    }

    /// Response and exposure of this account, clamped to their bounds, for trial and saving.
    pub fn trial(&self) -> Trial {
        Trial { response: self.response(), exposure: self.exposure }.nudged([0.0; 3])
    }
}

/// Central intervals that contain the true value with a probability, over both cases.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Probability, 0 to 1.
    pub probability: f32,
    pub gamma1: [f32; 2],
    pub gamma2: [f32; 2],
    pub exposure: [f32; 2],
}

impl Interval {
    /// Probabilities of the intervals.
    const LEVELS: [f32; 3] = [0.5, 0.9, 0.99];

    /// The intervals of 50, 90 and 99 %; empty without cases.
    pub(crate) fn from_cases(cases: &[Case]) -> Vec<Self> {
        if cases.is_empty() {
            return vec![];
        }
        let interval = |probability: f32| {
            let tail = 0.5 * (1.0 - f64::from(probability));
            let [gamma1, gamma2, exposure] =
                [0, 1, 2].map(|i| [tail, 1.0 - tail].map(|below| quantile(cases, i, below) as f32));
            Self { probability, gamma1, gamma2, exposure: exposure.map(f32::exp) }
        };
        Self::LEVELS.map(interval).to_vec()
    }
}

/// Quantile of an unknown (γ1, γ2 or ln exposure) over the cases.
fn quantile(cases: &[Case], unknown: usize, below: f64) -> f64 {
    let parts = || {
        cases.iter().map(|case| {
            (f64::from(case.probability), f64::from(case.mean[unknown]), f64::from(case.deviation[unknown]).max(1e-9))
        })
    };
    let share = |x: f64| -> f64 {
        parts().map(|(probability, mean, deviation)| probability * normal((x - mean) / deviation)).sum()
    };
    let reach = |sign: f64| parts().map(move |(_, mean, deviation)| mean + sign * 9.0 * deviation);
    let mut low = reach(-1.0).fold(f64::INFINITY, f64::min);
    let mut high = reach(1.0).fold(f64::NEG_INFINITY, f64::max);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if share(middle) < below {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Cumulative normal distribution at `x` deviations, to 2·10⁻⁷ (Abramowitz and Stegun 1964, 7.1.26).
fn normal(x: f64) -> f64 {
    let z = x.abs() / std::f64::consts::SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * z);
    let series =
        t * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let above = 0.5 * series * (-z * z).exp();
    if x < 0.0 { above } else { 1.0 - above }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(probability: f32, mean: f32, deviation: f32) -> Case {
        Case {
            changed: false,
            probability,
            gamma1: mean,
            gamma2: mean,
            exposure: 1.0,
            mean: [mean; 3],
            deviation: [deviation; 3],
        }
    }

    #[test]
    fn intervals_of_one_case_are_those_of_the_normal_distribution() {
        let intervals = Interval::from_cases(&[case(1.0, 2.0, 0.1)]);
        for (interval, reach) in intervals.iter().zip([0.674_49, 1.644_85, 2.575_83]) {
            assert!((interval.gamma1[0] - (2.0 - 0.1 * reach)).abs() < 1e-4);
            assert!((interval.gamma2[1] - (2.0 + 0.1 * reach)).abs() < 1e-4);
        }
        assert!(Interval::from_cases(&[]).is_empty());
    }

    #[test]
    fn intervals_of_two_cases_reach_over_both() {
        let intervals = Interval::from_cases(&[case(0.7, 2.8, 0.05), case(0.3, 1.6, 0.05)]);
        let [low, high] = intervals[1].gamma1;
        assert!((1.5..1.65).contains(&low) && (2.8..2.95).contains(&high));
        let [low, high] = intervals[0].gamma1;
        assert!(low > 1.6 && high > 2.8, "{low} {high}");
    }
}
