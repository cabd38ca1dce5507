//! The library's one error type. Every message names the fault, its place and the remedy.

use super::files::plain;
use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

/// Shorthand for results of this library.
pub type Result<T> = std::result::Result<T, Error>;

/// An error, worded for the user. A `problem` names the file or setting and its fault; a `remedy` says what to
/// do. Neither ends with a full stop. The displayed error names no command; [`Self::for_terminal`] does.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused to read, write, move or start something.
    #[error("cannot {action} {}: {}. {remedy}", shown(&plain(path)), io_words(source))]
    Io { action: &'static str, path: PathBuf, source: io::Error, remedy: Remedy },
    /// A file could not be decoded or encoded: it is damaged, of another kind, or of another version.
    #[error("cannot {action} {}: {cause}. {remedy}", shown(&plain(path)))]
    Codec { action: &'static str, path: PathBuf, cause: String, remedy: Remedy },
    /// A setting, file or picture is invalid.
    #[error("{problem}. {remedy}")]
    Invalid { problem: String, remedy: Remedy },
    /// Something required or requested does not exist.
    #[error("{problem}. {remedy}")]
    Missing { problem: String, remedy: Remedy },
    /// Another program or job is using it.
    #[error("{problem}. {remedy}")]
    Busy { problem: String, remedy: Remedy },
    /// The GPU or the display failed, or lacks a capability.
    #[error("{problem}. {remedy}")]
    Device { problem: String, remedy: Remedy },
    /// The GPU was lost, with everything in its memory.
    #[error(
        "the GPU stopped working: its driver failed, or it was disconnected. Everything saved is safe. \
         Start Afterlight again to use the GPU"
    )]
    GpuLost,
    /// Stopped on request; `kept` names what was kept.
    #[error("stopped on request: {kept}")]
    Cancelled { kept: String },
    /// A fault in Afterlight itself.
    #[error("{problem}: this is a bug in Afterlight. Everything saved is safe; please report the bug")]
    Bug { problem: String },
}

/// Remedy for a problem: in words, and as a command line, which is shown only in a terminal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remedy {
    pub words: String,
    /// A command or an option.
    pub how: Option<String>,
}

impl std::fmt::Display for Remedy {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.words)
    }
}

impl From<String> for Remedy {
    fn from(words: String) -> Self {
        Self { words, how: None }
    }
}

impl From<&String> for Remedy {
    fn from(words: &String) -> Self {
        words.clone().into()
    }
}

impl From<&str> for Remedy {
    fn from(words: &str) -> Self {
        words.to_owned().into()
    }
}

/// The words, and the command or option.
impl<W: Into<String>, H: Into<String>> From<(W, H)> for Remedy {
    fn from((words, how): (W, H)) -> Self {
        Self { words: words.into(), how: Some(how.into()) }
    }
}

/// Message of the operating system or of a reader, without the error number.
pub fn io_words(error: &io::Error) -> String {
    let words = match error.kind() {
        // The maker of the error has worded it.
        _ if error.get_ref().is_some() => None,
        io::ErrorKind::NotFound => Some("not found"),
        io::ErrorKind::PermissionDenied => Some("no permission"),
        io::ErrorKind::StorageFull => Some("the disk is full"),
        io::ErrorKind::QuotaExceeded => Some("the quota of the disk is used up"),
        io::ErrorKind::ReadOnlyFilesystem => Some("the disk is read-only"),
        io::ErrorKind::AlreadyExists => Some("it exists already"),
        io::ErrorKind::IsADirectory => Some("it is a folder"),
        io::ErrorKind::NotADirectory => Some("a folder on the way is a file"),
        io::ErrorKind::DirectoryNotEmpty => Some("the folder is not empty"),
        io::ErrorKind::InvalidFilename => Some("the disk does not allow this name"),
        _ => None,
    };
    words.map_or_else(
        || {
            let said = error.to_string();
            let number = said.find(" (os error ").unwrap_or(said.len());
            said[..number].to_owned()
        },
        str::to_owned,
    )
}

/// Maximum number of characters of a cause or problem.
const LONGEST: usize = 1000;

/// Text from a file or another program, fit for display: shortened, and without terminal control characters.
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
    without_detours(shown)
}

/// The sentence with `..` in paths resolved, unless a link makes that lead elsewhere.
fn without_detours(mut said: String) -> String {
    const SLASH: char = std::path::MAIN_SEPARATOR;
    let back = format!("{SLASH}..{SLASH}");
    let mut from = 0;
    while let Some(at) = said[from..].find(&back).map(|at| from + at) {
        match said[..at].rfind(SLASH) {
            // Another path may begin after a space.
            Some(left)
                if !matches!(&said[left + 1..at], "" | "." | "..")
                    && !said[left..at].contains(' ')
                    && !ends_in_link(&said[..at]) =>
            {
                said.replace_range(left..at + 3, "");
                from = left;
            }
            _ => from = at + 3,
        }
    }
    said
}

/// True if a sentence ends with the path of a link, wherever that path begins.
fn ends_in_link(said: &str) -> bool {
    let begins = |at: &usize| {
        let before = said[..*at].chars().next_back();
        before.is_none_or(|before| !before.is_alphanumeric())
    };
    let mut slashes = said.match_indices(std::path::MAIN_SEPARATOR);
    slashes.any(|(at, _)| begins(&at) && Path::new(&said[at..]).is_symlink())
}

/// The remedy of an error, if its kind has one, borrowed like the error itself.
macro_rules! remedy {
    ($error:expr) => {
        match $error {
            Error::Io { remedy, .. }
            | Error::Codec { remedy, .. }
            | Error::Invalid { remedy, .. }
            | Error::Missing { remedy, .. }
            | Error::Busy { remedy, .. }
            | Error::Device { remedy, .. } => Some(remedy),
            Error::GpuLost | Error::Cancelled { .. } | Error::Bug { .. } => None,
        }
    };
}

impl Error {
    /// The operating system refused to `action` the file at `path`.
    pub fn io(action: &'static str, path: impl AsRef<Path>, source: io::Error, remedy: impl Into<Remedy>) -> Self {
        Self::Io { action, path: path.as_ref().to_path_buf(), source, remedy: remedy.into() }
    }

    /// The content of the file at `path` could not be decoded or encoded.
    pub fn codec(action: &'static str, path: impl AsRef<Path>, cause: impl Display, remedy: impl Into<Remedy>) -> Self {
        Self::Codec {
            action,
            path: path.as_ref().to_path_buf(),
            cause: shown(&cause.to_string()),
            remedy: remedy.into(),
        }
    }

    /// A setting, file or picture is invalid.
    pub fn invalid(problem: impl Into<String>, remedy: impl Into<Remedy>) -> Self {
        Self::Invalid { problem: shown(&problem.into()), remedy: remedy.into() }
    }

    /// A picture whose size differs from that of a related picture.
    pub fn other_size(
        (picture, size): (impl Display, (usize, usize)),
        (reference, expected): (impl Display, (usize, usize)),
        remedy: impl Into<Remedy>,
    ) -> Self {
        let problem = format!(
            "{picture} has {} × {} pixels, but {reference} has {} × {}",
            size.0, size.1, expected.0, expected.1
        );
        Self::invalid(problem, remedy)
    }

    /// Something required or requested does not exist.
    pub fn missing(problem: impl Into<String>, remedy: impl Into<Remedy>) -> Self {
        Self::Missing { problem: shown(&problem.into()), remedy: remedy.into() }
    }

    /// Another program or job is using it.
    pub fn busy(problem: impl Into<String>, remedy: impl Into<Remedy>) -> Self {
        Self::Busy { problem: shown(&problem.into()), remedy: remedy.into() }
    }

    /// The GPU or the display failed, or lacks a capability.
    pub fn device(problem: impl Into<String>, remedy: impl Into<Remedy>) -> Self {
        Self::Device { problem: problem.into(), remedy: remedy.into() }
    }

    /// A fault in Afterlight itself: `problem` names the failed operation and the reason.
    pub fn bug(problem: impl Into<String>) -> Self {
        Self::Bug { problem: problem.into() }
    }

    /// The same error with its file or folder in front, for a setting or something missing. Other kinds are
    /// unchanged.
    pub fn within(mut self, path: &Path) -> Self {
        if let Self::Invalid { problem, .. } | Self::Missing { problem, .. } = &mut self {
            *problem = format!("{}: {problem}", plain(path));
        }
        self
    }

    /// The same error with `note` after the remedy, such as the output that was kept. Kinds without a remedy are
    /// unchanged.
    pub fn with_note(mut self, note: &str) -> Self {
        if let Some(remedy) = remedy!(&mut self) {
            remedy.words.push_str("; ");
            remedy.words.push_str(note);
        }
        self
    }

    /// The same error with a command or option added to its remedy. Kinds without a remedy are unchanged.
    pub fn with_how(mut self, how: impl Into<String>) -> Self {
        if let Some(remedy) = remedy!(&mut self) {
            let how = how.into();
            remedy.how = Some(match remedy.how.take() {
                Some(before) => format!("{before}; {how}"),
                None => how,
            });
        }
        self
    }

    /// The command or option of the remedy, if there is one.
    pub fn how(&self) -> Option<&str> {
        match self {
            Self::GpuLost => Some("or continue on the CPU: --device cpu"),
            other => remedy!(other)?.how.as_deref(),
        }
    }

    /// The sentence with its command or option, for a terminal.
    pub fn for_terminal(&self) -> String {
        match self.how() {
            Some(how) => format!("{self} ({how})"),
            None => self.to_string(),
        }
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
        assert!(matches!(&error, Error::Io { source, .. } if source.kind() == io::ErrorKind::StorageFull));
        assert!(error.source().is_some());
        let sentence = error.to_string();
        assert_eq!(sentence, "cannot write out.exr: the disk is full. Make room; 2 frames are kept");
    }

    #[test]
    fn commands_are_for_terminals_and_the_numbers_of_the_system_for_nobody() {
        let error = Error::missing("no network yet", ("Train first", "afterlight train PROJECT"));
        assert_eq!(error.to_string(), "no network yet. Train first");
        let noted = error.with_note("2 frames are kept");
        assert_eq!(noted.for_terminal(), "no network yet. Train first; 2 frames are kept (afterlight train PROJECT)");
        let more = noted.with_how("--fresh");
        assert_eq!(more.how(), Some("afterlight train PROJECT; --fresh"));
        let lost = Error::GpuLost;
        assert!(!lost.to_string().contains("--") && lost.for_terminal().contains("--device cpu"));
        let gone = std::fs::read("/nowhere/at/all").unwrap_err();
        assert_eq!(io_words(&gone), "not found");
        // ENOTTY on unix, which has no words here; another error elsewhere.
        let other = io_words(&io::Error::from_raw_os_error(25));
        assert!(!other.is_empty() && !other.contains("os error"), "{other}");
        let said = io::Error::new(io::ErrorKind::NotFound, "the header ends too early");
        assert_eq!(io_words(&said), "the header ends too early");
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
            done: "the first 1000 letters are shown, control characters replaced");
    }

    #[cfg(unix)]
    #[test]
    fn paths_in_sentences_have_no_ways_back() {
        for (said, expected) in [
            ("the folder /films/a/../shoot is missing", "the folder /films/shoot is missing"),
            ("/a and b/../c", "/a and b/../c"),
            ("/a/b/../../c and /d/e/../f", "/c and /d/f"),
            ("/../a and ../../b", "/../a and ../../b"),
            ("/a/./../b and c/../d", "/a/./../b and c/../d"),
        ] {
            let sentence = Error::missing(said, "Look").to_string();
            assert_eq!(sentence, format!("{expected}. Look"));
        }
        let path = "/films/project/../shoot/a.png";
        let error = Error::io("read", path, io::ErrorKind::NotFound.into(), "Look");
        assert_eq!(error.to_string(), "cannot read /films/shoot/a.png: not found. Look");
    }

    #[cfg(unix)]
    #[test]
    fn paths_over_links_stay_as_they_lead() {
        let folder = tempfile::tempdir().unwrap();
        let [films, home] = ["films of may/p", "home"].map(|name| folder.path().join(name));
        std::fs::create_dir_all(&films).unwrap();
        std::fs::create_dir(&home).unwrap();
        std::os::unix::fs::symlink(&films, home.join("p")).unwrap();
        let path = home.join("p/../shoot");
        let error = Error::io("read", &path, io::ErrorKind::NotFound.into(), "Look");
        let sentence = format!("cannot read {}: not found. Look", path.display());
        assert_eq!(error.to_string(), sentence);
        let said = format!("\"{}\" is missing", path.display());
        assert_eq!(Error::missing(&*said, "Look").to_string(), format!("{said}. Look"));
        // The folder itself is not a link.
        let path = films.join("../shoot");
        let error = Error::io("read", &path, io::ErrorKind::NotFound.into(), "Look");
        let sentence = format!("cannot read {}/shoot: ", films.parent().unwrap().display());
        assert!(error.to_string().starts_with(&sentence), "{error}");
    }

    #[test]
    fn a_stop_and_a_lost_gpu_take_no_note() {
        for error in [Error::GpuLost, Error::Cancelled { kept: "all".into() }] {
            let plain = error.to_string();
            assert_eq!(error.with_note("more").to_string(), plain);
        }
    }
}
