//! One reading of a picture file, by its content: how it is turned, its colour, its coverage, and how each is known.
//!
//! [`stream`] passes light on line by line: a panorama of 16384 × 8192 is 1.6 GB of it. [`read`] keeps a whole picture,
//! codes as codes.

mod coded;
mod decoded;
mod exif;
mod mended;
mod openexr;
mod profile;
mod properties;
mod radiance;
mod raw;
mod source;
mod tiff;
mod whole;

pub use openexr::choose_layer;
pub use properties::{About, Coding, Origin, Sink};
pub use whole::Picture;

use base::error::Result;
use source::{Format, broken, open};
use std::path::Path;
use whole::Whole;

/// Passes a picture's light to `sink`, in any order.
///
/// # Errors
/// When the file cannot be read, is a camera's raw file, or has no colour or grey; and those of `sink`.
pub fn stream(path: &Path, sink: &mut dyn Sink) -> Result<()> {
    let (source, format) = open(path)?;
    match format {
        Format::Radiance => radiance::stream(source, sink),
        Format::OpenExr => openexr::stream(source, sink),
        Format::Coded => coded::read(source)?.stream(sink),
    }
}

/// Properties of a picture, without decoding pixels where the format allows.
///
/// # Errors
/// As [`stream`].
pub fn about(path: &Path) -> Result<About> {
    /// Ends the reading before the pixels.
    struct Header(Option<About>);
    impl Sink for Header {
        fn begin(&mut self, about: &About) -> Result<bool> {
            self.0 = Some(about.clone());
            Ok(false)
        }
        fn run(&mut self, _: usize, _: usize, _: &[[f32; 3]], _: &[f32]) {}
    }
    let (source, format) = open(path)?;
    let mut header = Header(None);
    match format {
        Format::Radiance => radiance::stream(source, &mut header)?,
        Format::OpenExr => openexr::stream(source, &mut header)?,
        Format::Coded => return coded::about(source),
    }
    header.0.ok_or_else(|| broken(path, "it has no header"))
}

/// Columns and rows as [`read`] gives them.
///
/// # Errors
/// As [`stream`].
pub fn dimensions(path: &Path) -> Result<(usize, usize)> {
    let (source, format) = open(path)?;
    match format {
        Format::Coded => coded::dimensions(source),
        _ => Ok(about(path)?.size),
    }
}

/// Names of a file's layers with colours, the finished picture first; empty unless there are several.
///
/// # Errors
/// When the file cannot be read.
pub fn layers(path: &Path) -> Result<Vec<String>> {
    match open(path)? {
        (source, Format::OpenExr) => openexr::layers(source),
        _ => Ok(Vec::new()),
    }
}

/// Reads a whole picture.
///
/// # Errors
/// As [`stream`], and when it has more than [`crate::file::MAX_PIXELS`].
pub fn read(path: &Path) -> Result<Picture> {
    let (source, format) = open(path)?;
    let mut whole = Whole { path, picture: None };
    match format {
        Format::Radiance => radiance::stream(source, &mut whole)?,
        Format::OpenExr => openexr::stream(source, &mut whole)?,
        Format::Coded => return coded::read(source),
    }
    whole.picture.ok_or_else(|| broken(path, "it ends before its pixels"))
}
