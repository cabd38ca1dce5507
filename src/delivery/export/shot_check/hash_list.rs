//! ASC MHL 2.0: the hash lists of a folder. Each list is a generation in the subfolder `ascmhl`; a chain file there has the
//! hash of each list. Hashes are C4 IDs. Format: American Society of Cinematographers, Media Hash List.

use super::Fault;
use super::frame::Frame;
use super::hash::{c4, c4_of_file};
use super::read::each;
use super::shot::frame_number;
use base::error::{Error, Result};
use base::files::{is_bare, natural_order, read_text, write_beside};
use base::has_extension;
use base::progress::Progress;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha512};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Component, Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

const FOLDER: &str = "ascmhl";
const CHAIN: &str = "ascmhl_chain.xml";
/// Files that are in no list.
const IGNORED: [&str; 3] = [".DS_Store", "ascmhl", "ascmhl/"];
const REMEDY: &str = "Restore the file, or remove the folder ascmhl and begin again";
/// Longest list that is read, in bytes: a million frames, each with some files beside it.
const MOST_BYTES: u64 = 1 << 30;
/// Files read at the same time; only a small piece of each is in memory.
const AT_ONCE: usize = 8;
/// Seconds from 1970 to the year 10000, where dates get a fifth digit.
const LAST_DATE: u64 = 253_402_300_800;

/// A file in the folder.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Found {
    pub bytes: u64,
    /// C4 ID, or the reason why the file cannot be read.
    pub c4: std::result::Result<String, String>,
    /// C4 ID of a frame's samples.
    pub pixels: Option<String>,
}

/// All generations of a folder's hash lists.
#[derive(Debug, Default)]
pub(super) struct History {
    chain: Chain,
    /// First hash of each file, by its path in the folder.
    files: BTreeMap<String, Known>,
    /// Lists and entries that cannot be trusted, as sentences.
    edited: Vec<String>,
}

/// First hash of a file.
#[derive(Debug, Default)]
struct Known {
    bytes: Option<u64>,
    /// None if the file has hashes of other kinds alone.
    c4: Option<String>,
    pixels: Option<String>,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(rename = "ascmhldirectory", default)]
struct Chain {
    #[serde(rename = "@xmlns")]
    namespace: String,
    hashlist: Vec<Link>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Link {
    #[serde(rename = "@sequencenr")]
    number: u64,
    path: String,
    c4: String,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(rename = "hashlist", default)]
struct HashList {
    #[serde(rename = "@version")]
    version: String,
    #[serde(rename = "@xmlns")]
    namespace: String,
    creatorinfo: Creator,
    processinfo: Process,
    hashes: Hashes,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct Creator {
    creationdate: String,
    hostname: String,
    tool: Tool,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct Tool {
    #[serde(rename = "@version")]
    version: String,
    #[serde(rename = "$text")]
    name: String,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct Process {
    process: String,
    ignore: Ignore,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct Ignore {
    pattern: Vec<String>,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct Hashes {
    #[serde(rename = "$value")]
    entries: Vec<Entry>,
}

#[derive(Debug, Serialize, Deserialize)]
enum Entry {
    #[serde(rename = "hash")]
    File(FileEntry),
    /// Hash of a folder.
    #[serde(other)]
    Other,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct FileEntry {
    path: EntryPath,
    #[serde(skip_serializing_if = "Option::is_none")]
    c4: Option<EntryHash>,
    #[serde(rename = "previousPath", skip_serializing_if = "Option::is_none")]
    previous_path: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    metadata: Option<Metadata>,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct EntryPath {
    #[serde(rename = "@size", skip_serializing_if = "Option::is_none")]
    size: Option<u64>,
    #[serde(rename = "@lastmodificationdate", skip_serializing_if = "Option::is_none")]
    modified: Option<String>,
    #[serde(rename = "$text")]
    path: String,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct EntryHash {
    #[serde(rename = "@action", skip_serializing_if = "Option::is_none")]
    action: Option<String>,
    #[serde(rename = "@hashdate", skip_serializing_if = "Option::is_none")]
    date: Option<String>,
    #[serde(rename = "$text")]
    c4: String,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct Metadata {
    /// C4 ID of a frame's samples, which a changed header or compression leaves as they are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pixels: Option<String>,
}

impl History {
    /// Reads all hash lists of a folder. A folder without any has an empty history.
    ///
    /// # Errors
    /// When the chain or a list cannot be read.
    pub fn read(root: &Path) -> Result<Self> {
        let folder = root.join(FOLDER);
        if !folder.exists() {
            return Ok(Self::default());
        }
        let mut history = Self { chain: parse(&folder.join(CHAIN))?, ..Self::default() };
        for link in &history.chain.hashlist {
            let path = folder.join(&link.path);
            if !is_bare(&link.path) || !path.is_file() {
                history.edited.push(format!("{} is in the chain, but missing", link.path));
                continue;
            }
            let (_, found) = c4_of_file(&path, MOST_BYTES).map_err(|e| Error::io("read", &path, e, REMEDY))?;
            if found != link.c4 {
                let sentence = format!("{}: hash mismatch: damaged or edited", link.path);
                history.edited.push(sentence);
            }
            let list: HashList = parse(&path)?;
            for entry in list.hashes.entries {
                let Entry::File(entry) = entry else { continue };
                let inside = Path::new(&entry.path.path).components();
                if !inside.clone().all(|part| matches!(part, Component::Normal(_))) || inside.count() == 0 {
                    let outside = format!("{} leads out of the folder", entry.path.path);
                    history.edited.push(format!("{}: {outside}", link.path));
                    continue;
                }
                if let Some(previous) = entry.previous_path {
                    history.files.remove(&previous);
                }
                let known = history.files.entry(entry.path.path).or_default();
                known.bytes = known.bytes.or(entry.path.size);
                let c4 = entry.c4.map(|hash| hash.c4).filter(|c4| !c4.is_empty());
                known.c4 = known.c4.take().or(c4);
                known.pixels = known.pixels.take().or(entry.metadata.and_then(|m| m.pixels));
            }
        }
        Ok(history)
    }

    /// True if a file is in a list.
    pub fn lists(&self, path: &str) -> bool {
        self.files.contains_key(path)
    }

    /// Most bytes of a file that its first hash can cover.
    pub fn length(&self, path: &str) -> u64 {
        self.files.get(path).and_then(|known| known.bytes).unwrap_or(u64::MAX)
    }

    /// Number of files in all lists.
    pub fn len(&self) -> usize {
        self.files.len()
    }

    /// Number of files whose hash is the first one.
    pub fn same(&self, found: &BTreeMap<String, Found>) -> usize {
        let is_same = |(path, known): &(&String, &Known)| {
            let found = found.get(*path).and_then(|found| found.c4.as_ref().ok());
            found.is_some() && found == known.c4.as_ref()
        };
        self.files.iter().filter(is_same).count()
    }

    /// Number of files with hashes of other kinds alone.
    pub fn without_c4(&self) -> usize {
        self.files.values().filter(|known| known.c4.is_none()).count()
    }

    /// Faults of the lists, and of files that are missing, unreadable or changed: at most one for each file.
    pub fn faults(&self, root: &Path, found: &BTreeMap<String, Found>) -> Vec<Fault> {
        let fault = |kind: &str, frames: String, sentence: String| Fault { kind: kind.to_owned(), frames, sentence };
        let of_file = |path: &String, kind: &str, said: &str| {
            let name = path.rsplit('/').next().and_then(frame_number);
            let frame = name.map_or(String::new(), |number| number.to_string());
            fault(kind, frame, format!("{path} {said}"))
        };
        let edited = self.edited.iter().map(|said| fault("hash_list", String::new(), said.clone()));
        let listed = self.files.iter().filter_map(|(path, known)| match found.get(path) {
            None => Some(of_file(path, "missing", "is missing")),
            Some(Found { c4: Ok(found), .. }) if known.c4.as_ref().is_some_and(|c4| c4 != found) => {
                let (kind, said) = changed(&root.join(path), known);
                Some(of_file(path, kind, &said))
            }
            Some(_) => None,
        });
        let unreadable = found.iter().filter_map(|(path, found)| {
            let said = found.c4.as_ref().err()?;
            Some(of_file(path, "unreadable", &format!("cannot be read: {said}")))
        });
        edited.chain(listed).chain(unreadable).collect()
    }

    /// Writes the next list, of the files that were found, and the chain with it. Returns the list's path.
    ///
    /// # Errors
    /// When a file cannot be written, or a name does not fit into XML.
    pub fn write(&self, root: &Path, found: &BTreeMap<String, Found>) -> Result<PathBuf> {
        if let Some(name) = found.keys().find(|name| name.contains(char::is_control)) {
            return Err(Error::invalid(
                format!("{name:?} has a control character, which a hash list cannot hold"),
                "Rename the file",
            ));
        }
        let now = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
        let entries = found.iter().map(|(path, file)| {
            let action = if self.lists(path) { "verified" } else { "original" };
            let modified = root.join(path).metadata().and_then(|data| data.modified()).ok();
            let modified =
                modified.filter(|time| time.duration_since(UNIX_EPOCH).is_ok_and(|since| since.as_secs() < LAST_DATE));
            Entry::File(FileEntry {
                path: EntryPath {
                    size: Some(file.bytes),
                    modified: modified.map(|t| humantime::format_rfc3339_seconds(t).to_string()),
                    path: path.clone(),
                },
                c4: Some(EntryHash {
                    action: Some(action.to_owned()),
                    date: Some(now.clone()),
                    c4: file.c4.clone().unwrap_or_default(),
                }),
                previous_path: None,
                metadata: (file.pixels.clone()).map(|pixels| Metadata { pixels: Some(pixels) }),
            })
        });
        let list = HashList {
            version: "2.0".to_owned(),
            namespace: "urn:ASC:MHL:v2.0".to_owned(),
            creatorinfo: Creator {
                creationdate: now.clone(),
                hostname: project::host_name().unwrap_or_else(|| "unknown".to_owned()),
                tool: Tool { version: env!("CARGO_PKG_VERSION").to_owned(), name: "Afterlight".to_owned() },
            },
            processinfo: Process {
                process: "in-place".to_owned(),
                ignore: Ignore { pattern: IGNORED.map(str::to_owned).to_vec() },
            },
            hashes: Hashes { entries: entries.collect() },
        };
        let whole = std::fs::canonicalize(root).unwrap_or_default();
        let name = whole.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let number = self.chain.hashlist.last().map_or(1, |link| link.number.saturating_add(1));
        let date = now.replace('T', "_").replace(':', "");
        let name = format!("{number:04}_{name}_{date}.mhl");
        let path = root.join(FOLDER).join(&name);
        let hash = write(&path, &list)?;
        let link = Link { number, path: name, c4: hash };
        let chain = Chain {
            namespace: "urn:ASC:MHL:DIRECTORY:v2.0".to_owned(),
            hashlist: self.chain.hashlist.iter().cloned().chain([link]).collect(),
        };
        write(&root.join(FOLDER).join(CHAIN), &chain)?;
        Ok(path)
    }
}

/// Files below a folder, but for hash lists: their paths in it, with `/` between folders. Links to folders are left out.
///
/// # Errors
/// When a folder cannot be read, has hash lists of its own, or a name is not UTF-8.
pub(super) fn files(root: &Path) -> Result<Vec<String>> {
    let mut files = Vec::new();
    let mut folders = vec![String::new()];
    while let Some(inside) = folders.pop() {
        let folder = root.join(&inside);
        let fail = |e| Error::io("read", &folder, e, "Check that the folder can be read");
        for entry in std::fs::read_dir(&folder).map_err(fail)? {
            let entry = entry.map_err(fail)?;
            let name = entry.file_name().into_string().map_err(|name| {
                Error::invalid(format!("the name {} is not UTF-8", name.display()), "Rename the file")
            })?;
            let path = if inside.is_empty() { name } else { format!("{inside}/{name}") };
            let kind = entry.file_type().map_err(fail)?;
            match path.rsplit('/').next() {
                Some(".DS_Store") => (),
                Some(FOLDER) if inside.is_empty() => (),
                Some(FOLDER) if kind.is_dir() => {
                    return Err(Error::invalid(
                        format!("{} has hash lists of its own", folder.display()),
                        "Move that folder out, or list the hashes with the tool that made its lists",
                    ));
                }
                _ if kind.is_dir() => folders.push(path),
                _ if entry.path().is_dir() => (),
                _ => files.push(path),
            }
        }
    }
    files.sort_by(|a, b| natural_order(a, b));
    Ok(files)
}

/// Hashes files of a folder, each up to its `length` in bytes: the hash of a longer one is "".
///
/// # Errors
/// When the user stops.
pub(super) fn hash_files(
    root: &Path,
    paths: Vec<String>,
    length: impl Fn(&str) -> u64 + Sync,
    progress: &Progress,
) -> Result<BTreeMap<String, Found>> {
    let found = each(&paths, AT_ONCE, progress, "hashing files", |path| {
        let hash = c4_of_file(&root.join(path), length(path));
        let (bytes, c4) = hash.map_or_else(|e| (0, Err(e.to_string())), |(n, c4)| (n, Ok(c4)));
        Found { bytes, c4, pixels: None }
    })?;
    Ok(paths.into_iter().zip(found).collect())
}

/// Kind of change and its message: a changed picture, or the same picture in changed bytes.
fn changed(path: &Path, known: &Known) -> (&'static str, String) {
    let bytes = ("changed", "differs in its bytes".to_owned());
    let Some(pixels) = known.pixels.as_ref().filter(|_| has_extension(path, "exr")) else { return bytes };
    match Frame::read(path, 0, "").picture {
        Ok(content) if content.pixels == *pixels => (
            "changed",
            "differs in its bytes, with the same picture: its header or its compression was changed".to_owned(),
        ),
        Ok(_) => ("changed", "has a different picture".to_owned()),
        Err(said) => ("unreadable", format!("is damaged: {said}")),
    }
}

fn parse<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let text = read_text(path, MOST_BYTES).map_err(|e| Error::io("read", path, e, REMEDY))?;
    quick_xml::de::from_str(&text).map_err(|e| Error::codec("read", path, e, REMEDY))
}

/// Writes a file and returns its C4 ID.
fn write(path: &Path, value: &impl Serialize) -> Result<String> {
    let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned();
    let mut writer = quick_xml::se::Serializer::new(&mut text);
    writer.indent(' ', 2);
    let fail = |e| Error::codec("write", path, e, "Rename the files, or report this as a bug");
    value.serialize(writer).map_err(fail)?;
    text.push('\n');
    write_beside(path, |out| out.write_all(text.as_bytes()))?;
    Ok(c4(Sha512::digest(&text)))
}
