//! A reviewer's verdicts and notes on lamps and frames, in the project's `review.toml`.

use base::error::{Error, Result};
use base::files;
use project::{Project, save_toml};
use serde::{Deserialize, Serialize};

/// Format version of `review.toml`.
const FORMAT: u32 = 1;

/// A verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mark {
    Bad,
    Doubtful,
    Good,
}

impl Mark {
    pub const ALL: [Self; 3] = [Self::Good, Self::Doubtful, Self::Bad];

    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Doubtful => "doubtful",
            Self::Bad => "bad",
        }
    }
}

/// A verdict or note on one lamp in one frame or pose. They are identified by file name, so that marks survive a
/// repeated import.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MarkedOlat {
    pub case: String,
    pub lamp: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mark: Option<Mark>,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// Entries of a later version, preserved.
    #[serde(flatten)]
    other: toml::Table,
}

/// All marks of a project.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Marks {
    format: u32,
    #[serde(default)]
    cells: Vec<MarkedOlat>,
    /// Entries of a later version, preserved.
    #[serde(flatten)]
    other: toml::Table,
}

impl Default for Marks {
    fn default() -> Self {
        Self { format: FORMAT, cells: Vec::new(), other: toml::Table::new() }
    }
}

impl MarkedOlat {
    /// A verdict and a note on a lamp in a frame or pose.
    pub fn new(case: &str, lamp: &str, mark: Option<Mark>, note: &str) -> Self {
        Self { case: case.to_owned(), lamp: lamp.to_owned(), mark, note: note.to_owned(), other: toml::Table::new() }
    }
}

impl Marks {
    /// Reads the project's marks; none without a file.
    ///
    /// # Errors
    /// When the file cannot be read, is damaged, or has another format version.
    pub fn load(project: &Project) -> Result<Self> {
        let path = project.marks_path();
        let text = match files::read_text(&path, files::MOST_TEXT) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(e) => return Err(Error::io("open", path, e, "Check that it can be read")),
        };
        let marks: Self = toml::from_str(&text).map_err(|e| {
            let remedy = "Correct the line, or move the file away to start with no marks";
            Error::codec("read", &path, e.message().trim(), remedy)
        })?;
        if marks.format != FORMAT {
            return Err(Error::invalid(
                format!(
                    "{} has format {}, but this version of Afterlight reads format {FORMAT}",
                    path.display(),
                    marks.format
                ),
                "Open it with the version of Afterlight that wrote it",
            ));
        }
        Ok(marks)
    }

    /// Writes the marks into the project.
    pub fn save(&self, project: &Project) -> Result<()> {
        save_toml(&project.marks_path(), self)
    }

    /// All marks, in the order in which they were first set.
    pub fn all(&self) -> &[MarkedOlat] {
        &self.cells
    }

    /// Mark of a lamp in a frame or pose.
    pub fn get(&self, case: &str, lamp: &str) -> Option<&MarkedOlat> {
        self.cells.iter().find(|m| m.case == case && m.lamp == lamp)
    }

    /// Sets verdict and note; without either, removes the mark.
    pub fn set(&mut self, marked: MarkedOlat) {
        let same = |m: &MarkedOlat| m.case == marked.case && m.lamp == marked.lamp;
        match self.cells.iter().position(same) {
            Some(place) if marked.mark.is_none() && marked.note.is_empty() => {
                self.cells.remove(place);
            }
            Some(place) => {
                self.cells[place].mark = marked.mark;
                self.cells[place].note = marked.note;
            }
            None if marked.mark.is_none() && marked.note.is_empty() => {}
            None => self.cells.push(marked),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_come_back_and_what_is_not_known_stays() {
        let folder = tempfile::tempdir().unwrap();
        let project = project::Project::without_shoot(folder.path());
        assert_eq!(Marks::load(&project).unwrap(), Marks::default());
        let text = "format = 1\nauthor = \"later\"\n[[cells]]\ncase = \"frame_005\"\nlamp = \"olat_01\"\n\
                    mark = \"bad\"\nstamp = 12\n";
        std::fs::write(project.marks_path(), text).unwrap();
        let mut marks = Marks::load(&project).unwrap();
        assert_eq!(marks.get("frame_005", "olat_01").unwrap().mark, Some(Mark::Bad));
        assert_eq!(marks.get("frame_005", "olat_02"), None);
        let note = "a \"hard\" edge\nunder <the> chin";
        marks.set(MarkedOlat::new("frame_005", "olat_01", Some(Mark::Doubtful), note));
        marks.set(MarkedOlat::new("pose02", "olat_00", None, "fine"));
        marks.set(MarkedOlat::new("pose02", "olat_01", None, ""));
        marks.save(&project).unwrap();
        let text = std::fs::read_to_string(project.marks_path()).unwrap();
        assert!(text.contains("author = \"later\"") && text.contains("stamp = 12"), "{text}");
        let again = Marks::load(&project).unwrap();
        assert_eq!(again, marks);
        assert_eq!(again.all().len(), 2);
        assert_eq!(again.get("frame_005", "olat_01").unwrap().note, note);
        marks.set(MarkedOlat::new("pose02", "olat_00", None, ""));
        assert_eq!(marks.all().len(), 1);
    }

    #[test]
    fn a_file_that_is_not_understood_is_named_with_a_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let project = project::Project::without_shoot(folder.path());
        for text in [
            "format = 2",
            "format = 1\ncells = 3",
            "[[",
            "format = 1\n[[cells]]\nlamp = \"a\"\ncase = \"b\"\nmark = \"lovely\"",
        ] {
            std::fs::write(project.marks_path(), text).unwrap();
            let refused = Marks::load(&project).unwrap_err().to_string();
            assert!(refused.contains("review.toml"), "{refused}");
        }
    }
}
