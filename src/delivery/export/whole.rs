//! Check that a still can be read to its end.

use super::rebuild::rebuilt;
use base::FileFormat;
use base::error::{Error, Result};
use base::files::open;
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers};
use imaging::file::check_openexr;
use std::io::BufReader;
use std::path::Path;

const REMEDY: &str = "Write this frame again";

/// Decodes all of a still: a header may be intact while pixels are missing.
///
/// # Errors
/// When the file is missing or damaged.
pub(super) fn check_whole(path: &Path) -> Result<()> {
    let file = || open(path).map(BufReader::new).map_err(|e| Error::io("open", path, e, REMEDY));
    let broken = |cause: String| Error::codec("read", path, cause, REMEDY);
    match FileFormat::from_path(path) {
        Some(FileFormat::OpenExr) => {
            let parts = MetaData::read_from_buffered(file()?, false).map_err(|e| broken(e.to_string()))?.headers;
            check_openexr(&parts).map_err(broken)?;
            let reader = exr::prelude::read().no_deep_data().largest_resolution_level();
            let read = reader.all_channels().all_layers().all_attributes();
            read.from_buffered(file()?).map(drop).map_err(|e| broken(e.to_string()))
        }
        Some(FileFormat::Tiff) => {
            let decoded = tiff::decoder::Decoder::new(file()?).and_then(|mut decoder| decoder.read_image());
            decoded.map(drop).map_err(|e| broken(e.to_string()))
        }
        _ => read_png(path).map(drop),
    }
}

/// True if a frame can be read to its end, with its light layers if required; these may be separate files.
pub(super) fn is_whole(file: &Path, has_layers: bool) -> bool {
    check_whole(file).is_ok() && (!has_layers || rebuilt(file).is_ok())
}

/// Samples of a PNG as stored, and its header. The checksum of each chunk is checked.
///
/// # Errors
/// When the file is missing or damaged.
pub(super) fn read_png(path: &Path) -> Result<(Vec<u8>, png::OutputInfo)> {
    let broken = |e: png::DecodingError| Error::codec("read", path, e, REMEDY);
    let file = open(path).map_err(|e| Error::io("open", path, e, REMEDY))?;
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().map_err(broken)?;
    let size = reader.output_buffer_size().ok_or_else(|| Error::codec("read", path, "it is too large", REMEDY))?;
    let mut samples = vec![0; size];
    let info = reader.next_frame(&mut samples).map_err(broken)?;
    reader.finish().map_err(broken)?;
    samples.truncate(info.buffer_size());
    Ok((samples, info))
}
