//! Build of the measuring program: figures of two builds may differ because of the code.

use std::io::Read;
use std::path::Path;
use std::sync::OnceLock;

/// Identifies the running build as [`build_of`] does; `unknown` if its file cannot be read.
pub fn build() -> &'static str {
    static BUILD: OnceLock<String> = OnceLock::new();
    BUILD.get_or_init(|| {
        let found = std::env::current_exe().and_then(|program| build_of(&program));
        found.unwrap_or_else(|_| "unknown".to_owned())
    })
}

/// Identifies a program's build: the CRC-32 of its file in eight hexadecimal digits.
///
/// # Errors
/// When the file cannot be read.
pub fn build_of(program: &Path) -> std::io::Result<String> {
    let mut file = base::files::open(program)?;
    let (mut hash, mut part) = (crc32fast::Hasher::new(), vec![0; 1 << 20]);
    loop {
        match file.read(&mut part)? {
            0 => return Ok(format!("{:08x}", hash.finalize())),
            count => hash.update(&part[..count]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_build_is_named_by_its_file() {
        let bytes = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        assert_eq!(build(), format!("{:08x}", crc32fast::hash(&bytes)));
    }
}
