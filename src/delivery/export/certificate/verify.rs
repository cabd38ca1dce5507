//! Check that the files of a certificate are still the same.

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

/// Files that are read at the same time: little of each is in memory.
const AT_ONCE: usize = 8;
const STAGE: &str = "comparing files";

/// Result of checking the files against a certificate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// The certificate's file.
    pub of: PathBuf,
    /// All files are there and the same, and had no faults.
    pub passed: bool,
    pub sentence: String,
    pub files: usize,
    /// Number of files that are the same, byte by byte.
    pub same: usize,
    pub faults: Vec<Fault>,
    pub remarks: Vec<Remark>,
}

impl Verification {
    /// Compares all files with a certificate.
    ///
    /// # Errors
    /// When the certificate cannot be read, or a stop was asked for.
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
                    "the certificate itself was changed: its hash is not that of its files"
                        .to_owned(),
                ),
            );
        }
        if let Some(first) = certificate.faults.first() {
            faults.push(fault(
                "earlier",
                String::new(),
                format!(
                    "the certificate was written of a shot with {}: {}",
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
        // A file has one fault at most.
        let same = files - judged.iter().flatten().count();
        let passed = faults.is_empty();
        let sentence = match faults.len() {
            0 => format!(
                "{}: all {files} files are those of the certificate. SHA-256 {}",
                certificate.shot,
                certificate.sha256.get(..16).unwrap_or_default()
            ),
            _ => {
                let not = match changed.len() {
                    0 => String::new(),
                    1 => "; 1 frame is not".to_owned(),
                    count => format!("; {count} frames are not"),
                };
                format!(
                    "{}: {same} of {files} files are those of the certificate{not}",
                    certificate.shot
                )
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
            ("certificate", "is no name of a file beside the others".to_owned())
        } else {
            let path = folder.join(name);
            match hash_file(&path, *bytes) {
                Ok((_, found)) if found == *sha256 => return None,
                Ok(_) if *name == frame.file.name => changed(&path, frame),
                Ok(_) => ("changed", "has other bytes".to_owned()),
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                    ("missing", "is not there".to_owned())
                }
                Err(e) => ("unreadable", format!("cannot be read: {e}")),
            }
        };
        Some(fault(kind, frame.frame.to_string(), format!("{name} {what}")))
    };
    files.filter_map(of_file).collect()
}

/// Kind of change and its message: a changed picture, or only a changed way of writing it.
fn changed(path: &Path, frame: &CertifiedFrame) -> (&'static str, String) {
    match Frame::read(path, frame.frame, &frame.file.name).picture {
        Ok(content) if content.pixels == frame.pixels_sha256 => (
            "changed",
            "has other bytes and the same picture: its header or its compression was changed"
                .to_owned(),
        ),
        Ok(_) => ("changed", "has another picture".to_owned()),
        Err(said) => ("unreadable", format!("is damaged: {said}")),
    }
}

/// Frames of the shot that the certificate does not know.
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
