//! Evaluation: how near predicted pictures are to the truth, beside methods that need no network.

mod accuracy;
mod filter;
pub mod flip;
mod measure;
pub mod metrics;
pub mod review;
mod shown;
mod ssim;
mod table;
mod truth;
#[cfg(test)]
mod weights_tests;

pub use accuracy::{Method, Scores, excluded_check, score, score_under};
pub use flip::{FlipMap, flip};
pub use measure::{EvaluateReport, EvaluateSettings, evaluate};
pub use shown::{shown, shown_gain};
pub use ssim::ssim;
pub use table::{Row, markdown};
pub use truth::Truth;
