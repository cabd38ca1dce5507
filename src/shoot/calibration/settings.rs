//! The settings of a calibration.

use super::gamma::Comparison;
use super::silhouette::Circle;
use super::trial::Trial;

/// Calibration settings of a project. `None` means automatic.
#[derive(Clone, Copy, Debug, Default, PartialEq, clap::Args)]
pub struct CalibrateSettings {
    /// Centre and radius of the ball in pixels of its photographs, instead of the project's.
    #[arg(long, value_name = "X,Y,RADIUS", conflicts_with = "find_circle")]
    pub circle: Option<Circle>,
    /// Detect the ball in its photographs instead of using the project's circle.
    #[arg(long = "find-ball")]
    pub find_circle: bool,
    /// Comparison of exemplars and interview [default: by pixels if a frame shows a pose].
    #[arg(long, value_enum)]
    pub comparison: Option<Comparison>,
    /// Camera response (one or two exponents, srgb, rec709, linear, or log,K) and interview exposure, instead of fitting
    /// them.
    #[arg(long = "gamma", value_name = "RESPONSE[,EXPOSURE]", conflicts_with = "comparison")]
    pub trial: Option<Trial>,
    /// Skip motion compensation between OLATs, which takes a second or two for each pose.
    #[arg(long)]
    pub keep_motion: bool,
}
