//! Training the network on a project's exemplars and interview frames (the paper's sections 3.3 and 4).

mod adam;
mod augment;
mod average;
pub mod config;
mod cost;
mod data;
pub mod features;
#[cfg(test)]
mod full_disk_tests;
mod gradient;
#[cfg(test)]
mod gradient_tests;
pub mod history;
mod judge;
pub mod kept;
mod log;
pub mod loss;
#[cfg(test)]
mod nan_tests;
#[cfg(test)]
mod parity_tests;
mod records;
mod run;
pub mod schedule;
mod trainer;
mod watch;

pub use adam::Adam;
pub use config::{Preset, TrainingConfig};
pub use cost::{Pace, RunCost};
pub use history::History;
pub use records::Records;
pub use run::train;
pub use trainer::{TrainReport, TrainSettings, Trainer};
