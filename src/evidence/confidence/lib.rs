//! Confidence in predictions without a truth.
//!
//! The exemplars answer two questions. Which frames are unlike every pose? A frame's distance is the light that the
//! best exemplar leaves unexplained; the scale comes from carrying each pose over from the others. And how large is the
//! error? Each pose is predicted from the others and compared with its photographs; its error is fitted to the
//! unexplained light and to the spread of the exemplars ([`Relation`]). `docs/method.md` has the formulas and figures.

mod cells;
mod lamps;
mod missing;
mod poses;
mod relation;
mod report;
mod run;
#[cfg(test)]
mod tests;

pub use cells::SIDE;
pub use lamps::{LampErrors, LampShares};
pub use relation::{PoseErrors, Relation, Sign};
pub use report::{ConfidenceReport, Expected, FrameConfidence, Judged, Quarter, SAID_SHARE, mark};
pub use run::{ConfidenceSettings, confidence, estimate};
