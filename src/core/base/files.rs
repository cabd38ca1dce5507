//! Files that are written completely or not at all, and files named by strangers.
//!
//! The contents of a project's folder are input from a stranger: a name there may be a link to a file elsewhere,
//! a device that never ends or a pipe that never answers.

mod display;
mod names;

pub use display::{plain, shown};
pub use names::{is_clutter, natural_order, sorted_names};

use super::error::{Error, Result};
use std::ffi::OsStr;
use std::fs::{File, FileType, OpenOptions, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Component, Path, PathBuf};
use std::time::{Duration, SystemTime};
use tempfile::NamedTempFile;

/// Extension of files that are being written.
const UNFINISHED: &str = ".afterlight";
/// Number of random letters and digits in those names.
const RANDOM: usize = 6;
/// Minimum age of a leftover file: the writer of a younger one may not have locked it yet.
const YOUNG: Duration = Duration::from_secs(10);
/// Age at which an unfinished file is left over, on file systems without locks.
const OLD: Duration = Duration::from_secs(24 * 3600);

/// Opens a file for reading, following links.
///
/// # Errors
/// As [`File::open`], and when it is a device, a pipe or a folder: these may never end.
pub fn open(path: &Path) -> io::Result<File> {
    let kind = std::fs::metadata(path)?.file_type();
    if kind.is_file() { File::open(path) } else { Err(not_a_file(kind)) }
}

/// Opens one of the program's own files, for reading or writing.
///
/// # Errors
/// As [`OpenOptions::open`], and when the name is a link or not a file: the target of a link is not the
/// program's.
pub fn open_own(path: &Path, options: &OpenOptions) -> io::Result<File> {
    match std::fs::symlink_metadata(path) {
        Ok(data) if !data.is_file() => return Err(not_a_file(data.file_type())),
        _ => (),
    }
    #[cfg(target_os = "linux")]
    {
        // It may become a link meanwhile.
        use std::os::unix::fs::OpenOptionsExt;
        options.clone().custom_flags(libc::O_NOFOLLOW).open(path)
    }
    #[cfg(not(target_os = "linux"))]
    options.open(path)
}

/// Maximum size of an ordinary text file in bytes: far more than the program ever writes. Parsed tables take up
/// to fifty times as much memory.
pub const MOST_TEXT: u64 = 16 << 20;

/// Reads a text of at most `most` bytes as people bring it: UTF-8, with or without a byte-order mark, or UTF-16 of
/// either order, with a mark or with every other byte of its first four 0. The mark is left out, and each line
/// ends in `\n`.
///
/// # Errors
/// As [`open`], when the file is longer, and at the first byte that is none of these, with its place.
pub fn read_text(path: &Path, most: u64) -> io::Result<String> {
    decoded(read(path, most)?)
}

/// Reads a text of at most `most` bytes that the program wrote, unchanged to the last byte.
///
/// # Errors
/// As [`open`], and when the file is longer or not UTF-8.
pub fn read_own_text(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(read(path, most)?).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        not_text(at, &String::from_utf8_lossy(&e.as_bytes()[..at]))
    })
}

fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let length = file.metadata()?.len();
    if length > most {
        return Err(io::Error::new(ErrorKind::InvalidData, format!("it has {length} bytes; the limit is {most}")));
    }
    let mut bytes = Vec::with_capacity(length as usize);
    // It may grow meanwhile.
    file.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Text of a file's bytes: see [`read_text`].
fn decoded(bytes: Vec<u8>) -> io::Result<String> {
    type Unit = fn([u8; 2]) -> u16;
    let wide: Option<(usize, Unit)> = match bytes[..] {
        [0xff, 0xfe, ..] => Some((2, u16::from_le_bytes)),
        [0xfe, 0xff, ..] => Some((2, u16::from_be_bytes)),
        [1..=255, 0, 1..=255, 0, ..] => Some((0, u16::from_le_bytes)),
        [0, 1..=255, 0, 1..=255, ..] => Some((0, u16::from_be_bytes)),
        _ => None,
    };
    let text = match wide {
        Some((start, unit)) => {
            let (pairs, rest) = bytes[start..].as_chunks::<2>();
            let mut text = String::with_capacity(pairs.len());
            let mut at = start;
            for letter in char::decode_utf16(pairs.iter().map(|&pair| unit(pair))) {
                match letter {
                    Ok('\0') | Err(_) => return Err(not_text(at, &text)),
                    Ok(letter) => {
                        text.push(letter);
                        at += 2 * letter.len_utf16();
                    }
                }
            }
            if !rest.is_empty() {
                return Err(not_text(at, &text));
            }
            text
        }
        None => {
            let valid = match std::str::from_utf8(&bytes) {
                Ok(text) => text,
                Err(e) => std::str::from_utf8(&bytes[..e.valid_up_to()]).unwrap_or_default(),
            };
            let end = valid.find('\0').unwrap_or(valid.len());
            if end < bytes.len() {
                return Err(not_text(end, &valid[..end]));
            }
            valid.strip_prefix('\u{feff}').unwrap_or(valid).to_owned()
        }
    };
    Ok(if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n") } else { text })
}

/// Error at byte `at` of a file, after the text `before`.
fn not_text(at: usize, before: &str) -> io::Error {
    let lines = before.replace("\r\n", "\n");
    let line = lines.matches(['\n', '\r']).count() + 1;
    let said = format!("not UTF-8 or UTF-16 at byte {at}, line {line}; save it as UTF-8");
    io::Error::new(ErrorKind::InvalidData, said)
}

fn not_a_file(kind: FileType) -> io::Error {
    let what = if kind.is_symlink() {
        "a link"
    } else if kind.is_dir() {
        "a folder"
    } else {
        "a device or a pipe"
    };
    io::Error::new(ErrorKind::InvalidInput, format!("this is {what} and not a file"))
}

/// True if a name from a file is a bare file name, not a path that leads elsewhere.
pub fn is_bare(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    let is_one = matches!((parts.next(), parts.next()), (Some(Component::Normal(part)), None) if part == name);
    is_one && !name.contains(['/', '\\', '\0'])
}

/// Writes through a file beside `path`, syncs it and renames it over `path`, so that a crash leaves either the
/// old file or the new one, complete. Creates the folder if it is missing.
///
/// # Errors
/// When the folder or the file cannot be written; the old file then stays.
pub fn write_beside(path: &Path, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> Result<()> {
    let fail = |cause: io::Error| {
        let remedy = "Check that the folder can be written and the disk has room";
        Error::io("write", path, cause, remedy)
    };
    let unfinished = Unfinished::beside(path).map_err(fail)?;
    let mut out = BufWriter::new(unfinished.0.as_file());
    write(&mut out).and_then(|()| out.flush()).map_err(fail)?;
    drop(out);
    unfinished.finish(path).map_err(fail)
}

/// A file beside another that it will replace. Dropping it before that removes it.
#[derive(Debug)]
pub struct Unfinished(NamedTempFile);

impl Unfinished {
    /// Creates an empty file beside `path` under a unique name, and the folder if it is missing. As long as this
    /// lives, the file is [not left over](remove_left_over).
    ///
    /// # Errors
    /// When the folder cannot be written, and when `path` is not a file or leads to something else: a device
    /// would be replaced.
    pub fn beside(path: &Path) -> io::Result<Self> {
        let name = path.file_name().ok_or(ErrorKind::InvalidFilename)?;
        if let Ok(data) = std::fs::metadata(path)
            && !data.is_file()
        {
            return Err(not_a_file(data.file_type()));
        }
        let folder = parent_folder(path);
        std::fs::create_dir_all(folder).map_err(|e| match e.kind() {
            ErrorKind::AlreadyExists => ErrorKind::NotADirectory.into(),
            _ => e,
        })?;
        let mut start = std::ffi::OsString::from(".");
        // Names may be as long as the file system allows.
        start.push(OsStr::new(&*shortened(&name.to_string_lossy())));
        start.push(".");
        let mut builder = tempfile::Builder::new();
        (builder.prefix(&start).suffix(UNFINISHED)).rand_bytes(RANDOM);
        #[cfg(unix)]
        {
            // With a new file's usual permissions, not those of a temporary one.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let file = builder.tempfile_in(folder)?;
        // Not all file systems have locks. On Windows a lock would keep ffmpeg from writing the file.
        #[cfg(unix)]
        let _ = file.as_file().try_lock();
        Ok(Self(file))
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// Syncs the file and renames it to `path`.
    ///
    /// # Errors
    /// When either fails; the file is then removed.
    pub fn finish(self, path: &Path) -> io::Result<()> {
        // Another program may have written to it by name. Windows syncs only files that are open for writing.
        (OpenOptions::new().write(true).open(self.path()))?.sync_all()?;
        self.0.persist(path).map_err(|e| e.error)?;
        // The new name is on the disk once the folder is. Not all file systems can do that.
        #[cfg(unix)]
        let _ = File::open(parent_folder(path)).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

/// The folder that holds a file.
fn parent_folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The first characters of a name, 100 bytes at most.
fn shortened(name: &str) -> String {
    let fits = |(at, c): &(usize, char)| at + c.len_utf8() <= 100;
    (name.char_indices().take_while(fits).map(|(_, c)| c)).collect()
}

/// Removes unfinished files of killed processes from a folder.
pub fn remove_left_over(folder: &Path) {
    let now = SystemTime::now();
    for path in unfinished(folder) {
        let Ok(file) = open_own(&path, OpenOptions::new().read(true)) else { continue };
        let age = (file.metadata().and_then(|data| data.modified()).ok())
            .and_then(|written| now.duration_since(written).ok())
            .unwrap_or_default();
        let is_left = match file.try_lock() {
            Ok(()) if cfg!(unix) => age >= YOUNG,
            Err(TryLockError::WouldBlock) => false,
            Ok(()) | Err(TryLockError::Error(_)) => age >= OLD,
        };
        if is_left {
            // A failure only costs disk space.
            let _ = std::fs::remove_file(&path);
        }
    }
}

/// Files in a folder that are being written or are left over: `.NAME.RANDOM.afterlight`, as named by
/// [`Unfinished::beside`]. A user's `.notes.afterlight` does not match.
fn unfinished(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_ours = |name: &OsStr| {
        let name = name.to_string_lossy();
        let inner = name.strip_prefix('.').and_then(|name| name.strip_suffix(UNFINISHED));
        (inner.and_then(|inner| inner.rsplit_once('.')))
            .is_some_and(|(_, random)| random.len() == RANDOM && random.bytes().all(|b| b.is_ascii_alphanumeric()))
    };
    entries.filter(|entry| is_ours(&entry.file_name())).map(|entry| entry.path()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kept.txt");
        std::fs::write(&path, b"old").unwrap();
        let said = write_beside(&path, |_| Err(ErrorKind::StorageFull.into())).unwrap_err();
        assert!(said.to_string().contains("kept.txt"), "{said}");
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        test_support::shown!(
            Accidents,
            "A file cannot be written to its end",
            done: "it is written beside the old one, and renamed once it is complete",
        );
    }

    #[test]
    fn what_is_written_has_its_name_and_the_permissions_of_any_file() {
        let folder = tempfile::tempdir().unwrap();
        let long = "ä".repeat(120);
        let path = folder.path().join("new/folders").join(long);
        for text in ["first", "second"] {
            write_beside(&path, |out| out.write_all(text.as_bytes())).unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        let usual = folder.path().join("usual");
        std::fs::write(&usual, "").unwrap();
        let permissions = |path: &Path| std::fs::metadata(path).unwrap().permissions();
        assert_eq!(permissions(&path), permissions(&usual));
    }

    #[test]
    fn left_over_files_of_dead_processes_go_and_those_of_living_ones_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("big.bin");
        let living = Unfinished::beside(&path).unwrap();
        let dead = folder.path().join(format!(".big.bin.x1y2z3{UNFINISHED}"));
        let others = [
            ".big.bin.x2",
            "big.afterlight",
            UNFINISHED,
            ".notes.afterlight",
            ".my.notes.afterlight",
            "a.abcdef.afterlight",
        ]
        .map(|name| folder.path().join(name));
        let long_ago = SystemTime::now() - 2 * YOUNG;
        let age = |path: &Path| {
            let file = OpenOptions::new().write(true).open(path).unwrap();
            file.set_modified(long_ago).unwrap();
        };
        for path in others.iter().chain([&dead]) {
            std::fs::write(path, "").unwrap();
            age(path);
        }
        age(living.path());
        remove_left_over(folder.path());
        assert!(!dead.exists() && living.path().exists());
        assert!(others.iter().all(|path| path.exists()));
        // The owner of such a young file may not have locked it yet.
        std::fs::write(&dead, "").unwrap();
        remove_left_over(folder.path());
        assert!(dead.exists());
        test_support::shown!(
            Accidents,
            "A program was killed while it wrote",
            done: "files have random names and are locked; unlocked ones are removed when a project is locked",
        );
    }

    #[cfg(unix)]
    #[test]
    fn links_devices_and_folders_are_not_taken_for_files() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("file"), "text").unwrap();
        symlink(at("file"), at("link")).unwrap();
        symlink("/dev/zero", at("zeros")).unwrap();
        symlink(at("gone"), at("dangling")).unwrap();
        assert!(open(&at("file")).is_ok() && open(&at("link")).is_ok());
        for (path, what) in [(at("zeros"), "device"), (folder.path().into(), "folder")] {
            let said = open(&path).unwrap_err().to_string();
            assert!(said.contains(what), "{said}");
        }
        let mut options = OpenOptions::new();
        options.write(true).create(true).truncate(true);
        for name in ["link", "dangling", "zeros"] {
            let said = open_own(&at(name), &options).unwrap_err().to_string();
            assert!(said.contains("a link"), "{said}");
        }
        assert!(!at("gone").exists());
        assert_eq!(std::fs::read_to_string(at("file")).unwrap(), "text");
        open_own(&at("new"), &options).unwrap();
        // Writing never replaces a device, nor a link to one.
        let device = Path::new("/dev/full");
        for path in [device, &at("zeros"), folder.path()] {
            let before = std::fs::symlink_metadata(path).unwrap().file_type();
            let said = write_beside(path, |_| Ok(())).unwrap_err().to_string();
            assert!(said.contains("this is"), "{said}");
            assert_eq!(std::fs::symlink_metadata(path).unwrap().file_type(), before);
        }
        test_support::shown!(
            Strangers,
            "A picture is a device, a pipe or a folder",
            done: "only files are opened",
        );
        test_support::shown!(
            Surroundings,
            "A picture or report is to be written to a device",
            done: "only files are replaced",
        );
    }

    #[test]
    fn a_text_that_is_too_long_is_refused_unread() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notes.toml");
        std::fs::write(&path, "four").unwrap();
        assert_eq!(read_text(&path, 4).unwrap(), "four");
        let said = read_text(&path, 3).unwrap_err().to_string();
        assert!(said.contains("4 bytes") && said.contains("limit is 3"), "{said}");
        // A sparse file of 64 GB.
        File::create(&path).unwrap().set_len(1 << 36).unwrap();
        assert!(read_text(&path, MOST_TEXT).is_err());
        test_support::shown!(Strangers, "A text file of 64 GB",
            done: "at most 16 MB of a project's text are read");
    }

    #[test]
    fn texts_are_read_as_people_bring_them() {
        let text = "na\u{ef}ve \u{1f4a1}\n1,5\nend";
        let wide = |unit: fn(u16) -> [u8; 2], text: &str| -> Vec<u8> { text.encode_utf16().flat_map(unit).collect() };
        type Bytes = fn(u16) -> [u8; 2];
        let (little, big): (Bytes, Bytes) = (u16::to_le_bytes, u16::to_be_bytes);
        let marked = format!("\u{feff}{text}");
        for (name, bytes) in [
            ("UTF-8", text.as_bytes().to_vec()),
            ("UTF-8 with a mark", marked.clone().into_bytes()),
            ("CRLF", text.replace('\n', "\r\n").into_bytes()),
            ("CR", text.replace('\n', "\r").into_bytes()),
            ("UTF-16 LE with a mark", wide(little, &marked)),
            ("UTF-16 BE with a mark", wide(big, &marked)),
            ("UTF-16 LE", wide(little, text)),
            ("UTF-16 BE", wide(big, text)),
            ("UTF-16 LE with a mark and CRLF", wide(little, &marked.replace('\n', "\r\n"))),
        ] {
            assert_eq!(decoded(bytes).unwrap(), text, "{name}");
        }
        for empty in ["", "\u{feff}"] {
            assert_eq!(decoded(empty.into()).unwrap(), "");
        }
        assert_eq!(decoded(vec![0xff, 0xfe]).unwrap(), "");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dome.lp");
        for (bytes, place) in [
            (&b"caf\xe9 0 0 1"[..], "byte 3, line 1"),
            (b"\xef\xbb\xbfa\r\nb\xff", "byte 7, line 2"),
            (b"a\0\0\0", "byte 1, line 1"),
            (b"\xff\xfea\0\n\0\0\xd8b\0", "byte 6, line 2"),
            (b"\xff\xfea\0b", "byte 4, line 1"),
            // UTF-32.
            (b"\xff\xfe\0\0a\0\0\0", "byte 2, line 1"),
            (b"\x89PNG\r\n", "byte 0, line 1"),
        ] {
            std::fs::write(&path, bytes).unwrap();
            let cause = read_text(&path, MOST_TEXT).unwrap_err();
            let said = Error::io("open", &path, cause, "Choose another").to_string();
            for words in ["dome.lp", "not UTF-8 or UTF-16", place] {
                assert!(said.contains(words), "{said}: {words}");
            }
        }
        std::fs::write(&path, "a\r\nb").unwrap();
        assert_eq!(read_own_text(&path, MOST_TEXT).unwrap(), "a\r\nb");
        std::fs::write(&path, b"ab\xe9").unwrap();
        assert!(read_own_text(&path, MOST_TEXT).unwrap_err().to_string().contains("byte 2"));
        test_support::shown!(
            Strangers,
            "A list or manifest written on another system: UTF-16, a byte-order mark, CR or CRLF",
            done: "all of these are read as one text; anything else is refused with its byte and line",
        );
    }

    #[test]
    fn only_a_name_is_bare() {
        for name in ["weights.bpk", "a b", ".x"] {
            assert!(is_bare(name), "{name}");
        }
        for name in ["", ".", "..", "../x", "/x", "a/b", "a/", "./a", "a\\b"] {
            assert!(!is_bare(name), "{name}");
        }
    }
}
