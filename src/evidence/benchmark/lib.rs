//! Speed of a machine before any project exists: training steps, predictions, passes and pictures of made-up data, each
//! within a share of a few minutes.
//!
//! Each measure runs in its own process: running out of memory or a driver crash ends only that measure, and peak
//! memory belongs to one measure. [`device`] starts the processes and keeps to the time; [`answer`] runs inside them.
//! Figures are reported as soon as they are known, so a measure that is ended early loses only what was not timed yet.

mod budget;
mod child;
mod data;
mod measure;
mod names;
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

/// Lamps in all measures: the number on the paper's stage.
pub const LAMPS: usize = 41;
