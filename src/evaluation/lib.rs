//! Evaluation: how close predicted pictures come to the truth, compared with methods without a network.

mod accuracy;
mod display;
mod evaluate;
mod filter;
pub mod flip;
pub mod metrics;
pub mod review;
mod ssim;
mod table;
mod truth;
#[cfg(test)]
mod weights_tests;

pub use accuracy::{Method, Scores, excluded_check, score, score_under};
pub use display::{display_gain, display_picture};
pub use evaluate::{EvaluateReport, EvaluateSettings, evaluate};
pub use flip::{FlipMap, flip};
pub use ssim::ssim;
pub use table::{Row, markdown};
pub use truth::Truth;
