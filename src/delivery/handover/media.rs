//! Exported files as names with a frame number.

use base::error::{Error, Result};
use export::Destination;
use std::path::{Path, PathBuf};

/// Exported files.
#[derive(Clone, Debug, PartialEq)]
pub enum Media {
    Movie(PathBuf),
    Stills(Stills),
}

/// One file per frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Stills {
    /// Absolute path.
    pub folder: PathBuf,
    /// Name before the frame number; the whole name without one.
    pub before: String,
    /// Least number of digits; None for a single still without a number.
    pub digits: Option<usize>,
    /// Name after the frame number.
    pub after: String,
}

impl Media {
    /// Files of an export to `to`. `program` appears in messages.
    ///
    /// # Errors
    /// When the frame number is in a folder's name.
    pub fn new(to: &Destination, program: &str) -> Result<Self> {
        let absolute =
            |path: &Path| std::path::absolute(path).map_err(|e| Error::io("find", path, e, "Give a full path"));
        let (before, digits, after) = match to {
            Destination::Clip(path) => return Ok(Self::Movie(absolute(path)?)),
            Destination::Stills(stills) => stills.parts(),
        };
        if after.contains(std::path::is_separator) {
            return Err(Error::invalid(
                format!("{program} cannot find frames in {to}: its folders are numbered"),
                "Number only the files, such as shot/shot.%04d.exr",
            ));
        }
        let cut = before.rfind(std::path::is_separator).map_or(0, |at| at + 1);
        let (folder, before) = before.split_at(cut);
        Ok(Self::Stills(Stills {
            folder: absolute(Path::new(if folder.is_empty() { "." } else { folder }))?,
            before: before.to_owned(),
            digits,
            after: after.to_owned(),
        }))
    }

    /// Folder of the files.
    pub fn folder(&self) -> &Path {
        match self {
            Self::Movie(path) => path.parent().unwrap_or(Path::new("/")),
            Self::Stills(stills) => &stills.folder,
        }
    }

    /// Name of the shot: the file's name without number and extension.
    pub fn shot_name(&self) -> String {
        let name = match self {
            Self::Movie(path) => path.file_stem().map(|s| s.to_string_lossy().into_owned()),
            Self::Stills(stills) if stills.digits.is_some() => Some(stills.before.clone()),
            Self::Stills(stills) => Path::new(&stills.before).file_stem().map(|s| s.to_string_lossy().into_owned()),
        };
        let name = name.unwrap_or_default();
        match name.trim_end_matches(['.', '_', '-', ' ']) {
            "" => "shot".to_owned(),
            name => name.to_owned(),
        }
    }
}

impl Stills {
    /// File name with the number `number`.
    pub fn name(&self, number: i64) -> String {
        let number = self.digits.map_or(String::new(), |digits| format!("{number:0digits$}"));
        format!("{}{number}{}", self.before, self.after)
    }

    /// Names of further files per frame, given the name `name` for the number `number`.
    pub fn like(&self, name: &str, number: i64) -> Self {
        let Some(digits) = self.digits else {
            return Self { before: name.to_owned(), ..self.clone() };
        };
        let number = format!("{number:0digits$}");
        let picture = format!("{}{number}", self.before);
        let (before, after) = match name.strip_prefix(&picture) {
            Some(after) => (self.before.as_str(), after),
            None => {
                let dot = name.rfind('.').unwrap_or(name.len());
                let (stem, ending) = name.split_at(dot);
                (stem.strip_suffix(&number).unwrap_or(stem), ending)
            }
        };
        Self { before: before.to_owned(), after: after.to_owned(), ..self.clone() }
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Files of an export to `to`.
    pub fn media(to: &str) -> Media {
        Media::new(&Destination::parse(to).unwrap(), "Nuke").unwrap()
    }

    fn stills(to: &str) -> Stills {
        match media(to) {
            Media::Stills(stills) => stills,
            Media::Movie(path) => panic!("{} is a movie", path.display()),
        }
    }

    #[test]
    fn names_are_cut_at_the_frame_number() {
        let shot = stills("a b/it's 100%% \"x\".%04d.exr");
        assert!(shot.folder.is_absolute() && shot.folder.ends_with("a b"));
        assert_eq!(shot.name(7), "it's 100% \"x\".0007.exr");
        assert_eq!(shot.name(4_320_000), "it's 100% \"x\".4320000.exr");
        let name = |to: &str| media(to).shot_name();
        assert_eq!(name("a b/it's 100%%.%04d.exr"), "it's 100%");
        assert_eq!(name("é/Ünïcode_%d.exr"), "Ünïcode");
        assert_eq!(name("%04d.exr"), "shot");
        assert_eq!(name("one.exr"), "one");
        assert_eq!(name("a/clip 1.mov"), "clip 1");
    }

    #[test]
    fn a_layers_files_are_numbered_like_the_pictures() {
        for to in ["shot.%04d.exr", "shot%d.exr", "%02d.exr", "shot.%03d.a.exr"] {
            let shot = stills(to);
            let layer = |frame: i64| {
                let path = export::beside(Path::new(&shot.name(frame)), "light_07");
                path.to_str().unwrap().to_owned()
            };
            let files = shot.like(&layer(7), 7);
            for frame in [0, 7, 70, 12_345] {
                assert_eq!(files.name(frame), layer(frame), "{to}");
            }
        }
        let one = stills("one.exr");
        assert_eq!(one.like("one.light_00.exr", 7).name(7), "one.light_00.exr");
    }

    #[test]
    fn numbered_folders_are_refused_in_a_sentence() {
        let numbered = Destination::parse("a/%d/b.exr").unwrap();
        let error = Media::new(&numbered, "Nuke").unwrap_err().to_string();
        assert!(error.contains("folders are numbered"), "{error}");
    }
}
