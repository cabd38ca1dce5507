//! Corrections of faults in a shoot's pictures, whose files stay as they are.

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Corrections of the lamps' pictures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Corrections {
    /// Lamps without an OLAT, by pose: the pose's other lamps stand in.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub missing: BTreeMap<String, BTreeSet<String>>,
    /// Files of exchanged OLATs, by pose and lamp, named by the lamps that they were taken for.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub exchanged: BTreeMap<String, BTreeMap<String, String>>,
    /// Axes along which the photographs of the mirror balls are mirrored back.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    pub balls: BTreeSet<Axis>,
}

/// Axis along which a picture is mirrored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    LeftRight,
    UpDown,
}

impl Corrections {
    /// True without corrections.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// True if pose `pose` has no OLAT of lamp `lamp`.
    pub fn lacks(&self, pose: &str, lamp: &str) -> bool {
        self.missing.get(pose).is_some_and(|lamps| lamps.contains(lamp))
    }

    /// The lamp by which the file with the OLAT of `lamp` in `pose` is named.
    pub fn file<'a>(&'a self, pose: &str, lamp: &'a str) -> &'a str {
        let exchanged = self.exchanged.get(pose);
        exchanged.and_then(|files| files.get(lamp)).map_or(lamp, String::as_str)
    }

    /// Names in the corrections: poses, lamps, files.
    pub fn names(&self) -> impl Iterator<Item = &String> {
        let missing = self.missing.iter().flat_map(|(pose, lamps)| [pose].into_iter().chain(lamps));
        let exchanged = self
            .exchanged
            .iter()
            .flat_map(|(pose, files)| [pose].into_iter().chain(files.iter().flat_map(|(lamp, file)| [lamp, file])));
        missing.chain(exchanged)
    }
}
