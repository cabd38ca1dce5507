//! A picture file that is being read, and its format.

use super::raw::refuse;
use base::error::{Error, Result};
use base::files;
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

pub(super) const REMEDY: &str = "Check that the file is there and is a complete picture";

/// A file that is being read.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub file: BufReader<File>,
}

impl Source<'_> {
    /// Error of a damaged file.
    pub fn broken(&self, cause: impl std::fmt::Display) -> Error {
        broken(self.path, cause)
    }
}

pub(super) fn broken(path: &Path, cause: impl std::fmt::Display) -> Error {
    Error::codec("read", path, cause, REMEDY)
}

/// Formats that are told apart by their first bytes.
pub(super) enum Format {
    Radiance,
    OpenExr,
    /// PNG, JPEG, TIFF and others that the `image` crate reads.
    Coded,
}

/// Opens a picture file and tells its format.
///
/// # Errors
/// When it cannot be read, or is a camera's raw file.
pub(super) fn open(path: &Path) -> Result<(Source<'_>, Format)> {
    let fail = |e: std::io::Error| Error::io("open", path, e, REMEDY);
    let mut file = BufReader::with_capacity(1 << 18, files::open(path).map_err(fail)?);
    let mut head = [0; 32];
    let mut known = 0;
    while known < head.len() {
        match file.read(&mut head[known..]).map_err(fail)? {
            0 => break,
            count => known += count,
        }
    }
    file.rewind().map_err(fail)?;
    refuse(path, &head[..known], &mut file)?;
    file.rewind().map_err(fail)?;
    let format = match &head[..known] {
        [b'#', b'?', ..] => Format::Radiance,
        [0x76, 0x2f, 0x31, 0x01, ..] => Format::OpenExr,
        _ => Format::Coded,
    };
    Ok((Source { path, file }, format))
}
