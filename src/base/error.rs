//! The library's one error type. Every message is a sentence that says where, what was expected,
//! what was found and what to do about it.

use std::path::{Path, PathBuf};

/// Shorthand for results of this library.
pub type Result<T> = std::result::Result<T, Error>;

/// What can go wrong, worded for the person who has to act on it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system or a codec refused a file.
    #[error("cannot {action} {}: {cause}. {remedy}", path.display())]
    File {
        action: &'static str,
        path: PathBuf,
        cause: String,
        remedy: String,
    },
    /// Something was read or computed and is not what it has to be.
    #[error("{place}: expected {expected}, found {found}. {remedy}")]
    Unexpected {
        place: String,
        expected: String,
        found: String,
        remedy: String,
    },
    /// The GPU is gone, and with it what it held.
    #[error(
        "the GPU stopped working: its driver failed, or it was taken away. All that was saved is kept. Start \
         Afterlight again to use the GPU, or go on on the CPU (--device cpu)"
    )]
    GpuLost,
    /// The person asked for a stop; whatever was finished has been kept.
    #[error("stopped on request: {kept}")]
    Cancelled { kept: String },
}

impl Error {
    /// A file that could not be opened, decoded or written.
    pub fn file(
        action: &'static str,
        path: impl AsRef<Path>,
        cause: impl ToString,
        remedy: impl Into<String>,
    ) -> Self {
        Self::File {
            action,
            path: path.as_ref().to_path_buf(),
            cause: cause.to_string(),
            remedy: remedy.into(),
        }
    }

    /// A value, file or shape that differs from what is needed. `place` names the file or setting.
    pub fn unexpected(
        place: impl ToString,
        expected: impl Into<String>,
        found: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Unexpected {
            place: place.to_string(),
            expected: expected.into(),
            found: found.into(),
            remedy: remedy.into(),
        }
    }
}
