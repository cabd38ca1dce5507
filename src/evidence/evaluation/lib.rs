//! Evaluation: how close predicted pictures come to the truth, compared with methods without a network.

mod accuracy;
pub mod blind;
mod comparison;
mod display;
mod evaluate;
mod exemplars;
mod fidelity;
mod filter;
pub mod flicker;
pub mod flip;
mod harmonics;
mod learnt;
pub mod metrics;
mod program;
mod regions;
pub mod review;
mod score;
mod shadow_edges;
mod ssim;
mod table;
mod truth;
#[cfg(test)]
mod weights_tests;

pub use accuracy::{Method, Pictures, Predicted, Scores};
pub use comparison::{Comparison, at_plate, at_truths_size, compare};
pub use display::{display_gain, display_picture};
pub use evaluate::{EvaluateReport, EvaluateSettings, evaluate};
pub use fidelity::{Distance, Fidelity, fidelity};
pub use flip::{FlipMap, flip};
pub use learnt::Learnt;
pub use program::{build, build_of};
pub use regions::{Region, RegionScore};
pub use score::{excluded_check, score, score_under, truth_weights};
pub use shadow_edges::ShadowEdges;
pub use ssim::ssim;
pub use table::{Row, markdown};
pub use truth::Truth;
