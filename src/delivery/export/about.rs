//! Metadata and format of a still.

use super::colors::Encoding;
use super::exr_settings::ExrSettings;
use super::format::Bits;
use super::layers::LightLayers;
use super::time_code::TimeCode;

/// Metadata and format of a still, besides its picture.
#[derive(Clone, Copy, Debug)]
pub struct About<'a> {
    pub time_code: TimeCode,
    /// The clip's, in frames per second.
    pub frame_rate: f64,
    /// Of a PNG.
    pub bits: Bits,
    /// Of an EXR.
    pub exr: ExrSettings,
    pub encoding: &'a Encoding,
    /// The reel of the interview's movie.
    pub reel: Option<&'a str>,
    /// Provenance, for the header or a text chunk.
    pub provenance: Option<&'a str>,
    /// Of an EXR, if it is to have any.
    pub layers: Option<&'a LightLayers>,
}

/// Key of the provenance in a file: a PNG's text chunk, an EXR's attribute.
pub(super) const PROVENANCE: &str = "afterlight";
