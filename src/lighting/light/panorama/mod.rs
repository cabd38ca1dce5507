//! Reads panorama files of every kind as environments: once, line by line, at a working size.
//!
//! A Radiance or OpenEXR panorama of 16384 × 8192 texels is 1.6 GB of light. It is averaged by solid angle while it
//! is read, which keeps its energy and needs only a few hundred megabytes. What was guessed, repaired, clipped or
//! left out is reported in sentences.

mod canvas;
mod encoded;
mod openexr;
mod radiance_hdr;
mod reader;
#[cfg(test)]
mod tests;

use crate::environment::Environment;
use base::error::{Error, Result};
use base::files;
use reader::{COMPLETE, PanoramaReader};
pub use reader::{Panorama, ReadSettings};
use std::io::{BufReader, Read, Seek};
use std::path::Path;

/// Reads a panorama: Radiance HDR (RGBE or XYZE, any orientation), OpenEXR (any flat layer of RGB or grey), or PNG,
/// JPEG and TIFF, which are linearised from sRGB. The content decides the format, not the file's name.
///
/// # Errors
/// When the file cannot be read, has an unknown format, or is a square or has a shape that the wanted mapping
/// cannot have.
pub fn read(path: &Path, settings: &ReadSettings) -> Result<Panorama> {
    let fail = |e: std::io::Error| Error::io("read", path, e, COMPLETE);
    let mut file = BufReader::with_capacity(1 << 18, files::open(path).map_err(fail)?);
    let mut magic = [0; 4];
    let known = file.read(&mut magic).map_err(fail)?;
    file.rewind().map_err(fail)?;
    let mut panorama = PanoramaReader::new(path, settings);
    let canvas = match &magic[..known] {
        [b'#', b'?', ..] => radiance_hdr::read(&mut panorama, file)?,
        [0x76, 0x2f, 0x31, 0x01] => openexr::read(&mut panorama, file)?,
        _ => encoded::read(&mut panorama, file)?,
    };
    panorama.finish(canvas)
}

/// The environment in a panorama file, read as [`read`] does by default.
///
/// # Errors
/// As [`read`].
pub fn load(path: &Path) -> Result<Environment> {
    Ok(read(path, &ReadSettings::default())?.environment)
}
