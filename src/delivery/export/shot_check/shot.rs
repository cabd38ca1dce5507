//! Files of a shot.

use super::super::destination::Destination;
use super::super::layers::beside;
use base::error::{Error, Result};
use base::has_extension;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const REMEDY: &str = "Name the frames of one shot, their folder, or a pattern such as shot.%04d.exr or shot.####.exr";
/// Ending of files that an export is writing, or left behind when it was killed.
const UNFINISHED: &str = ".afterlight";

/// Frames of a shot: files in one folder.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shot {
    pub folder: PathBuf,
    /// Frame numbers and file names, in order. A number may occur twice.
    pub files: Vec<(i64, String)>,
    /// File names with `####` for the number.
    pub pattern: String,
    /// True if the names have numbers; otherwise frames are counted from 0.
    pub numbered: bool,
    /// Unfinished files of the same shot.
    pub unfinished: Vec<String>,
}

/// Text before and after a frame number.
type Around = (String, String);

impl Shot {
    /// Finds a shot by several files, a folder, or a pattern.
    ///
    /// # Errors
    /// When no such files exist, or they belong to several shots.
    pub fn find(named: &[PathBuf]) -> Result<Self> {
        let missing =
            |path: &Path, what: &str| Error::missing(format!("there is no {what} {}", path.display()), REMEDY);
        let Some(first) = named.first() else { return Err(Error::missing("no file was given", REMEDY)) };
        let names: Vec<String>;
        let folder: PathBuf;
        let mut wanted = None;
        if named.len() == 1 && !first.is_file() {
            if first.is_dir() {
                folder = first.clone();
            } else {
                folder = folder_of(first);
                let pattern = (first.file_name().and_then(|name| name.to_str())).and_then(split);
                wanted = Some(pattern.ok_or_else(|| missing(first, "picture"))?);
            }
            names = list(&folder)?;
        } else {
            folder = folder_of(first);
            if let Some(other) = named.iter().find(|path| folder_of(path) != folder) {
                return Err(Error::invalid(
                    format!("{} and {} are in different folders", first.display(), other.display()),
                    "The frames of a shot share one folder: check one folder at a time",
                ));
            }
            if let Some(gone) = named.iter().find(|path| !path.is_file()) {
                return Err(missing(gone, "picture"));
            }
            let name = |path: &PathBuf| path.file_name()?.to_str().map(str::to_owned);
            names = named.iter().filter_map(name).collect();
        }
        let unfinished = names.iter().filter(|name| name.ends_with(UNFINISHED));
        let unfinished: Vec<String> = unfinished.cloned().collect();
        let pictures: BTreeSet<&str> = names.iter().map(String::as_str).filter(is_exr).collect();
        let mut shots: BTreeMap<Around, Vec<(i64, String)>> = BTreeMap::new();
        let mut plain = Vec::new();
        for name in pictures.iter().filter(|name| !is_layer(name, &pictures)) {
            let found = match &wanted {
                Some(pattern) => between(name, pattern).map(|number| (pattern.clone(), number)),
                None => numbered(name),
            };
            match found {
                Some((around, number)) => shots.entry(around).or_default().push((number, (*name).to_owned())),
                None if wanted.is_none() => plain.push((*name).to_owned()),
                None => (),
            }
        }
        // Names that differ only in the number are a shot; a single file without a number is one, too.
        let of_one = match (shots.len(), plain.len()) {
            (1, 0) | (0, 1) => true,
            (0, 0) => return Err(missing(first, "picture of a shot")),
            _ => false,
        };
        if !of_one {
            let shots = shots.keys().map(|(before, after)| format!("{before}####{after}"));
            let all: Vec<String> = shots.chain(plain).take(8).collect();
            return Err(Error::invalid(
                format!("{} has several shots: {}", folder.display(), all.join(", ")),
                "Name one of them",
            ));
        }
        let Some(((before, after), mut files)) = shots.pop_first() else {
            let files: Vec<_> = (0..).zip(plain).collect();
            return Ok(Self { folder, pattern: files[0].1.clone(), files, numbered: false, unfinished: Vec::new() });
        };
        files.sort();
        Ok(Self {
            folder,
            files,
            numbered: true,
            unfinished: (unfinished.into_iter())
                .filter(|name| name.strip_prefix('.').is_some_and(|name| name.starts_with(&before)))
                .collect(),
            pattern: format!("{before}####{after}"),
        })
    }

    /// Path of a file.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }
}

/// True if an address names frames of a shot and not a project: an EXR, a pattern of EXRs, or a folder of EXRs that is not
/// a project.
pub fn names_frames(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if path.is_dir() {
        !path.join("project.toml").exists() && list(path).is_ok_and(|names| names.iter().any(|name| is_exr(&&**name)))
    } else {
        is_exr(&&*name)
    }
}

/// Folder of a file.
fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => ".".into(),
    }
}

fn list(folder: &Path) -> Result<Vec<String>> {
    let fail = |e| Error::io("read", folder, e, "Check that the folder exists and can be read");
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        names.extend(entry.map_err(fail)?.file_name().into_string().ok());
    }
    Ok(names)
}

fn is_exr(name: &&str) -> bool {
    !name.starts_with('.') && has_extension(Path::new(name), "exr")
}

/// Text before and after the number in a pattern such as `shot.%04d.exr` or `shot.####.exr`.
fn split(pattern: &str) -> Option<Around> {
    if let Ok(Destination::Stills(stills)) = Destination::parse(pattern)
        && let (before, Some(_), after) = stills.parts()
    {
        return Some((before.to_owned(), after.to_owned()));
    }
    let (before, rest) = pattern.split_once('#')?;
    Some((before.to_owned(), rest.trim_start_matches('#').to_owned()))
}

/// Frame number in a name that matches this pattern.
fn between(name: &str, (before, after): &Around) -> Option<i64> {
    let number = name.strip_prefix(&**before)?.strip_suffix(&**after)?;
    let digits = number.strip_prefix('-').filter(|_| takes_sign(before)).unwrap_or(number);
    // `parse` accepts a sign, too.
    let is_number = digits.bytes().all(|b| b.is_ascii_digit());
    is_number.then(|| number.parse().ok()).flatten()
}

/// True if a hyphen after this text is the sign of a number: at the start, and after a dot or underscore.
fn takes_sign(before: &str) -> bool {
    before.is_empty() || before.ends_with(['.', '_'])
}

/// Last number in a file name.
pub(super) fn frame_number(name: &str) -> Option<i64> {
    numbered(name).map(|(_, number)| number)
}

/// Last number in a name, with the text before and after it.
fn numbered(name: &str) -> Option<(Around, i64)> {
    let (stem, _) = name.rsplit_once('.')?;
    let before = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    let digits = &stem[before.len()..];
    let unsigned = before.strip_suffix('-').filter(|before| !digits.is_empty() && takes_sign(before));
    let before = unsigned.unwrap_or(before);
    let number = stem[before.len()..].parse().ok()?;
    Some(((before.to_owned(), name[stem.len()..].to_owned()), number))
}

/// True if a file is a light layer of another file of the shot.
fn is_layer(name: &str, all: &BTreeSet<&str>) -> bool {
    let mut words = name.split(['.', '_', '-']);
    let is_rest = words.any(|word| word == "rest");
    let layers = name.match_indices("light_").map(|(at, light)| {
        let digits = name[at + light.len()..].bytes();
        let digits = digits.take_while(u8::is_ascii_digit).count();
        &name[at..at + light.len() + digits]
    });
    layers.chain(is_rest.then_some("rest")).any(|layer| {
        let pieces = name.match_indices(layer).map(|(at, _)| {
            let (before, after) = (&name[..at], &name[at + layer.len()..]);
            [format!("{}{after}", before.trim_end_matches('.')), format!("{before}{after}")]
        });
        pieces.flatten().any(|picture| all.contains(&*picture) && beside(Path::new(&picture), layer) == Path::new(name))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(folder: &Path, named: &[&str]) -> Result<Shot> {
        let named: Vec<PathBuf> = named.iter().map(|name| folder.join(name)).collect();
        Shot::find(&named)
    }

    #[test]
    fn a_shot_is_found_by_its_folder_its_pattern_or_its_files() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        for name in [
            "shot.0009.exr",
            "shot.0010.exr",
            "shot.light_00.0009.exr",
            "shot.light_00.0010.exr",
            "shot.rest.0009.exr",
            "shot.0009.json",
            ".shot.0011.exr.a1b2c3.afterlight",
            "notes.txt",
        ] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        let whole = found(folder, &[""]).unwrap();
        assert_eq!(whole.files, [(9, "shot.0009.exr".to_owned()), (10, "shot.0010.exr".to_owned())]);
        assert_eq!((&*whole.pattern, whole.numbered), ("shot.####.exr", true));
        assert_eq!(whole.unfinished.len(), 1);
        for pattern in ["shot.%04d.exr", "shot.####.exr", "shot.%d.exr"] {
            assert_eq!(found(folder, &[pattern]).unwrap().files, whole.files);
        }
        let one = found(folder, &["shot.0010.exr"]).unwrap();
        assert_eq!(one.files, [(10, "shot.0010.exr".to_owned())]);
        // A shell expands `shot.*.exr` to such a list.
        let named = ["shot.0009.exr", "shot.0010.exr", "shot.light_00.0009.exr"];
        assert_eq!(found(folder, &named).unwrap().files, whole.files);
        assert!(names_frames(folder) && names_frames(&folder.join("shot.####.exr")));
        for (name, number) in [("s.-0002.exr", -2), ("s.-1.exr", -1), ("s.0000.exr", 0)] {
            std::fs::write(folder.join(name), "").unwrap();
            let found = found(folder, &[name]).unwrap();
            assert_eq!((found.files[0].0, &*found.pattern), (number, "s.####.exr"));
        }
        let signed = found(folder, &["s.%04d.exr"]).unwrap().files;
        assert_eq!(signed.iter().map(|(number, _)| *number).collect::<Vec<_>>(), [-2, -1, 0]);
        // After a letter a hyphen joins.
        std::fs::write(folder.join("take-0007.exr"), "").unwrap();
        assert!(found(folder, &["take%04d.exr"]).is_err());
        assert_eq!(found(folder, &["take-0007.exr"]).unwrap().files[0].0, 7);
        // One number in two spellings is a duplicate.
        std::fs::write(folder.join("shot.9.exr"), "").unwrap();
        let double = found(folder, &["shot.%04d.exr"]).unwrap().files;
        assert_eq!(double.iter().filter(|(number, _)| *number == 9).count(), 2);
    }

    #[test]
    fn a_pattern_says_where_the_number_is() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["50%.0007_v2.exr", "50%.0008_v2.exr", "50%.0008_v3.exr"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let shot = found(folder.path(), &["50%%.%04d_v2.exr"]).unwrap();
        let numbers: Vec<i64> = shot.files.iter().map(|(number, _)| *number).collect();
        assert_eq!(numbers, [7, 8]);
        assert_eq!(shot.pattern, "50%.####_v2.exr");
    }

    #[test]
    fn what_is_no_shot_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let said = |named: &[&str]| found(folder, named).unwrap_err().to_string();
        assert!(said(&[""]).contains("no picture of a shot"));
        assert!(said(&["gone.exr"]).contains("gone.exr"));
        assert!(said(&["a.####.exr"]).contains("a.####.exr"));
        for name in ["a.1.exr", "b.1.exr", "title.exr"] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        let several = said(&[""]);
        assert!(several.contains("a.####.exr, b.####.exr, title.exr"), "{several}");
        assert!(said(&["a.1.exr", "gone.2.exr"]).contains("gone.2.exr"));
        assert!(said(&["a.1.exr", "x/a.2.exr"]).contains("different folders"));
        assert!(Shot::find(&[]).is_err());
        std::fs::write(folder.join("project.toml"), "").unwrap();
        assert!(!names_frames(folder) && !names_frames(&folder.join("film")));
    }
}
