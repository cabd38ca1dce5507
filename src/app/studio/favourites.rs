//! Favourite environments of a person, for all projects.

use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::path::PathBuf;
use worker::Origin;

/// Most favourites. The oldest are dropped.
const MOST: usize = 1000;

/// The favourites, the oldest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Favourites(Vec<Favourite>);

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Favourite {
    File(PathBuf),
    /// Name of a built-in environment.
    BuiltIn(String),
}

impl Favourite {
    /// None for a path that is not UTF-8, which would make the settings file invalid.
    fn from_origin(origin: &Origin) -> Option<Self> {
        match origin {
            Origin::File(file) => Some(Self::File(file.to_str()?.into())),
            Origin::BuiltIn(own) => Some(Self::BuiltIn(own.name.to_owned())),
        }
    }
}

impl Favourites {
    /// A test for favourites, quick for many environments.
    pub fn marker(&self) -> impl Fn(&Origin) -> bool {
        let (mut files, mut names) = (HashSet::new(), HashSet::new());
        for one in &self.0 {
            match one {
                Favourite::File(file) => files.insert(file.as_path()),
                Favourite::BuiltIn(name) => names.insert(name.as_str()),
            };
        }
        move |origin| match origin {
            Origin::File(file) => files.contains(file.as_path()),
            Origin::BuiltIn(own) => names.contains(own.name),
        }
    }

    /// Adds an environment to the favourites or removes it.
    pub fn toggle(&mut self, origin: &Origin) {
        let Some(one) = Favourite::from_origin(origin) else { return };
        match self.0.iter().position(|known| *known == one) {
            Some(place) => drop(self.0.remove(place)),
            None => self.0.push(one),
        }
        let more = self.0.len().saturating_sub(MOST);
        self.0.drain(..more);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use light::built_in;

    #[test]
    fn a_favourite_is_known_by_its_file_or_its_built_in_name() {
        let yard = Origin::File("/hdri/yard.exr".into());
        let nave = Origin::BuiltIn(built_in::all()[2]);
        let mut favourites = Favourites::default();
        favourites.toggle(&yard);
        favourites.toggle(&nave);
        let text = serde_json::to_string(&favourites).unwrap();
        let mut read: Favourites = serde_json::from_str(&text).unwrap();
        assert!(read.marker()(&yard) && read.marker()(&nave));
        assert!(!read.marker()(&Origin::File("/other/yard.exr".into())));
        read.toggle(&yard);
        assert!(!read.marker()(&yard) && read.marker()(&nave));
        #[cfg(unix)]
        {
            use std::os::unix::ffi::OsStrExt;
            let strange = std::ffi::OsStr::from_bytes(b"/caf\xe9.exr");
            read.toggle(&Origin::File(strange.into()));
            assert!(serde_json::to_string(&read).is_ok());
        }
        for i in 0..=MOST {
            read.toggle(&Origin::File(format!("/{i}.exr").into()));
        }
        assert_eq!(read.0.len(), MOST);
    }
}
