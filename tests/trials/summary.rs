//! What many trials say together: errors, and how often the truth lay within what was stated.

use crate::results::Row;

/// An unknown of a trial: how far the result was from the truth, and the stated standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub off: f64,
    pub deviation: f64,
}

/// A result without a deviation, such as a standard curve, states that it is exact. This much is rounding.
const EXACT: f64 = 0.01;
/// Beyond this many stated deviations a result was sure and wrong.
const SURE: f64 = 5.0;

/// Levels at which coverage is judged, with the half width of a normal distribution's interval in deviations.
pub const LEVELS: [(f64, f64); 3] = [(0.50, 0.674_490), (0.90, 1.644_854), (0.99, 2.575_829)];

impl Estimate {
    /// How many stated deviations the truth is away.
    pub fn deviations_off(&self) -> f64 {
        if self.deviation > 0.0 {
            return (self.off / self.deviation).abs();
        }
        if self.off.abs() <= EXACT {
            0.0
        } else {
            f64::INFINITY
        }
    }

    /// Whether the truth is beyond five stated deviations.
    pub fn is_sure_and_wrong(&self) -> bool {
        self.deviations_off() > SURE
    }
}

/// γ1 and γ2 of a trial.
pub fn gammas(row: &Row) -> [Estimate; 2] {
    [
        Estimate {
            off: row.found1 - row.gamma1,
            deviation: row.deviation1,
        },
        Estimate {
            off: row.found2 - row.gamma2,
            deviation: row.deviation2,
        },
    ]
}

/// ln exposure of a trial.
pub fn exposure(row: &Row) -> Estimate {
    Estimate {
        off: (row.found_exposure / row.exposure_change).ln(),
        deviation: row.exposure_deviation,
    }
}

/// Share of the estimates whose truth lies within so many stated deviations.
pub fn coverage(estimates: &[Estimate], deviations: f64) -> f64 {
    let inside = estimates
        .iter()
        .filter(|e| e.deviations_off() <= deviations);
    inside.count() as f64 / estimates.len().max(1) as f64
}

/// The value below which a share of the values lies, from 0 to 1; NaN of none.
pub fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    if values.is_empty() {
        return f64::NAN;
    }
    let place = share * (values.len() - 1) as f64;
    let low = place as usize;
    let high = (low + 1).min(values.len() - 1);
    values[low] + (place - low as f64) * (values[high] - values[low])
}

/// The half width of a normal distribution's interval that holds a share of it, in deviations, by bisection of
/// [`normal_share`].
pub fn normal_deviations(share: f64) -> f64 {
    let (mut low, mut high) = (0.0, 8.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if normal_share(middle) < share {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Share of a normal distribution within so many deviations: erf(x / √2), by Simpson's rule.
fn normal_share(deviations: f64) -> f64 {
    const PARTS: usize = 400;
    let density = |x: f64| (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let step = deviations / PARTS as f64;
    let sum: f64 = (0..=PARTS)
        .map(|i| {
            let weight = match i {
                0 | PARTS => 1.0,
                i if i % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight * density(i as f64 * step)
        })
        .sum();
    2.0 * sum * step / 3.0
}
