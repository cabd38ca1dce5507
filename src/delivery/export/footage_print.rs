//! Fingerprint of the footage's files: their length and a checksum of their content. Folder and time of change do not
//! count: a copy on another machine is the same footage.

use base::files::open;
use movies::Source;
use project::Picture;
use std::collections::HashMap;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Files up to this many bytes are read completely. Of longer files (movies) this many bytes are read in evenly spaced
/// pieces: reading hours of footage before a job takes too long.
const MOST_WHOLE: u64 = 256 << 20;
const PIECES: u64 = 64;
const PIECE: u64 = 64 << 10;

/// Fingerprints of files, each read once if frames share it.
#[derive(Debug, Default)]
pub(super) struct FootagePrints {
    files: Mutex<HashMap<PathBuf, String>>,
}

impl FootagePrints {
    /// Fingerprint of a picture: its frame and the fingerprint of its file; "missing" if the file cannot be read.
    pub fn picture_print(&self, picture: &Picture) -> String {
        match picture {
            Picture::File(file) => self.file_print(file),
            Picture::Movie { file, frame } => match movies::open(file).as_deref() {
                Ok(Source::Sequence(sequence)) => {
                    sequence.file(*frame).map_or_else(missing, |file| print_or_missing(&file))
                }
                Ok(Source::Movie(_)) => format!("{frame} of {}", self.file_print(file)),
                Err(_) => missing(),
            },
            Picture::Mirrored(picture, axis) => {
                format!("{axis:?} of {}", self.picture_print(picture))
            }
        }
    }

    fn file_print(&self, file: &Path) -> String {
        let mut known = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(print) = known.get(file) {
            return print.clone();
        }
        let print = print_or_missing(file);
        known.insert(file.to_path_buf(), print.clone());
        print
    }
}

fn print_or_missing(file: &Path) -> String {
    footage_print(file).unwrap_or_else(|_| missing())
}

fn missing() -> String {
    "missing".to_owned()
}

/// Length and CRC-32 of a footage file, in hexadecimal digits. Of a file above 256 MiB, 64 pieces of 64 KiB are read, evenly
/// spaced from its first byte to its last.
///
/// # Errors
/// When the file cannot be read.
pub fn footage_print(file: &Path) -> io::Result<String> {
    let mut file = open(file)?;
    let length = file.metadata()?.len();
    let mut sum = crc32fast::Hasher::new();
    let mut piece = vec![0; PIECE as usize];
    if length <= MOST_WHOLE {
        loop {
            match file.read(&mut piece)? {
                0 => break,
                read => sum.update(&piece[..read]),
            }
        }
    } else {
        for number in 0..PIECES {
            let start = (u128::from(length - PIECE) * u128::from(number) / u128::from(PIECES - 1)) as u64;
            file.seek(SeekFrom::Start(start))?;
            file.read_exact(&mut piece)?;
            sum.update(&piece);
        }
    }
    Ok(format!("{length:x}-{:08x}", sum.finalize()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_copy_of_another_time_is_the_same_and_one_other_byte_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let [here, there] = ["a.png", "b/a.png"].map(|name| folder.path().join(name));
        std::fs::create_dir(folder.path().join("b")).unwrap();
        std::fs::write(&here, vec![7; 200_000]).unwrap();
        std::fs::copy(&here, &there).unwrap();
        let file = std::fs::File::options().write(true).open(&there).unwrap();
        file.set_modified(std::time::UNIX_EPOCH).unwrap();
        let print = |path: &Path| FootagePrints::default().picture_print(&Picture::File(path.to_path_buf()));
        assert_eq!(print(&here), print(&there));
        let mut bytes = vec![7; 200_000];
        bytes[123_456] = 8;
        std::fs::write(&there, bytes).unwrap();
        assert_ne!(print(&here), print(&there));
        assert_eq!(print(&folder.path().join("none.png")), "missing");
    }

    #[test]
    fn of_a_long_movie_both_ends_and_pieces_between_count() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.mov");
        let mut file = std::fs::File::create(&path).unwrap();
        // Holes take no disk space.
        let length = MOST_WHOLE + 12_345;
        file.set_len(length).unwrap();
        let mut seen = vec![footage_print(&path).unwrap()];
        for at in [0, (length - PIECE) / (PIECES - 1), length - 1] {
            file.seek(SeekFrom::Start(at)).unwrap();
            file.write_all(&[1]).unwrap();
            let print = footage_print(&path).unwrap();
            assert!(!seen.contains(&print), "the byte at {at}");
            seen.push(print);
        }
    }
}
