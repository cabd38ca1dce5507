//! The environments of a project: the shoot's and those added by the user, with their front directions.

use super::Project;
use base::error::{Error, Result};
use base::files::shown;
use light::built_in;
use light::conventions::Front;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf, absolute};

/// A lat-long panorama file and its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedEnvironment {
    pub name: String,
    /// Path of the file: absolute, relative to the shoot's folder (in the shoot's list) or to the project's (in
    /// the project's list).
    pub file: PathBuf,
    /// Yaw of its front in degrees; `None` until it is set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub front: Option<Front>,
}

impl NamedEnvironment {
    /// Direction of the front: Afterlight's convention unless it was set.
    pub fn front(&self) -> Front {
        self.front.unwrap_or_default()
    }
}

/// Changes to a project's environments.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct EnvironmentChange {
    /// Add a panorama file. Can be given several times.
    #[arg(long, value_name = "FILE")]
    pub add: Vec<PathBuf>,
    /// Set --front for this environment, a name or a file. Can be given several times.
    #[arg(long, value_name = "NAME", requires = "front")]
    pub of: Vec<PathBuf>,
    /// Direction of the front in --add and --of: the convention of a tool (afterlight, openexr, usd, nuke, mitsuba,
    /// threejs, blender), or the yaw in degrees that brings the front to the middle.
    #[arg(long, value_name = "TOOL|DEG", allow_hyphen_values = true)]
    pub front: Option<Front>,
    /// Remove an added environment from the list, by its name or file; the file stays. Can be given several times.
    #[arg(long, value_name = "NAME")]
    pub remove: Vec<PathBuf>,
}

/// An environment of a project, and the state of its file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KnownEnvironment {
    pub name: String,
    /// Path of the file, below the project's folder or absolute.
    pub file: PathBuf,
    /// Direction of its front, if it was set.
    pub front: Option<Front>,
    /// True if the user added it; the others are the shoot's.
    pub added: bool,
    /// True if its file is missing.
    pub missing: bool,
}

impl KnownEnvironment {
    /// Message for a missing file, with the remedy; `None` if the file exists.
    pub fn complaint(&self) -> Option<String> {
        self.missing.then(|| {
            format!(
                "The file of the environment {} is missing: {}. It stays in the list: restore the file, or remove \
                 the environment and add the file at its new path",
                self.name,
                shown(&self.file)
            )
        })
    }
}

impl Project {
    /// All environments: the shoot's, then the added ones.
    pub fn environments(&self) -> Vec<KnownEnvironment> {
        let known = |named: &NamedEnvironment, file: PathBuf, added| KnownEnvironment {
            name: named.name.clone(),
            missing: !file.exists(),
            file,
            front: named.front,
            added,
        };
        let shoots = self.settings.shoot.environments.iter();
        let added = self.settings.environments.iter();
        shoots
            .map(|e| known(e, self.shoot_path(&e.file), false))
            .chain(added.map(|e| known(e, self.root.join(&e.file), true)))
            .collect()
    }

    /// The environment with this name, or else with this file.
    pub fn environment(&self, wanted: &Path) -> Option<KnownEnvironment> {
        let known = self.environments();
        let place = self.place(&known, wanted)?;
        known.into_iter().nth(place)
    }

    /// Adds a panorama file, unless it is listed already; `front` is the direction of its front, if known. The
    /// name is the file's stem, with a number if that is taken.
    pub fn add_environment(&mut self, file: &Path, front: Option<Front>) {
        let known = self.environments();
        let same = |e: &KnownEnvironment| resolved(&e.file) == resolved(file);
        match known.iter().position(same) {
            Some(place) => {
                let entry = self.entry(place);
                entry.front = front.or(entry.front);
            }
            None => {
                let names = known.iter().map(|e| e.name.as_str());
                let entry = NamedEnvironment { name: free_name(file, names), file: self.path_to_keep(file), front };
                self.settings.environments.push(entry);
            }
        }
    }

    /// Sets the front direction of the environment with this name or file.
    ///
    /// # Errors
    /// When there is no such environment.
    pub fn set_front(&mut self, wanted: &Path, front: Option<Front>) -> Result<()> {
        let known = self.environments();
        let place = self.place(&known, wanted);
        let place = place.ok_or_else(|| unknown(&known, wanted))?;
        self.entry(place).front = front;
        Ok(())
    }

    /// Removes the added environment with this name or file from the list.
    ///
    /// # Errors
    /// When there is no such environment, or it is the shoot's or built in: those stay.
    pub fn remove_environment(&mut self, wanted: &Path) -> Result<()> {
        let known = self.environments();
        let Some(place) = self.place(&known, wanted) else { return Err(unknown(&known, wanted)) };
        let Some(added) = place.checked_sub(self.settings.shoot.environments.len()) else {
            return Err(Error::invalid(
                format!("the environment {} is the shoot's and stays in the list", wanted.display()),
                "Remove only environments that were added",
            ));
        };
        self.settings.environments.remove(added);
        Ok(())
    }

    /// Applies all changes.
    ///
    /// # Errors
    /// When a file to add does not exist, an environment to change is unknown, or one to remove is the shoot's.
    pub fn apply(&mut self, change: &EnvironmentChange) -> Result<()> {
        for file in &change.add {
            if !file.is_file() {
                return Err(Error::missing(format!("there is no file {}", file.display()), "Check the path"));
            }
            self.add_environment(file, change.front);
        }
        for wanted in &change.of {
            self.set_front(wanted, change.front)?;
        }
        for wanted in &change.remove {
            self.remove_environment(wanted)?;
        }
        Ok(())
    }

    fn place(&self, known: &[KnownEnvironment], wanted: &Path) -> Option<usize> {
        let named = known.iter().position(|e| Path::new(&e.name) == wanted);
        let same = |e: &KnownEnvironment| resolved(&e.file) == resolved(wanted);
        named.or_else(|| known.iter().position(same))
    }

    /// The entry at a position in [`Self::environments`].
    fn entry(&mut self, place: usize) -> &mut NamedEnvironment {
        let shoots = self.settings.shoot.environments.len();
        match place.checked_sub(shoots) {
            Some(added) => &mut self.settings.environments[added],
            None => &mut self.settings.shoot.environments[place],
        }
    }

    /// The path to store: relative to the project's folder if the file is below that or the shoot's, so that both
    /// can be moved together.
    fn path_to_keep(&self, file: &Path) -> PathBuf {
        let file = resolved(file);
        let below = |folder: &Path| {
            let folder = folder.canonicalize().ok()?;
            file.strip_prefix(folder).ok().map(Path::to_path_buf)
        };
        let shoot = &self.settings.shoot.folder;
        let from_shoot = || Some(shoot.join(below(&self.root.join(shoot))?));
        below(&self.root).or_else(from_shoot).unwrap_or(file)
    }
}

/// The file's stem, with a number if an added or built-in environment has that name.
pub fn free_name<'a>(file: &Path, taken: impl Iterator<Item = &'a str> + Clone) -> String {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let built_in = || built_in::all().into_iter().flat_map(|own| [own.name, own.title]);
    let is_free = |name: &str| {
        let same = |other: &str| other.eq_ignore_ascii_case(name);
        !built_in().any(same) && !taken.clone().any(same)
    };
    std::iter::once(stem.to_string())
        .chain((2u32..).map(|n| format!("{stem} {n}")))
        .find(|name| is_free(name))
        .unwrap_or_default()
}

/// The absolute path of a file with all links resolved; the file need not exist.
fn resolved(file: &Path) -> PathBuf {
    let full = absolute(file).unwrap_or_else(|_| file.to_path_buf());
    let folder = full.parent().and_then(|folder| folder.canonicalize().ok());
    match (folder, full.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => full,
    }
}

fn unknown(known: &[KnownEnvironment], wanted: &Path) -> Error {
    let names: Vec<&str> = known.iter().map(|e| e.name.as_str()).collect();
    Error::missing(
        format!("the project has no environment {}, only {}", wanted.display(), names.join(", ")),
        "Check the name, or add the file first",
    )
}

#[cfg(test)]
mod tests;
