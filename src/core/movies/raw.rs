//! Cameras' raw movies: refused, with the program that reads them.

use base::error::{Error, Result};
use std::io::Read;
use std::path::Path;

const RED: &str = "REDCINE-X PRO";
const BLACKMAGIC: &str = "DaVinci Resolve or Blackmagic RAW Player";
const ARRI: &str = "the ARRI Reference Tool";

/// The program that reads a camera's raw files, chosen by their extension; `None` for other files.
pub(crate) fn raw_program(path: &Path) -> Option<&'static str> {
    let extension = path.extension().unwrap_or_default();
    Some(match &*extension.to_string_lossy().to_lowercase() {
        "r3d" => RED,
        "braw" => BLACKMAGIC,
        "ari" | "arx" => ARRI,
        "crm" => "Canon Cinema RAW Development",
        "dng" => "DaVinci Resolve",
        _ => return None,
    })
}

/// Error for a camera's raw movie, which cannot be read, with the remedy.
pub(crate) fn raw(path: &Path, program: &str) -> Error {
    Error::invalid(
        format!("{} is a camera raw movie, readable only by the maker's programs", path.display()),
        format!("Transcode it with {program} to ProRes 4444 or to a sequence of 16-bit TIFF or DPX, then import that"),
    )
}

/// Rejects raw files, which only their makers' programs read, by extension or first bytes.
pub(crate) fn refuse_raw(path: &Path) -> Result<()> {
    let mut head = [0; 8];
    let file = base::files::open(path)
        .map_err(|e| Error::io("open", path, e, "Check that the movie is there and can be read"))?;
    // Shorter files are not raw files.
    let _ = { file }.read_exact(&mut head);
    let program = match (&head[..4], &head[4..]) {
        (_, b"RED1" | b"RED2") => Some(RED),
        (b"ARRI", _) => Some(ARRI),
        _ => raw_program(path),
    };
    program.map_or(Ok(()), |program| Err(raw(path, program)))
}

/// The program that reads a camera's raw movie, by a codec tag unknown to ffmpeg; `None` for other tags.
pub(crate) fn raw_tag(tag: &str) -> Option<&'static str> {
    match tag {
        "aprn" | "aprh" => Some("Final Cut Pro or Compressor"),
        // Blackmagic RAW has one tag per compression, such as brxq.
        _ => tag.starts_with("br").then_some(BLACKMAGIC),
    }
}
