//! Certificate of a shot for delivery: all frames are present, intact and consistent, each with its checksum.

mod faults;
mod frame;
mod read;
mod shot;
mod time;
mod verify;

pub use shot::names_frames;
pub use verify::Verification;

use self::faults::{Findings, judge, rate_words, span};
pub use self::frame::hash_file;
use self::frame::{Content, Frame, hex};
use self::shot::Shot;
use base::error::{Error, Result};
use base::files::{read_text, write_beside};
use base::progress::Progress;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Version of the certificates that this program writes and reads.
const FORMAT: u32 = 1;
/// Longest certificate that is read, in bytes: a million frames, each with some accompanying files.
const MOST_BYTES: u64 = 1 << 30;

/// Delivery requirements of a shot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CertifySettings {
    /// First and last required frame. None for the frames found.
    pub frames: Option<(i64, i64)>,
    /// Frames per second. None for the rate in the headers.
    pub rate: Option<f64>,
    /// Allows equal pictures in neighbouring frames.
    pub allow_repeats: bool,
}

/// Fault of a shot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// Kind, such as `missing` or `time_code`.
    pub kind: String,
    /// Frame numbers, such as `3, 7-9`, or `-2 to 3` below 0.
    pub frames: String,
    pub sentence: String,
}

/// Point that was not checked, or that may be intended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Remark {
    pub kind: String,
    pub sentence: String,
}

/// A file and its checksum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileHash {
    pub name: String,
    pub bytes: u64,
    /// SHA-256 of the whole file in hexadecimal digits; "" if the file could not be read.
    pub sha256: String,
}

/// A frame's file in a certificate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CertifiedFrame {
    pub frame: i64,
    #[serde(flatten)]
    pub file: FileHash,
    /// SHA-256 of the samples of all channels, independent of the compression; "" if the file could not be read.
    pub pixels_sha256: String,
    /// Largest difference between the picture and the sum of its light layers. None without light layers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual: Option<f32>,
    /// Files of the light layers and of their weights.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub beside: Vec<FileHash>,
}

/// Accuracy with which the light layers of a shot rebuild its pictures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CertifiedLayers {
    /// Number of layers per frame.
    pub layers: usize,
    /// Largest difference of a channel, and the frame with it.
    pub residual: f32,
    pub frame: i64,
    /// Brightest light of that frame.
    pub brightest: f32,
}

/// Certificate of a shot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Version of this file format.
    pub certificate: u32,
    /// Program that wrote the certificate.
    pub written_by: String,
    /// The shot has no faults.
    pub passed: bool,
    /// Summary in one line.
    pub sentence: String,
    pub faults: Vec<Fault>,
    pub remarks: Vec<Remark>,
    /// Folder of the frames: relative to the certificate's folder, or absolute.
    pub folder: PathBuf,
    /// File names, with `####` for the number.
    pub shot: String,
    /// First and last frame.
    pub frames: [i64; 2],
    /// Columns and rows, from the headers of most frames.
    pub size: Option<[i64; 2]>,
    pub rate: Option<(i32, u32)>,
    /// Time codes of the first and the last frame.
    pub time_code: Option<[String; 2]>,
    pub color: Option<String>,
    pub layers: Option<CertifiedLayers>,
    /// Provenance of the first frame, without the entries that change per frame.
    pub made_of: BTreeMap<String, String>,
    /// SHA-256 of the lines `HASH  NAME` of all files, as `sha256sum` writes them.
    pub sha256: String,
    pub files: Vec<CertifiedFrame>,
}

impl Certificate {
    /// Examines all files of a shot. `named` is a list of files, their folder, or a pattern. Faults of the shot are part of the
    /// certificate.
    ///
    /// # Errors
    /// When no such files exist, they belong to several shots, or the user stops.
    pub fn issue(
        named: &[PathBuf],
        settings: &CertifySettings,
        progress: &Progress,
    ) -> Result<Self> {
        let shot = Shot::find(named)?;
        let frames = read::frames(&shot, progress)?;
        let mut found = judge(&frames, shot.numbered, settings);
        if !shot.unfinished.is_empty() {
            found.fault(
                "unfinished",
                [],
                format!("an export is writing here or was killed: {}", shot.unfinished.join(", ")),
            );
        }
        Ok(Self::new(&shot, &frames, found))
    }

    fn new(shot: &Shot, frames: &[Frame], found: Findings) -> Self {
        let whole: Vec<(i64, &Content)> = (frames.iter())
            .filter_map(|frame| Some((frame.number, frame.picture.as_ref().ok()?)))
            .collect();
        let first = whole.first().map(|(_, content)| *content);
        let code =
            |of: Option<&(i64, &Content)>| of.and_then(|(_, c)| c.time_code).map(time::words);
        let layers = whole.iter().filter_map(|(number, content)| {
            let rebuild = content.layers.as_ref()?.as_ref().ok()?;
            Some(CertifiedLayers {
                layers: rebuild.layers,
                // JSON has no infinity.
                residual: rebuild.residual.min(f32::MAX),
                frame: *number,
                brightest: rebuild.brightest.min(f32::MAX),
            })
        });
        let common = |(key, _): &(&str, &str)| !matches!(*key, "frame" | "plate" | "look");
        let made_of = first.map(|content| {
            let pairs = content.made_of().into_iter().filter(common);
            pairs.map(|(key, value)| (key.to_owned(), value.to_owned())).collect()
        });
        let ends = [frames.first(), frames.last()].map(|f| f.map_or(0, |frame| frame.number));
        let mut certificate = Self {
            certificate: FORMAT,
            written_by: concat!("Afterlight ", env!("CARGO_PKG_VERSION")).to_owned(),
            passed: found.faults.is_empty(),
            sentence: String::new(),
            faults: found.faults,
            remarks: found.remarks,
            folder: shot.folder.clone(),
            shot: shot.pattern.clone(),
            frames: ends,
            size: first.map(|content| [content.display_window[2], content.display_window[3]]),
            rate: first.and_then(|content| content.rate),
            time_code: code(whole.first())
                .zip(code(whole.last()))
                .map(|(first, last)| [first, last]),
            color: first.and_then(|content| content.color.interop_id.clone()),
            layers: layers.max_by(|a, b| a.residual.total_cmp(&b.residual)),
            made_of: made_of.unwrap_or_default(),
            sha256: String::new(),
            files: frames.iter().map(CertifiedFrame::from_frame).collect(),
        };
        certificate.sha256 = certificate.hash();
        certificate.sentence = certificate.words();
        certificate
    }

    /// SHA-256 of the lines `HASH  NAME` of all files.
    fn hash(&self) -> String {
        let mut hash = Sha256::new();
        for FileHash { name, sha256, .. } in self.all_files() {
            hash.update(format!("{sha256}  {name}\n"));
        }
        hex(hash.finalize())
    }

    /// All files; the accompanying files follow their frame.
    fn all_files(&self) -> impl Iterator<Item = &FileHash> {
        (self.files.iter()).flat_map(|frame| [&frame.file].into_iter().chain(&frame.beside))
    }

    /// Summary in one line.
    fn words(&self) -> String {
        let mut parts = vec![match self.files.len() {
            1 => "1 frame".to_owned(),
            count => format!("{count} frames {}", span(self.frames[0], self.frames[1])),
        }];
        parts.extend(self.size.map(|[width, height]| format!("{width} × {height}")));
        parts.extend(self.color.clone());
        parts.extend(self.rate.map(|rate| rate_words(Some(rate))));
        parts.extend(
            (self.time_code.as_ref()).map(|[from, to]| format!("time code {from} to {to}")),
        );
        parts.extend(self.layers.map(|found| {
            format!(
                "{} light layers that rebuild the picture to within {:.1e}",
                found.layers, found.residual
            )
        }));
        let verdict = match self.faults.len() {
            0 => "no faults".to_owned(),
            1 => "1 fault".to_owned(),
            count => format!("{count} faults"),
        };
        format!("{}: {}; {verdict}. SHA-256 {}", self.shot, parts.join(", "), &self.sha256[..16])
    }

    /// Writes the certificate as JSON to `path`. The frames' folder is stored relative to the folder of `path`.
    ///
    /// # Errors
    /// When `path` cannot be written, names a file of the shot, or a path is not UTF-8.
    pub fn write(&mut self, path: &Path) -> Result<()> {
        let whole = |folder: &Path| std::fs::canonicalize(folder).ok();
        let is_there = whole(path).is_some_and(|path| {
            self.all_files()
                .any(|file| whole(&self.folder.join(&file.name)).as_ref() == Some(&path))
        });
        if is_there {
            return Err(Error::invalid(
                format!("{} is a file of the shot", path.display()),
                "Give the certificate another name, such as shot.certificate.json",
            ));
        }
        if let Some(folder) = whole(&self.folder) {
            let own = path.parent().filter(|own| !own.as_os_str().is_empty());
            let own = whole(own.unwrap_or(Path::new(".")));
            let inside = own.and_then(|own| folder.strip_prefix(own).ok().map(PathBuf::from));
            self.folder = match inside {
                Some(inside) if inside.as_os_str().is_empty() => ".".into(),
                Some(inside) => inside,
                None => folder,
            };
        }
        let text = serde_json::to_string_pretty(self).map_err(|e| {
            let problem = format!("cannot write the certificate {}: {e}", path.display());
            Error::invalid(problem, "Rename the folder of the frames")
        })?;
        write_beside(path, |out| writeln!(out, "{text}"))
    }

    /// Reads a certificate.
    ///
    /// # Errors
    /// When the file cannot be read, or is not a certificate of this version.
    pub fn read(path: &Path) -> Result<Self> {
        let remedy = "Name a certificate that `afterlight check FRAMES --certificate FILE` wrote";
        let text = read_text(path, MOST_BYTES).map_err(|e| Error::io("read", path, e, remedy))?;
        let read: Self =
            serde_json::from_str(&text).map_err(|e| Error::codec("read", path, e, remedy))?;
        if read.certificate != FORMAT {
            let found = read.certificate;
            return Err(Error::invalid(
                format!(
                    "{} is a certificate of version {found}; this program reads version {FORMAT}",
                    path.display()
                ),
                "Check it with the version of Afterlight that wrote it",
            ));
        }
        Ok(read)
    }
}

impl CertifiedFrame {
    fn from_frame(frame: &Frame) -> Self {
        let content = frame.picture.as_ref().ok();
        let rebuild = content.and_then(|content| content.layers.as_ref()?.as_ref().ok());
        Self {
            frame: frame.number,
            file: frame.file.clone(),
            pixels_sha256: content.map_or(String::new(), |content| content.pixels.clone()),
            residual: rebuild.map(|rebuild| rebuild.residual),
            beside: content.map_or(Vec::new(), |content| content.beside.clone()),
        }
    }
}

#[cfg(test)]
mod tests;
