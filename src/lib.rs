//! Afterlight relights filmed interviews after filming.
//!
//! A person was filmed in one flat light, and photographed in a few poses under each lamp of a light
//! stage, one lamp at a time. From these the library calibrates the lamps and the camera's response
//! ([`calibration`]), trains a network that predicts every lamp's picture for every frame of the
//! interview ([`training`], [`reflectance`]), sums those pictures under any environment ([`light`],
//! [`compositor`]) and writes the clip ([`export`]). `docs/architecture.md` is the map.

pub mod calibration;
pub mod cli;
pub mod compositor;
pub mod demo;
pub mod error;
pub mod evaluation;
pub mod export;
pub mod footage;
pub mod gpu;
pub mod imaging;
pub mod light;
pub mod memory;
pub mod progress;
pub mod project;
pub mod reflectance;
pub mod scene;
#[cfg(test)]
mod small_disk;
pub mod studio;
pub mod training;
pub mod turn;
pub mod virtual_stage;
pub mod worker;

pub use error::{Error, Result};
