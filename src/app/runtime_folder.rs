//! `XDG_RUNTIME_DIR`, the folder of a session's sockets. Without it, as in a container or after `su`, Mesa's
//! Vulkan layer prints an error each time that adapters are listed, for it looks there for a display.

use std::ffi::OsStr;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

const NAME: &str = "XDG_RUNTIME_DIR";

/// Names a folder where the session names none: the one that this person's sessions have, else a private one of
/// Afterlight's. To be called before any thread is started.
pub fn name() {
    if is_valid(std::env::var_os(NAME).as_deref()) {
        return;
    }
    let folder = session().unwrap_or_else(own);
    // SAFETY: this is the start of `main`: no other thread is there to read the environment.
    #[allow(unsafe_code)]
    unsafe {
        std::env::set_var(NAME, folder);
    }
}

/// True if libraries accept it: they want an absolute path.
fn is_valid(folder: Option<&OsStr>) -> bool {
    folder.is_some_and(|folder| Path::new(folder).is_absolute())
}

/// The folder that the system made for this person's sessions.
fn session() -> Option<PathBuf> {
    let person = std::fs::metadata("/proc/self").ok()?.uid();
    let folder = Path::new("/run/user").join(person.to_string());
    let found = std::fs::symlink_metadata(&folder).ok()?;
    (found.is_dir() && found.uid() == person).then_some(folder)
}

/// A folder that only this person may enter. Where it cannot be made it is named all the same: nothing is
/// found there, which is the truth.
fn own() -> PathBuf {
    let cache = dirs::cache_dir().unwrap_or_else(|| "/nonexistent".into());
    let folder = cache.join("afterlight").join("runtime");
    let _ = std::fs::DirBuilder::new().recursive(true).mode(0o700).create(&folder);
    folder
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_an_absolute_path_names_a_folder() {
        for (folder, valid) in [(None, false), (Some(""), false), (Some("run"), false), (Some("/run/user/7"), true)] {
            assert_eq!(is_valid(folder.map(OsStr::new)), valid, "{folder:?}");
        }
    }
}
