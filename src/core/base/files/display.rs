//! Paths for display.

use std::path::{Component, Path, PathBuf};

/// A path for display: without `.`, and with `..` resolved. It may lead elsewhere where links are on its way, so
/// do not open it.
pub fn shown(path: &Path) -> String {
    let mut plain = PathBuf::new();
    for part in path.components() {
        let is_left = matches!(plain.components().next_back(), Some(Component::Normal(_)));
        match part {
            Component::CurDir => {}
            Component::ParentDir if is_left => drop(plain.pop()),
            part => plain.push(part),
        }
    }
    plain.display().to_string()
}

/// A path for display and use: with `..` resolved where that leads to the same file, otherwise unchanged.
pub fn plain(path: &Path) -> String {
    let place = |path: &Path| {
        let mut folders = path.ancestors();
        folders.find_map(|folder| folder.canonicalize().ok())
    };
    let plain = shown(path);
    if place(path) == place(Path::new(&plain)) { plain } else { path.display().to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_read_without_detours() {
        for (path, read) in [
            ("/film/project/../shoot/", "/film/shoot"),
            ("film/./a.exr", "film/a.exr"),
            ("../shoot/x/../../y", "../y"),
            ("/..", "/.."),
            ("..", ".."),
        ] {
            assert_eq!(shown(Path::new(path)), read, "{path}");
        }
    }
}
