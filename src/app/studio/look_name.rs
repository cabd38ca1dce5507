//! Name of a stored look, which is also the name of its folder: valid on every disk.

use base::error::{Error, Result};

/// Most characters and most bytes of a name. File systems allow 255.
const MOST: usize = 60;
const MOST_BYTES: usize = 200;
/// Characters reserved by some file system.
const FORBIDDEN: [char; 9] = ['/', '\\', ':', '*', '?', '"', '<', '>', '|'];
/// Reserved device names on Windows, with any extension.
const DEVICES: [&str; 4] = ["con", "prn", "aux", "nul"];

/// A name that is valid for a folder on every system.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LookName(String);

impl LookName {
    /// Parses a typed name; spaces around it are removed.
    ///
    /// # Errors
    /// The reason, if the name is not valid for a folder.
    pub fn new(typed: &str) -> Result<Self> {
        let name = typed.trim();
        let refuse = |problem: String| Err(Error::invalid(problem, "Choose another name"));
        if name.is_empty() {
            return refuse("a look needs a name".to_owned());
        }
        if !is_short(name) {
            return refuse(format!("a look's name has at most {MOST} characters"));
        }
        let is_forbidden = |c: &char| FORBIDDEN.contains(c) || c.is_control();
        if let Some(c) = name.chars().find(is_forbidden) {
            let shown = c.escape_default();
            return refuse(format!("a look's name cannot have {shown} in it"));
        }
        if name.starts_with('.') || name.ends_with('.') {
            return refuse("a look's name cannot start or end with a dot".to_owned());
        }
        let stem = name.split('.').next().unwrap_or(name).trim().to_lowercase();
        let is_port = |kind: &str| {
            let number = stem.strip_prefix(kind);
            number.is_some_and(|n| n.len() == 1 && n.bytes().all(|b| b.is_ascii_digit()))
        };
        if DEVICES.contains(&stem.as_str()) || is_port("com") || is_port("lpt") {
            return refuse(format!("{name} is a reserved device name on some systems"));
        }
        Ok(Self(name.to_owned()))
    }

    /// The name itself.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// True if some disk would treat both as one name: case is ignored.
    pub fn is_like(&self, other: &Self) -> bool {
        self.0.to_lowercase() == other.0.to_lowercase()
    }

    /// This name, or the first of "NAME 2", "NAME 3"… that is not in `taken`. A long name is shortened to fit the
    /// number.
    pub fn free(&self, taken: &[Self]) -> Self {
        let numbered = (2..).map(|number| self.numbered(number));
        let mut all = std::iter::once(self.clone()).chain(numbered);
        let free = all.find(|name| !taken.iter().any(|one| one.is_like(name)));
        // The numbers are unbounded.
        free.unwrap_or_else(|| self.clone())
    }

    fn numbered(&self, number: u32) -> Self {
        let mut stem = self.0.clone();
        loop {
            let name = format!("{} {number}", stem.trim_end());
            if is_short(&name) {
                return Self(name);
            }
            stem.pop();
        }
    }
}

fn is_short(name: &str) -> bool {
    name.chars().count() <= MOST && name.len() <= MOST_BYTES
}

impl std::fmt::Display for LookName {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_what_a_folder_can_be_called_everywhere() {
        for (typed, name) in [
            ("Warm key", "Warm key"),
            ("  Nacht 3 ", "Nacht 3"),
            ("Überblendung & co.x", "Überblendung & co.x"),
            ("console", "console"),
            ("夜", "夜"),
        ] {
            assert_eq!(LookName::new(typed).unwrap().text(), name);
        }
        let long = "x".repeat(MOST + 1);
        for typed in [
            "",
            "  ",
            ".",
            "..",
            ".hidden",
            "end.",
            "a/b",
            "..\\up",
            "a\0b",
            "line\nbreak",
            "C:",
            "what?",
            "nul",
            "COM1",
            "aux.json",
            &long,
        ] {
            let said = LookName::new(typed).unwrap_err().to_string();
            assert!(said.contains("name"), "{typed}: {said}");
        }
        // 60 characters of 4 bytes each.
        assert!(LookName::new(&"🌙".repeat(MOST)).is_err());
    }

    #[test]
    fn a_free_name_differs_by_more_than_its_case() {
        let names = ["Warm", "warm 2"].map(|name| LookName::new(name).unwrap());
        let free = LookName::new("WARM").unwrap().free(&names);
        assert_eq!(free.text(), "WARM 3");
        let other = LookName::new("cold").unwrap();
        assert_eq!(other.free(&names), other);
    }

    #[test]
    fn a_number_fits_behind_the_longest_name() {
        // The shortened name has no space before the number.
        let all = ["x".repeat(MOST), format!("{} z", "x".repeat(MOST - 2)), "🌙".repeat(MOST_BYTES / 4)];
        for long in all {
            let long = LookName::new(&long).unwrap();
            let free = long.free(std::slice::from_ref(&long));
            assert_eq!(LookName::new(free.text()).unwrap(), free);
            assert!(free.text().ends_with("x 2") || free.text().ends_with("🌙 2"));
        }
    }
}
