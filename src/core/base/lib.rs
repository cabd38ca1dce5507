//! Foundations of every other crate: errors as sentences, files written completely or not at all, progress, turns
//! at the device, the machine and the process's memory.

pub mod error;
pub mod files;
pub mod machine;
pub mod memory;
pub mod numbers;
pub mod progress;
pub mod turn;

pub use error::{Error, Result};
pub use numbers::numbers;
