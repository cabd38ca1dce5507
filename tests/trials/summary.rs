//! Summary of many trials: errors, and coverage of the stated intervals.

use crate::results::Row;

/// An unknown of a trial: error of the estimate, stated standard deviation, and smallest stated interval that holds the
/// truth, as in [`Row::within1`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub off: f64,
    pub deviation: f64,
    pub within: f64,
}

/// Rounding tolerance of a result without a deviation, such as a standard curve, which claims to be exact.
const EXACT: f64 = 0.01;
/// Stated deviations beyond which a result was confident and wrong.
const SURE: f64 = 5.0;

/// Intervals stated by a calibration.
pub const LEVELS: [f64; 3] = [0.5, 0.9, 0.99];

impl Estimate {
    /// Error in stated deviations.
    pub fn deviations_off(&self) -> f64 {
        if self.deviation > 0.0 {
            return (self.off / self.deviation).abs();
        }
        if self.off.abs() <= EXACT { 0.0 } else { f64::INFINITY }
    }

    /// True if the truth is beyond five stated deviations.
    pub fn is_sure_and_wrong(&self) -> bool {
        self.deviations_off() > SURE
    }
}

/// γ1 and γ2 of a trial.
pub fn gammas(row: &Row) -> [Estimate; 2] {
    [
        Estimate { off: row.found1 - row.gamma1, deviation: row.deviation1, within: row.within1 },
        Estimate { off: row.found2 - row.gamma2, deviation: row.deviation2, within: row.within2 },
    ]
}

/// ln exposure of a trial.
pub fn exposure(row: &Row) -> Estimate {
    Estimate {
        off: (row.found_exposure / row.exposure_change).ln(),
        deviation: row.exposure_deviation,
        within: row.within_exposure,
    }
}

/// Share of the estimates with intervals whose truth lies within that of `level`, one of [`LEVELS`]; NaN without any.
pub fn coverage(estimates: &[Estimate], level: f64) -> f64 {
    let stated: Vec<f64> = (estimates.iter().map(|e| e.within)).filter(|w| *w > 0.0).collect();
    stated.iter().filter(|within| **within <= level).count() as f64 / stated.len() as f64
}

/// Quantile of the values, for a share from 0 to 1; NaN without values.
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
