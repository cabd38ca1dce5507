//! Reader of complete EXR files: every part with all of its channels.

use base::error::{Error, Result};
use exr::meta::{Headers, MetaData};
use exr::prelude::{AnyChannels, FlatImage, FlatSamples, Layer, ReadChannels, ReadLayers};
use imaging::file::{MAX_PIXELS, check_openexr};
use std::io::{Cursor, Read, Seek};
use std::path::Path;

/// Most bytes that one byte of a file unpacks to: deflate reaches 1032.
const MOST_PER_BYTE: u64 = 2048;
/// Bytes of a file other than pixels: headers, offset tables, a preview.
const MOST_BESIDE: u64 = 64 << 20;

/// A part of a file.
pub(super) type Part = Layer<AnyChannels<FlatSamples>>;

/// A file in memory, not yet decoded.
pub(super) struct ExrFile {
    pub bytes: Vec<u8>,
    pub parts: Headers,
    /// Bytes of the decoded pixels.
    pub unpacked: u64,
}

impl ExrFile {
    /// Reads a file, unless it claims more pixels than it can hold or is far longer than its header claims.
    ///
    /// # Errors
    /// When the file is refused or cannot be read; `remedy` is part of the message.
    pub fn open(path: &Path, remedy: &str) -> Result<Self> {
        let io = |action, e| Error::io(action, path, e, remedy);
        let wrong = |problem: String| Error::invalid(format!("{}: {problem}", path.display()), remedy);
        let mut file = base::files::open(path).map_err(|e| io("open", e))?;
        let length = (file.metadata().map(|data| data.len())).map_err(|e| io("read", e))?;
        let reader = std::io::BufReader::new(&mut file);
        let parts =
            MetaData::read_from_buffered(reader, false).map_err(|e| Error::codec("read", path, e, remedy))?.headers;
        check_openexr(&parts).map_err(wrong)?;
        let mut unpacked = 0u64;
        for part in &parts {
            let pixels = part.layer_size.0 as u64 * part.layer_size.1 as u64;
            if pixels > MAX_PIXELS as u64 {
                return Err(wrong(format!("it claims {pixels} pixels, but the limit is {MAX_PIXELS}")));
            }
            let bytes = pixels.saturating_mul(part.channels.bytes_per_pixel as u64);
            unpacked = unpacked.saturating_add(bytes);
        }
        if unpacked > length.saturating_mul(MOST_PER_BYTE) {
            return Err(wrong(format!("it claims {unpacked} bytes of pixels in a file of {length} bytes")));
        }
        // Mipmaps take as much again.
        let most = unpacked.saturating_mul(2).saturating_add(MOST_BESIDE);
        if length > most {
            return Err(wrong(format!("it has {length} bytes for {unpacked} bytes of pixels")));
        }
        let mut bytes = Vec::new();
        file.rewind().map_err(|e| io("read", e))?;
        // The file may grow meanwhile.
        file.take(most).read_to_end(&mut bytes).map_err(|e| io("read", e))?;
        Ok(Self { bytes, parts, unpacked })
    }

    /// Decodes all parts.
    ///
    /// # Errors
    /// When the file is damaged or truncated.
    pub fn decode(&self, path: &Path, remedy: &str) -> Result<FlatImage> {
        exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_buffered(Cursor::new(&self.bytes))
            .map_err(|e| Error::codec("read", path, e, remedy))
    }
}
