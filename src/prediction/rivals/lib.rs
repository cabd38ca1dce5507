//! Rival relighting methods, for comparison with the network: trained on the same exemplars, at the same size, with the
//! same kernels, in the same time.
//!
//! [`PatchStyle`] is few-shot patch-based training (Texler et al., "Interactive video stylization using few-shot
//! patch-based training", SIGGRAPH 2020), [`Portrait`] is single image portrait relighting (Sun et al., SIGGRAPH 2019): the
//! two comparisons of the paper. Both follow their publications wherever that is to their advantage;
//! `docs/method.md` lists the differences.

mod guide;
mod learner;
mod lights;
mod patch_network;
mod patches;
mod portrait;
mod portrait_network;
mod poses;
mod quiet;
#[cfg(test)]
mod tests;

pub use learner::{Effort, Spent};
pub use patches::PatchStyle;
pub use portrait::Portrait;
pub use poses::Poses;
