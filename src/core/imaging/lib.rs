//! Pictures without a subject: rasters, colour, resampling, picture files and camera responses.

pub mod color;
pub mod color_space;
mod cube;
mod display_table;
mod dual_gamma;
pub mod file;
mod limits;
pub mod picture;
mod raster;
pub mod resample;
mod response;

pub use cube::Cube;
pub use display_table::DisplayTable;
pub use dual_gamma::DualGamma;
pub use raster::{Encoded, Image, Mask, Raster};
pub use response::Response;
