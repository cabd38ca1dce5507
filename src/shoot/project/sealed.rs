//! Sealed tables: TOML files whose first line, a comment, holds a checksum of the rest.

use base::error::{Error, Remedy, Result};
use base::files::{self, write_beside};
use serde::Serialize;
use std::io::Write;
use std::path::Path;

/// Start of the first line; the CRC-32 in hexadecimal digits follows.
const SEAL: &str = "# Not to be changed by hand: checksum ";

/// Writes `value` as TOML beside `path`, with its checksum, and renames it.
///
/// # Errors
/// When the file cannot be written.
pub fn save_sealed(path: &Path, value: &impl Serialize) -> Result<()> {
    let text =
        toml::to_string_pretty(value).map_err(|e| Error::bug(format!("cannot write {}: {e}", path.display())))?;
    let sum = crc32fast::hash(text.as_bytes());
    write_beside(path, |out| write!(out, "{SEAL}{sum:08x}\n{text}"))
}

/// The text of a file that [`save_sealed`] wrote. Files of older versions have no checksum.
///
/// # Errors
/// When it cannot be read, or its checksum does not match; with `remedy`.
pub fn read_sealed(path: &Path, remedy: impl Into<Remedy>) -> Result<String> {
    let remedy = remedy.into();
    let text = match files::read_own_text(path, files::MOST_TEXT) {
        Ok(text) => text,
        Err(e) => return Err(Error::io("open", path, e, remedy)),
    };
    let sealed = (text.strip_prefix(SEAL)).and_then(|rest| rest.split_once('\n'));
    if let Some((sum, rest)) = sealed
        && sum != format!("{:08x}", crc32fast::hash(rest.as_bytes()))
    {
        let problem = "checksum mismatch: damaged, or edited by hand";
        return Err(Error::codec("read", path, problem, remedy));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_with_one_other_byte_is_refused_and_one_without_checksum_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.toml");
        save_sealed(&path, &toml::Table::from_iter([("lamps".to_owned(), 41.into())])).unwrap();
        let read = || read_sealed(&path, "Make it again");
        let text = read().unwrap();
        let table: toml::Table = toml::from_str(&text).unwrap();
        assert_eq!(table["lamps"].as_integer(), Some(41));
        let start = text.find('\n').unwrap();
        for at in start + 1..text.len() {
            let mut bytes = text.clone().into_bytes();
            bytes[at] ^= 1;
            std::fs::write(&path, bytes).unwrap();
            let said = read().unwrap_err().to_string();
            let names = ["table.toml", "checksum", "Make it again"];
            assert!(names.iter().all(|name| said.contains(name)), "{said}");
        }
        std::fs::write(&path, "lamps = 41").unwrap();
        assert_eq!(read().unwrap(), "lamps = 41");
        test_support::shown!(
            Strangers,
            "One byte of `calibration.toml` changes on the disk",
            done: "the table's first line holds a checksum of the rest",
        );
    }
}
