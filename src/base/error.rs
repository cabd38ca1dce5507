//! The library's one error type. Every message says what is wrong, where, and what to do about it.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

/// Shorthand for results of this library.
pub type Result<T> = std::result::Result<T, Error>;

/// What can go wrong, worded for the person who has to act on it. A `problem` names the file or setting and
/// says what is wrong with it; a `remedy` says what to do. Both go without a full stop.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused to read, write, move or start something.
    #[error("cannot {action} {}: {source}. {remedy}", shown(&path.to_string_lossy()))]
    Io {
        action: &'static str,
        path: PathBuf,
        source: io::Error,
        remedy: String,
    },
    /// A file could not be decoded or encoded: it is damaged, of another kind, or of another version.
    #[error("cannot {action} {}: {cause}. {remedy}", shown(&path.to_string_lossy()))]
    Codec {
        action: &'static str,
        path: PathBuf,
        cause: String,
        remedy: String,
    },
    /// A setting, file or picture cannot be used as it is.
    #[error("{problem}. {remedy}")]
    Invalid { problem: String, remedy: String },
    /// Something that is needed or was asked for does not exist.
    #[error("{problem}. {remedy}")]
    Missing { problem: String, remedy: String },
    /// Somebody else is using it.
    #[error("{problem}. {remedy}")]
    Busy { problem: String, remedy: String },
    /// The GPU or the display failed at something, or cannot do it.
    #[error("{problem}. {remedy}")]
    Device { problem: String, remedy: String },
    /// The GPU is gone, and with it what it held.
    #[error(
        "the GPU stopped working: its driver failed, or it was taken away. Everything that was saved is kept. \
         Start Afterlight again to use the GPU, or continue on the CPU (--device cpu)"
    )]
    GpuLost,
    /// The person asked for a stop; `kept` says what has been kept.
    #[error("stopped on request: {kept}")]
    Cancelled { kept: String },
    /// Afterlight itself is wrong.
    #[error(
        "{problem}: this is a bug in Afterlight. Everything that was saved is kept; please report it"
    )]
    Bug { problem: String },
}

/// Letters of a cause or problem that are shown.
const LONGEST: usize = 1000;

/// What a file or another program said, fit to be shown: not endless, and without characters that steer a terminal.
fn shown(said: &str) -> String {
    let plain = |c: char| match c {
        '\n' => c,
        _ if c.is_control() => char::REPLACEMENT_CHARACTER,
        _ => c,
    };
    let mut letters = said.chars().map(plain);
    let mut shown: String = letters.by_ref().take(LONGEST).collect();
    if letters.next().is_some() {
        shown.push('…');
    }
    shown
}

impl Error {
    /// The operating system refused to `action` the file at `path`.
    pub fn io(
        action: &'static str,
        path: impl AsRef<Path>,
        source: io::Error,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Io {
            action,
            path: path.as_ref().to_path_buf(),
            source,
            remedy: remedy.into(),
        }
    }

    /// The content of the file at `path` could not be decoded or encoded.
    pub fn codec(
        action: &'static str,
        path: impl AsRef<Path>,
        cause: impl Display,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Codec {
            action,
            path: path.as_ref().to_path_buf(),
            cause: shown(&cause.to_string()),
            remedy: remedy.into(),
        }
    }

    /// A setting, file or picture cannot be used as it is.
    pub fn invalid(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Invalid {
            problem: shown(&problem.into()),
            remedy: remedy.into(),
        }
    }

    /// A picture whose columns and rows differ from those of another that it belongs to.
    pub fn other_size(
        (picture, size): (impl Display, (usize, usize)),
        (reference, expected): (impl Display, (usize, usize)),
        remedy: impl Into<String>,
    ) -> Self {
        let problem = format!(
            "{picture} has {} × {} pixels, but {reference} has {} × {}",
            size.0, size.1, expected.0, expected.1
        );
        Self::invalid(problem, remedy)
    }

    /// Something that is needed or was asked for does not exist.
    pub fn missing(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Missing {
            problem: shown(&problem.into()),
            remedy: remedy.into(),
        }
    }

    /// Somebody else is using it.
    pub fn busy(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Busy {
            problem: shown(&problem.into()),
            remedy: remedy.into(),
        }
    }

    /// The GPU or the display failed at something, or cannot do it.
    pub fn device(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Device {
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }

    /// Afterlight itself is wrong: `problem` says what it failed to do, and why.
    pub fn bug(problem: impl Into<String>) -> Self {
        Self::Bug {
            problem: problem.into(),
        }
    }

    /// The same error of a setting, with the file that holds the setting. Other kinds stay as they are.
    pub fn within(self, path: &Path) -> Self {
        match self {
            Self::Invalid { problem, remedy } => Self::Invalid {
                problem: format!("{}: {problem}", path.display()),
                remedy,
            },
            other => other,
        }
    }

    /// The same error with `note` after what to do, such as what has been kept. Kinds that name no remedy
    /// stay as they are.
    pub fn with_note(mut self, note: &str) -> Self {
        match &mut self {
            Self::Io { remedy, .. }
            | Self::Codec { remedy, .. }
            | Self::Invalid { remedy, .. }
            | Self::Missing { remedy, .. }
            | Self::Busy { remedy, .. }
            | Self::Device { remedy, .. } => {
                remedy.push_str("; ");
                remedy.push_str(note);
            }
            Self::GpuLost | Self::Cancelled { .. } | Self::Bug { .. } => {}
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::error::Error as _;

    #[test]
    fn a_full_disk_is_told_from_other_failures_and_its_note_comes_last() {
        let full = io::Error::from(io::ErrorKind::StorageFull);
        let error = Error::io("write", "out.exr", full, "Make room").with_note("2 frames are kept");
        assert!(
            matches!(&error, Error::Io { source, .. } if source.kind() == io::ErrorKind::StorageFull)
        );
        assert!(error.source().is_some());
        let sentence = error.to_string();
        assert!(sentence.starts_with("cannot write out.exr: "), "{sentence}");
        assert!(
            sentence.ends_with(". Make room; 2 frames are kept"),
            "{sentence}"
        );
    }

    #[test]
    fn what_files_say_is_neither_endless_nor_able_to_steer_a_terminal() {
        let hostile = format!("\u{1b}[2J\0{}", "ä".repeat(100_000));
        for error in [
            Error::codec("read", "a.hdr", &hostile, "Check it"),
            Error::invalid(&*hostile, "Check it"),
            Error::missing(&*hostile, "Check it"),
            Error::busy(&*hostile, "Check it"),
        ] {
            let sentence = error.to_string();
            assert!(sentence.chars().count() < 1100 && sentence.ends_with("…. Check it"));
            assert!(!sentence.contains(char::is_control), "{sentence}");
        }
        let path = Path::new(&hostile).join("a");
        let error = Error::io("open", path, io::ErrorKind::NotFound.into(), "Check it");
        assert!(!error.to_string().contains(char::is_control));
        test_support::shown!(Strangers, "A file's words in an error",
            danger: "pages of it, or characters that steer the terminal",
            done: "the first 1000 letters are shown, control characters replaced");
    }

    #[test]
    fn a_stop_and_a_lost_gpu_take_no_note() {
        for error in [Error::GpuLost, Error::Cancelled { kept: "all".into() }] {
            let plain = error.to_string();
            assert_eq!(error.with_note("more").to_string(), plain);
        }
    }
}
