//! Helpers for the tests of all crates.

pub mod accident;
mod folder;
mod need;
mod paths;
mod programs;
mod slurm;
pub mod small_disk;
pub mod stability;
mod waiting;

pub use folder::{copy_folder, files};
pub use need::{Need, found, require};
pub use paths::{repository, shared};
pub use programs::{blender, ffmpeg, mediapipe, openjd, pfspanoramic, python};
pub use slurm::Slurm;
pub use waiting::{PATIENCE, wait_for};
