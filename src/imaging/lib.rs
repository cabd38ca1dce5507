//! Pixels without a domain: rasters, colour, resampling and picture files.

pub mod color;
mod dual_gamma;
pub mod file;
mod raster;
pub mod resample;
mod response;

pub use dual_gamma::DualGamma;
pub use raster::{Encoded, Image, Mask, Raster};
pub use response::Response;
