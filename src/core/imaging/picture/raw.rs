//! Camera raw files: refused, since their only finished picture is a small preview.

use base::FileFormat;
use base::error::{Error, Result};
use std::io::{BufRead, Seek};
use std::path::Path;
use tiff::decoder::Decoder;
use tiff::tags::Tag;

/// Refuses a camera's raw file, by its content or the ending of its name.
///
/// # Errors
/// Then.
pub(super) fn refuse(path: &Path, head: &[u8], file: &mut (impl BufRead + Seek)) -> Result<()> {
    let is_raw = FileFormat::from_path(path) == Some(FileFormat::RawStill)
        || head.starts_with(b"FUJIFILMCCD-RAW")
        || head.get(4..12) == Some(b"ftypcrx ")
        || head.get(8..10) == Some(b"CR") && is_tiff(head)
        || is_tiff(head) && has_sensor_data(file);
    if !is_raw {
        return Ok(());
    }
    Err(Error::invalid(
        format!("{} is a camera raw file, which holds sensor data and a small preview", path.display()),
        "Develop all pictures of the shoot alike, as 16-bit TIFF or linear EXR, with RawTherapee, darktable or the \
         maker's program, then use those",
    ))
}

pub(super) fn is_tiff(head: &[u8]) -> bool {
    matches!(head.get(..4), Some(b"II*\0" | b"MM\0*" | b"II+\0" | b"MM\0+"))
}

/// True for a DNG, or for a TIFF whose first picture is the preview of another one within it.
fn has_sensor_data(file: &mut (impl BufRead + Seek)) -> bool {
    const DNG_VERSION: Tag = Tag::Unknown(50706);
    let Ok(mut decoder) = Decoder::new(file) else { return false };
    let is_dng = decoder.find_tag(DNG_VERSION).is_ok_and(|tag| tag.is_some());
    let is_preview =
        decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType).is_ok_and(|kind| kind.is_some_and(|kind| kind & 1 == 1));
    is_dng || is_preview && decoder.find_tag(Tag::SubIfd).is_ok_and(|tag| tag.is_some())
}
