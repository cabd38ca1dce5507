//! Speed of a machine before a project is there: training steps, predictions, passes and pictures of made-up data, each
//! within a part of a few minutes.
//!
//! Each measure runs in a process of its own, so that memory that runs out or a driver that fails ends that measure
//! alone, and peak memory belongs to one. [`device`] starts them and keeps to the time; [`answer`] is what they do. They
//! say each figure as soon as it is known, so that one that is ended too early loses only what it had not timed yet.

mod budget;
mod child;
mod data;
mod measure;
mod network;
pub mod passes;
mod pictures;
mod plan;
mod process;
mod report;
mod rows;
mod run;
mod table;
#[cfg(test)]
mod tests;

pub use budget::{Budget, Spread};
pub use child::{REQUEST, answer};
pub use measure::{Figure, Measure, Request};
pub use report::{DeviceReport, MachineReport, Row};
pub use run::{DeviceSettings, device};

/// Lamps of what is measured: those of the paper's stage.
pub const LAMPS: usize = 41;
