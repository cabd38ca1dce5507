//! How far predictions can be trusted where there is no truth.
//!
//! Two questions are answered. Which frames look unlike every pose that was photographed? The network's own encoder says how
//! far apart pictures are, and the distance of each pose to the others says how far is far ([`Poses`]). And how large is the
//! error? A network for each pose, trained without it, is compared with that pose's photographs, and what it was off by is
//! laid over distance and over what the network still changed ([`Relation`]). `docs/method.md` has the reasons and what was measured.

mod cells;
mod earlier;
mod folds;
mod lamps;
mod poses;
mod relation;
mod report;
mod run;
#[cfg(test)]
mod tests;

pub use cells::{Cells, SIDE};
pub use lamps::{LampErrors, LampShares};
pub use poses::{Nearest, Poses};
pub use relation::{PoseErrors, Relation, Sign};
pub use report::{ConfidenceReport, Expected, FrameConfidence, Judged, Quarter, SAID_SHARE};
pub use run::{ConfidenceSettings, confidence};
