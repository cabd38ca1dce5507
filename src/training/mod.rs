//! Training the network on a project's exemplars and interview frames (the paper's sections 3.3 and 4).

mod adam;
mod augment;
mod average;
pub mod config;
mod data;
pub mod features;
mod gradient;
#[cfg(test)]
mod gradient_tests;
mod judge;
pub mod loss;
#[cfg(test)]
mod parity_tests;
mod run;
pub mod schedule;
mod trainer;

pub use adam::Adam;
pub use config::{Preset, TrainingConfig};
pub use run::train;
pub use trainer::{TrainReport, TrainSettings, Trainer};
