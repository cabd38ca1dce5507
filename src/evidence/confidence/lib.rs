//! Trust in predictions without a truth.
//!
//! The exemplars say it themselves. Which frames are unlike every pose? The light that the best exemplar leaves unexplained
//! says how far a frame is; that of each pose carried over from the others says how far is far. And how large is the error?
//! Each pose is predicted from the others and compared with its photographs; its error is laid over what is left unexplained
//! and over the spread of the exemplars ([`Relation`]). `docs/method.md` has the formulas and the figures.

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
pub use run::{ConfidenceSettings, confidence};
