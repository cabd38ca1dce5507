//! Pixels without a domain: rasters, colour, resampling and picture files.

pub mod color;
pub mod file;
mod raster;
pub mod resample;
mod response;

pub use raster::{Encoded, Image, Mask, Raster};
pub use response::DualGamma;
