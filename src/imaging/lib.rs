//! Pixels without a domain: rasters, colour, resampling and picture files.

pub mod color;
mod curve;
pub mod file;
mod raster;
pub mod resample;
mod response;

pub use curve::Response;
pub use raster::{Encoded, Image, Mask, Raster};
pub use response::DualGamma;
