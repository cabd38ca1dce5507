//! Hashes of files.

use serde::Serialize;
use sha2::digest::Output;
use sha2::{Digest, Sha256, Sha512};
use std::io::Read;
use std::path::Path;

/// A file and its checksum.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FileHash {
    pub name: String,
    pub bytes: u64,
    /// C4 ID of the whole file; "" if the file could not be read.
    pub c4: String,
}

/// Length of a file and its SHA-256 in hexadecimal digits.
///
/// # Errors
/// When the file cannot be read.
pub fn hash_file(path: &Path) -> std::io::Result<(u64, String)> {
    let (bytes, hash) = digest::<Sha256>(path, u64::MAX)?;
    Ok((bytes, hash.iter().flatten().map(|byte| format!("{byte:02x}")).collect()))
}

/// Length of a file and its C4 ID; "" for a file above `most` bytes.
///
/// # Errors
/// When the file cannot be read.
pub(super) fn c4_of_file(path: &Path, most: u64) -> std::io::Result<(u64, String)> {
    let (bytes, hash) = digest::<Sha512>(path, most)?;
    Ok((bytes, hash.map_or(String::new(), c4)))
}

/// Length of a file and its hash. None for a file above `most` bytes.
fn digest<D: Digest>(path: &Path, most: u64) -> std::io::Result<(u64, Option<Output<D>>)> {
    let mut file = base::files::open(path)?;
    let whole = file.metadata()?.len();
    if whole > most {
        return Ok((whole, None));
    }
    let (mut hash, mut length) = (D::new(), 0);
    let mut buffer = vec![0; 1 << 20];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok((length, Some(hash.finalize()))),
            read => {
                hash.update(&buffer[..read]);
                length += read as u64;
            }
        }
    }
}

/// C4 ID of a SHA-512: `c4` and 88 digits in base 58, the highest first (SMPTE ST 2114).
pub(super) fn c4(hash: impl AsRef<[u8]>) -> String {
    const DIGITS: &[u8; 58] = b"123456789ABCDEFGHJKLMNPQRSTUVWXYZabcdefghijkmnopqrstuvwxyz";
    let mut digits = [0u32; 88];
    for byte in hash.as_ref() {
        let mut carry = u32::from(*byte);
        for digit in digits.iter_mut().rev() {
            carry += *digit << 8;
            (*digit, carry) = (carry % 58, carry / 58);
        }
    }
    let digits = digits.iter().map(|digit| char::from(DIGITS[*digit as usize]));
    "c4".chars().chain(digits).collect()
}
