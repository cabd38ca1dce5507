//! Comparison of a shot's files with its certificate.

use super::frame::{Frame, hash_file};
use super::read::each;
use super::shot::Shot;
use super::{Certificate, CertifiedFrame, Fault, FileHash, Remark};
use base::error::Result;
use base::files::is_bare;
use base::progress::Progress;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Files read at the same time; only a small piece of each is in memory.
const AT_ONCE: usize = 8;
const STAGE: &str = "comparing files";

/// Result of comparing the files with a certificate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// Path of the certificate.
    pub of: PathBuf,
    /// True if all files are present and unchanged, and the shot had no faults.
    pub passed: bool,
    pub sentence: String,
    pub files: usize,
    /// Number of files that match byte by byte.
    pub same: usize,
    pub faults: Vec<Fault>,
    pub remarks: Vec<Remark>,
}

impl Verification {
    /// Compares all files with a certificate.
    ///
    /// # Errors
    /// When the certificate cannot be read, or the user stops.
    pub fn of_file(path: &Path, progress: &Progress) -> Result<Self> {
        let certificate = Certificate::read(path)?;
        let own = path.parent().unwrap_or(Path::new(""));
        let folder = own.join(&certificate.folder);
        let judged =
            each(&certificate.files, AT_ONCE, progress, STAGE, |frame| judge(&folder, frame))?;
        let mut faults: Vec<Fault> = judged.iter().flatten().cloned().collect();
        if certificate.hash() != certificate.sha256 {
            faults.insert(
                0,
                fault(
                    "certificate",
                    String::new(),
                    "the certificate was edited: its checksum does not match its list of files"
                        .to_owned(),
                ),
            );
        }
        if let Some(first) = certificate.faults.first() {
            faults.push(fault(
                "earlier",
                String::new(),
                format!(
                    "the certified shot already had {}: {}",
                    match certificate.faults.len() {
                        1 => "1 fault".to_owned(),
                        count => format!("{count} faults"),
                    },
                    first.sentence
                ),
            ));
        }
        let files = certificate.all_files().count();
        let changed: BTreeSet<&str> = judged.iter().flatten().map(|fault| &*fault.frames).collect();
        // Each file has at most one fault.
        let same = files - judged.iter().flatten().count();
        let passed = faults.is_empty();
        let sentence = match faults.len() {
            0 => format!(
                "{}: all {files} files match the certificate. SHA-256 {}",
                certificate.shot,
                certificate.sha256.get(..16).unwrap_or_default()
            ),
            _ => {
                let not = match changed.len() {
                    0 => String::new(),
                    1 => "; 1 frame does not".to_owned(),
                    count => format!("; {count} frames do not"),
                };
                format!("{}: {same} of {files} files match the certificate{not}", certificate.shot)
            }
        };
        Ok(Self {
            of: path.to_path_buf(),
            passed,
            sentence,
            files,
            same,
            faults,
            remarks: added(&folder, &certificate),
        })
    }
}

fn fault(kind: &str, frames: String, sentence: String) -> Fault {
    Fault { kind: kind.to_owned(), frames, sentence }
}

/// Faults of a frame whose files differ from the certificate.
fn judge(folder: &Path, frame: &CertifiedFrame) -> Vec<Fault> {
    let files = [&frame.file].into_iter().chain(&frame.beside);
    let of_file = |file: &FileHash| {
        let FileHash { name, bytes, sha256 } = file;
        let (kind, what) = if !is_bare(name) {
            ("certificate", "is not a file name in the frames' folder".to_owned())
        } else {
            let path = folder.join(name);
            match hash_file(&path, *bytes) {
                Ok((_, found)) if found == *sha256 => return None,
                Ok(_) if *name == frame.file.name => changed(&path, frame),
                Ok(_) => ("changed", "differs in its bytes".to_owned()),
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                    ("missing", "is missing".to_owned())
                }
                Err(e) => ("unreadable", format!("cannot be read: {e}")),
            }
        };
        Some(fault(kind, frame.frame.to_string(), format!("{name} {what}")))
    };
    files.filter_map(of_file).collect()
}

/// Kind of change and its message: a changed picture, or the same picture in changed bytes.
fn changed(path: &Path, frame: &CertifiedFrame) -> (&'static str, String) {
    match Frame::read(path, frame.frame, &frame.file.name).picture {
        Ok(content) if content.pixels == frame.pixels_sha256 => (
            "changed",
            "differs in its bytes, with the same picture: its header or its compression was changed"
                .to_owned(),
        ),
        Ok(_) => ("changed", "has a different picture".to_owned()),
        Err(said) => ("unreadable", format!("is damaged: {said}")),
    }
}

/// Frames of the shot that the certificate does not list.
fn added(folder: &Path, certificate: &Certificate) -> Vec<Remark> {
    let Ok(shot) = Shot::find(&[folder.join(&certificate.shot)]) else {
        return Vec::new();
    };
    let known: BTreeSet<&str> = (certificate.files.iter()).map(|f| &*f.file.name).collect();
    let new = shot.files.iter().filter(|(_, name)| !known.contains(&**name));
    let new: Vec<&str> = new.map(|(_, name)| &**name).collect();
    let sentence = match new[..] {
        [] => return Vec::new(),
        [one] => format!("{one} is not in the certificate"),
        [first, ..] => format!("{first} and {} more are not in the certificate", new.len() - 1),
    };
    vec![Remark { kind: "added".to_owned(), sentence }]
}
