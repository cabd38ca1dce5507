//! Foundations of every other crate: errors as sentences, files written completely or not at all, progress, turns
//! at the device, the machine and the process's memory.

pub mod error;
mod file_format;
pub mod files;
mod fnv;
pub mod machine;
pub mod median;
pub mod memory;
pub mod numbers;
pub mod progress;
pub mod shell;
pub mod turn;

pub use error::{Error, Result};
pub use file_format::{FileFormat, has_extension};
pub use fnv::Fnv;
pub use numbers::numbers;
