//! Other methods of relighting, to compare the network with: learnt on the same exemplars, at the same size, with the
//! same kernels, in the same time.
//!
//! [`PatchStyle`] is few-shot patch-based training (Texler et al., "Interactive video stylization using few-shot
//! patch-based training", SIGGRAPH 2020), [`Portrait`] is single image portrait relighting (Sun et al., SIGGRAPH 2019): the
//! two that the paper compares itself with. Both are as published where that is to their advantage, and
//! `docs/method.md` lists what differs.

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
