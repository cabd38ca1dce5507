//! Training the network on a project's exemplars and interview frames (the paper's sections 3.3 and 4).

mod adam;
pub mod augment;
mod average;
pub mod checkpoints;
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
mod log;
pub mod loss;
mod monitor;
#[cfg(test)]
mod nan_tests;
mod pace;
#[cfg(test)]
mod parity_tests;
mod pose_prediction;
mod records;
mod report;
mod run;
pub mod schedule;
mod trainer;

pub use adam::Adam;
pub use average::blend;
pub use config::{Preset, TrainSettings, TrainingConfig};
pub use cost::{DiskCost, Pace, RunCost};
pub use gradient::clip;
pub use history::History;
pub use pace::steps_ms;
pub use records::Records;
pub use report::{Prediction, TrainReport};
pub use run::train;
pub use trainer::Trainer;
