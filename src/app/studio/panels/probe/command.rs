//! Commands for the calibration.

/// Calibrates, by hand or by a fit.
#[derive(Clone, Debug, PartialEq)]
pub enum CalibrationCommand {
    /// Use the outline detected in the photographs.
    FindCircle,
    /// Move the outline and enlarge its radius, in pixels of the photograph.
    NudgeCircle { by: [f64; 2], radius: f64 },
    /// Change the trial response by these differences of γ1, γ2 and the exposure.
    NudgeTrial([f32; 3]),
    /// Calibrate with the values set by hand; the rest is fitted.
    Start,
}
