//! Paths of test data. Each crate's tests run in that crate's folder, so paths start at the repository's root.

use super::need::{Need, found};
use std::path::{Path, PathBuf};

/// A file or folder of the repository, such as `tests/peers/unet.py`.
pub fn repository(path: impl AsRef<Path>) -> PathBuf {
    // Cargo sets the variable for tests; a test started by hand uses the current folder.
    let package = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    let package = package.unwrap_or_else(|| std::env::current_dir().expect("a working folder"));
    root(&package).join(path)
}

/// A file or folder of the shared data beside the repository, such as `data/stage`; None if it is missing, and the test
/// returns.
pub fn shared(path: impl AsRef<Path>) -> Option<PathBuf> {
    let path = repository("../shared").join(path);
    let missing = format!("{} is missing", path.display());
    found(Need::SharedData, path.exists().then_some(path).ok_or(missing))
}

/// The folder with the lock file, searched upwards from one of its packages.
fn root(package: &Path) -> &Path {
    let root = package.ancestors().find(|at| at.join("Cargo.lock").exists());
    root.unwrap_or_else(|| panic!("no Cargo.lock in or above {}", package.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_repository_is_found_from_any_package() {
        let folder = tempfile::tempdir().unwrap();
        let package = folder.path().join("src/light");
        std::fs::create_dir_all(&package).unwrap();
        std::fs::write(folder.path().join("Cargo.lock"), "").unwrap();
        assert_eq!(root(&package), folder.path());
        assert_eq!(root(folder.path()), folder.path());
        assert!(repository("tests/support/src/paths.rs").is_file());
        assert!(repository("shaders").is_dir());
    }
}
