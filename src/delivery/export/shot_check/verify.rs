//! Comparison of a folder's files with its hash lists.

use super::hash_list::{History, files, hash_files};
use super::{Fault, Remark};
use base::error::{Error, Result};
use base::progress::Progress;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Result of comparing the files of a folder with its ASC MHL.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// Path of the hash list or of its folder.
    pub of: PathBuf,
    /// True if all listed files are present and unchanged.
    pub passed: bool,
    pub sentence: String,
    /// Number of files in the hash lists.
    pub files: usize,
    /// Number of files that match byte by byte.
    pub same: usize,
    pub faults: Vec<Fault>,
    pub remarks: Vec<Remark>,
}

impl Verification {
    /// Compares all files with the hash lists of their folder. `path` is a hash list in its folder `ascmhl`, or that
    /// folder.
    ///
    /// # Errors
    /// When the hash lists or the folder cannot be read, or the user stops.
    pub fn of_file(path: &Path, progress: &Progress) -> Result<Self> {
        let whole = std::fs::canonicalize(path)
            .map_err(|e| Error::io("read", path, e, "Name a hash list in a folder ascmhl"))?;
        let lists = if whole.is_dir() { Some(&*whole) } else { whole.parent() };
        let lists = lists.filter(|folder| folder.ends_with("ascmhl"));
        let root = lists.and_then(Path::parent).ok_or_else(|| {
            Error::invalid(
                format!("{} is not in a folder ascmhl", path.display()),
                "Put the hash list back into the folder ascmhl beside the files",
            )
        })?;
        let history = History::read(root)?;
        let (listed, new): (Vec<_>, Vec<_>) = files(root)?.into_iter().partition(|path| history.lists(path));
        let found = hash_files(root, listed, |path| history.length(path), progress)?;
        let faults = history.faults(root, &found);
        let mut remarks = Vec::new();
        let mut remark = |kind: &str, sentence: String| {
            remarks.push(Remark { kind: kind.to_owned(), sentence });
        };
        match &new[..] {
            [] => (),
            [one] => remark("added", format!("{one} is not in the hash list")),
            [first, ..] => {
                let more = new.len() - 1;
                remark("added", format!("{first} and {more} more are not in the hash list"));
            }
        }
        if history.without_c4() > 0 {
            let sentence = "have no C4 hash and were not compared: verify them with ascmhl";
            remark("hash_list", format!("{} files {sentence}", history.without_c4()));
        }
        let (files, same) = (history.len(), history.same(&found));
        let name = root.file_name().unwrap_or_default().to_string_lossy();
        let sentence = if same == files {
            format!("{name}: all {files} files match the hash list")
        } else {
            format!("{name}: {same} of {files} files match the hash list")
        };
        let passed = faults.is_empty();
        Ok(Self { of: path.to_path_buf(), passed, sentence, files, same, faults, remarks })
    }
}
