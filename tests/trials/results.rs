//! Result of one trial.

use crate::motion::MotionColumns;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Value for a truth outside all stated intervals.
pub const OUTSIDE: f64 = 1.0;

/// A shoot and the result of its calibration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Row {
    pub seed: u64,
    pub size: usize,
    pub lamps: usize,
    /// Kinds of the interview's light and of the camera's response.
    pub light: String,
    pub response: String,
    pub ambient: f64,
    /// Share of the interview's light that no sum of the lamps can reproduce.
    pub off_span: f64,
    pub exposure_change: f64,
    pub ball_exposure: f64,
    pub dust: f64,
    pub room: f64,
    pub sway: f64,
    pub skin: f64,
    /// True value, estimate and stated standard deviation.
    pub gamma1: f64,
    pub gamma2: f64,
    pub found1: f64,
    pub found2: f64,
    pub deviation1: f64,
    pub deviation2: f64,
    pub found_exposure: f64,
    /// Deviation of ln exposure.
    pub exposure_deviation: f64,
    /// Smallest of the stated intervals of 0.5, 0.9 and 0.99 that holds the truth; [`OUTSIDE`] if none does, and 0
    /// without intervals, because a standard curve was found.
    pub within1: f64,
    pub within2: f64,
    pub within_exposure: f64,
    /// Stated probability that the exposure was changed.
    pub said_changed: f64,
    /// Difference of the interview's weights, summed over lamps and relative to their sum.
    pub weights_error: f64,
    /// Relative root mean square difference between the subject's pictures under the estimated and the true light, with
    /// true OLATs; 0 is possible only for light that is a sum of the lamps.
    pub light_error: f64,
    /// Error of the lamps' directions in degrees: the median over lamps that the ball shows, the worst with a
    /// confidence above one half, and the number of those that are off by more than five degrees.
    pub direction_median: f64,
    pub direction_worst: f64,
    pub misled: usize,
    #[serde(flatten)]
    pub motion: MotionColumns,
    /// Seconds for the shoot and for its calibration.
    pub shoot_seconds: f64,
    pub seconds: f64,
    /// Reason for a missing calibration, otherwise empty.
    pub refused: String,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if !self.refused.is_empty() {
            return write!(f, "seed {}: refused: {}", self.seed, self.refused);
        }
        write!(
            f,
            "seed {:3}: {:9} {:6}  γ {:.2} {:.2}, found {:.2} ± {:.2} {:.2} ± {:.2}; exposure {:.2}, found {:.2} ± {:.2}; \
             light off by {:.1} % ({:.1} % off the span); lamps {:.1}°; {:.0} + {:.0} s",
            self.seed,
            self.light,
            self.response,
            self.gamma1,
            self.gamma2,
            self.found1,
            self.deviation1,
            self.found2,
            self.deviation2,
            self.exposure_change,
            self.found_exposure,
            self.exposure_deviation,
            100.0 * self.light_error,
            100.0 * self.off_span,
            self.direction_median,
            self.shoot_seconds,
            self.seconds
        )
    }
}
