//! Reader for panorama files of every kind: one pass, line by line, at a working size.
//!
//! A Radiance or OpenEXR panorama of 16384 × 8192 texels is 1.6 GB. It is averaged by solid angle while it is read,
//! which preserves energy and needs only a few hundred megabytes. Notes report every guess, repair, clipping and
//! omission.

mod canvas;
mod reader;
#[cfg(test)]
mod tests;

use crate::environment::Environment;
use base::error::Result;
use reader::PanoramaReader;
pub use reader::{Panorama, ReadSettings};
use std::path::Path;

/// Reads a panorama of any format that [`imaging::picture`] reads. The content decides the format, not the file's name;
/// PNG, JPEG and TIFF codes without a named curve are linearised from sRGB.
///
/// # Errors
/// When the file cannot be read, has an unknown format, is a square of unknown mapping, or has a shape that the
/// given mapping does not allow.
pub fn read(path: &Path, settings: &ReadSettings) -> Result<Panorama> {
    let mut panorama = PanoramaReader::new(path, settings);
    imaging::picture::stream(path, &mut panorama)?;
    panorama.finish()
}

/// Reads the environment of a panorama file with default settings.
///
/// # Errors
/// As [`read`].
pub fn load(path: &Path) -> Result<Environment> {
    Ok(read(path, &ReadSettings::default())?.environment)
}
