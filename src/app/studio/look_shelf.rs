//! A folder of stored looks. Each look has a folder with its name, with `0001.json` and `0001.png` for each version.
//!
//! Removed looks go to `.removed`, from where they can be restored. The folder may be untrusted: links are not
//! followed, and other files are left alone and reported.

use super::look_name::LookName;
use super::stored_look::StoredLook;
use base::error::{Error, Result};
use base::files::{self, shown};
use imaging::file::{codes_from_memory, dimensions, png_bytes};
use imaging::{Encoded, Image};
use std::collections::HashMap;
use std::fs::OpenOptions;
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;
use worker::SrgbPicture;

/// Folder of removed looks.
const REMOVED: &str = ".removed";
/// Most looks of a shelf, and most versions of a look, that are read.
const MOST_LOOKS: usize = 500;
const MOST_VERSIONS: usize = 200;
/// Longer side of a thumbnail in pixels, and the most bytes and pixels of a thumbnail that are read.
const THUMBNAIL_PX: usize = 192;
const MOST_PICTURE_BYTES: u64 = 1 << 20;
const MOST_PICTURE_PX: usize = 1024;

/// The folder, which need not exist.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LookShelf {
    within: PathBuf,
}

/// A version of a look.
#[derive(Clone, Debug)]
pub struct LookVersion {
    /// From 1.
    pub number: u32,
    pub look: Arc<StoredLook>,
    /// Picture from the time of storing.
    pub picture: Option<Arc<SrgbPicture>>,
}

/// A look with its versions, newest first; at least one.
#[derive(Clone, Debug)]
pub struct ShelvedLook {
    pub name: LookName,
    pub versions: Vec<LookVersion>,
}

/// Contents of a shelf.
#[derive(Clone, Debug, Default)]
pub struct ShelfContents {
    /// Looks in order of their names.
    pub looks: Vec<ShelvedLook>,
    /// Removed looks that can be restored.
    pub removed: Vec<LookName>,
    /// A sentence for each file that is not a look.
    pub complaints: Vec<String>,
}

/// Thumbnails read before, by file, with modification time and length.
#[derive(Default)]
pub struct ReadPictures(HashMap<PathBuf, (Option<SystemTime>, u64, Arc<SrgbPicture>)>);

impl LookShelf {
    /// The shelf `looks` in a folder.
    pub fn within(folder: &Path) -> Self {
        Self { within: folder.to_path_buf() }
    }

    fn folder(&self) -> PathBuf {
        self.within.join("looks")
    }

    /// The same, created if missing.
    fn made(&self) -> Result<PathBuf> {
        let remedy = "Check that the folder can be written";
        std::fs::create_dir_all(&self.within).map_err(|e| Error::io("make", &self.within, e, remedy))?;
        own_folder(&self.within, "looks")
    }

    /// Its current contents.
    pub fn list(&self, pictures: &mut ReadPictures) -> ShelfContents {
        let mut contents = ShelfContents::default();
        let folder = self.folder();
        if !is_own_folder(&folder) {
            if folder.symlink_metadata().is_ok() {
                let said = format!("{} is not a folder: no looks are read from it", shown(&folder));
                contents.complaints.push(said);
            }
            return contents;
        }
        for name in names(&folder) {
            if contents.looks.len() == MOST_LOOKS {
                let said = format!("{} holds more than {MOST_LOOKS} looks; the others are not listed", shown(&folder));
                contents.complaints.push(said);
                break;
            }
            let complaints = &mut contents.complaints;
            let versions = versions(&folder.join(name.text()), pictures, complaints);
            if !versions.is_empty() {
                contents.looks.push(ShelvedLook { name, versions });
            }
        }
        contents.removed = names(&folder.join(REMOVED));
        contents
    }

    /// Stores a version of a look, unless its newest version is the same. Returns the look's name and the version's
    /// number. The name differs from `name` if a look exists whose name a disk would treat as the same.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn store(&self, name: &LookName, look: &StoredLook) -> Result<(LookName, u32)> {
        let shelf = self.made()?;
        let same = names(&shelf).into_iter().find(|one| one.is_like(name));
        let name = same.unwrap_or_else(|| name.clone());
        let folder = own_folder(&shelf, name.text())?;
        let newest = numbers(&folder).into_iter().next();
        if let Some(number) = newest
            && let Ok(newest) = StoredLook::read_own(&file(&folder, number, "json"))
            && newest.is_same(look)
        {
            return Ok((name, number));
        }
        let mut number = newest.unwrap_or(0) + 1;
        // Another window may store at the same time.
        while !write_new(&file(&folder, number, "json"), &look.text())? {
            number += 1;
        }
        Ok((name, number))
    }

    /// Writes the thumbnail of a version from this picture.
    ///
    /// # Errors
    /// If it cannot be written, or the version does not exist.
    pub fn draw(&self, name: &LookName, number: u32, picture: &SrgbPicture) -> Result<()> {
        let folder = self.look(name)?;
        let codes = picture.rgb.as_chunks::<3>().0.iter();
        let codes = Encoded(Image {
            width: picture.width,
            height: picture.height,
            pixels: codes.map(|code| code.map(|v| f32::from(v) / 255.0)).collect(),
        });
        let small = SrgbPicture::reduced(&codes, THUMBNAIL_PX);
        let codes = small.rgb.as_chunks::<3>().0.iter();
        let png = png_bytes(&Encoded(Image {
            width: small.width,
            height: small.height,
            pixels: codes.map(|code| code.map(|v| f32::from(v) / 255.0)).collect(),
        }))?;
        files::write_beside(&file(&folder, number, "png"), |out| out.write_all(&png))
    }

    /// Renames a look.
    ///
    /// # Errors
    /// If the look does not exist, or another look has an equivalent name.
    pub fn rename(&self, from: &LookName, to: &LookName) -> Result<()> {
        let folder = self.look(from)?;
        let taken = names(&self.folder());
        let other = |one: &&LookName| one.is_like(to) && !one.is_like(from);
        if let Some(other) = taken.iter().find(other) {
            return Err(Error::invalid(format!("a look named {other} already exists"), "Choose another name"));
        }
        moved(&folder, &self.folder().join(to.text()))
    }

    /// Removes a look from the shelf; it can be restored.
    ///
    /// # Errors
    /// If the look does not exist or cannot be moved.
    pub fn remove(&self, name: &LookName) -> Result<()> {
        let folder = self.look(name)?;
        let removed = own_folder(&self.made()?, REMOVED)?;
        let aside = name.free(&names(&removed));
        moved(&folder, &removed.join(aside.text()))
    }

    /// Restores a removed look, under a free name.
    ///
    /// # Errors
    /// If the look does not exist or cannot be moved.
    pub fn bring_back(&self, name: &LookName) -> Result<LookName> {
        let shelf = self.made()?;
        let removed = own_folder(&shelf, REMOVED)?;
        let free = name.free(&names(&shelf));
        moved(&removed.join(name.text()), &shelf.join(free.text()))?;
        Ok(free)
    }

    /// Stores the newest version of a look of `other` here, with its picture, as the newest version of `name`.
    ///
    /// # Errors
    /// If it cannot be read or written.
    pub fn copy(&self, other: &Self, of: &LookName, name: &LookName) -> Result<()> {
        let folder = other.look(of)?;
        let Some(newest) = numbers(&folder).into_iter().next() else { return Err(gone(&folder)) };
        let look = StoredLook::read_own(&file(&folder, newest, "json"))?;
        let (name, number) = self.store(name, &look)?;
        // If the picture cannot be read, it is made again when the look is shown.
        if let Some(picture) = picture(&file(&folder, newest, "png"), &mut ReadPictures::default()) {
            self.draw(&name, number, &picture)?;
        }
        Ok(())
    }

    /// The folder of a look.
    fn look(&self, name: &LookName) -> Result<PathBuf> {
        let folder = self.folder().join(name.text());
        if is_own_folder(&self.folder()) && is_own_folder(&folder) { Ok(folder) } else { Err(gone(&folder)) }
    }
}

fn gone(folder: &Path) -> Error {
    Error::missing(
        format!("there is no look in {}", shown(folder)),
        "Another program may have moved it: close the project and open it again",
    )
}

/// One of the program's own folders inside another, created if missing.
///
/// # Errors
/// If it cannot be created, is a link, or is not a folder: the target of a link is not the program's.
fn own_folder(within: &Path, name: &str) -> Result<PathBuf> {
    let path = within.join(name);
    let remedy = "Remove or rename it, so that a folder can be made there";
    let fail = |cause: io::Error| Error::io("use the folder", &path, cause, remedy);
    match std::fs::create_dir(&path) {
        Err(e) if e.kind() != ErrorKind::AlreadyExists => return Err(fail(e)),
        _ => {}
    }
    if is_own_folder(&path) { Ok(path) } else { Err(fail(ErrorKind::NotADirectory.into())) }
}

/// Writes a file with a new name. Returns false if the name is taken. After a kill, the file is complete, missing or
/// empty.
fn write_new(path: &Path, text: &str) -> Result<bool> {
    let remedy = "Check that the folder can be written and the disk has room";
    match OpenOptions::new().write(true).create_new(true).open(path) {
        Err(e) if e.kind() == ErrorKind::AlreadyExists => return Ok(false),
        taken => taken.map_err(|e| Error::io("write", path, e, remedy))?,
    };
    let written = files::write_beside(path, |out| out.write_all(text.as_bytes()));
    if written.is_err() {
        // The file is empty, so it is not a look.
        let _ = std::fs::remove_file(path);
    }
    written.map(|()| true)
}

fn is_own_folder(path: &Path) -> bool {
    path.symlink_metadata().is_ok_and(|data| data.is_dir())
}

/// Moves a folder to a free path on the same disk.
fn moved(from: &Path, to: &Path) -> Result<()> {
    let remedy = "Check that the folder can be written";
    std::fs::rename(from, to).map_err(|e| Error::io("move", from, e, remedy))
}

/// The folders of looks, in order.
fn names(folder: &Path) -> Vec<LookName> {
    if !is_own_folder(folder) {
        return Vec::new();
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<LookName> = entries
        .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()))
        .filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            LookName::new(&name).ok().filter(|kept| kept.text() == name)
        })
        .collect();
    names.sort_by(|a, b| base::files::natural_order(a.text(), b.text()));
    names
}

fn file(folder: &Path, number: u32, kind: &str) -> PathBuf {
    folder.join(format!("{number:04}.{kind}"))
}

/// The version numbers in a look's folder, newest first.
fn numbers(folder: &Path) -> Vec<u32> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut numbers: Vec<u32> = entries
        .filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            let digits = name.strip_suffix(".json")?;
            let number: u32 = digits.parse().ok()?;
            (number > 0 && number < 1_000_000 && format!("{number:04}") == digits).then_some(number)
        })
        .collect();
    numbers.sort_unstable_by(|a, b| b.cmp(a));
    numbers
}

fn versions(folder: &Path, pictures: &mut ReadPictures, complaints: &mut Vec<String>) -> Vec<LookVersion> {
    let is_begun = |number: &u32| {
        let data = file(folder, *number, "json").symlink_metadata();
        // Empty: the program was killed, or is about to write it.
        data.is_ok_and(|data| data.is_file() && data.len() == 0)
    };
    let numbers = numbers(folder).into_iter().filter(|number| !is_begun(number));
    let numbers = numbers.take(MOST_VERSIONS);
    let version = |number| match StoredLook::read_own(&file(folder, number, "json")) {
        Ok(look) => {
            Some(LookVersion { number, look: Arc::new(look), picture: picture(&file(folder, number, "png"), pictures) })
        }
        Err(e) => {
            complaints.push(e.to_string());
            None
        }
    };
    numbers.filter_map(version).collect()
}

/// A thumbnail; None if it is missing or cannot be read.
fn picture(path: &Path, read: &mut ReadPictures) -> Option<Arc<SrgbPicture>> {
    let open = files::open_own(path, OpenOptions::new().read(true)).ok()?;
    let data = open.metadata().ok()?;
    let (changed, length) = (data.modified().ok(), data.len());
    if let Some((at, of, known)) = read.0.get(path)
        && (*at, *of) == (changed, length)
    {
        return Some(known.clone());
    }
    if length > MOST_PICTURE_BYTES {
        return None;
    }
    // A header may declare far more pixels than the file contains.
    let (width, height) = dimensions(path).ok()?;
    if width.max(height) > MOST_PICTURE_PX {
        return None;
    }
    let mut bytes = Vec::new();
    open.take(MOST_PICTURE_BYTES).read_to_end(&mut bytes).ok()?;
    let ((width, height), rgb) = codes_from_memory(&bytes).ok()?;
    let found = Arc::new(SrgbPicture { width, height, rgb });
    let entry = (changed, length, found.clone());
    read.0.insert(path.to_path_buf(), entry);
    Some(found)
}

/// Writes a look to a file chosen in a dialog.
///
/// # Errors
/// If it cannot be written.
pub fn write_to(path: &Path, look: &StoredLook) -> Result<()> {
    files::write_beside(path, |out| out.write_all(look.text().as_bytes()))
}

#[cfg(test)]
#[path = "look_shelf_tests.rs"]
mod tests;
