//! Programs that open an exported shot.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Part of a report that names the files written for other programs; "" without any.
pub fn handed_over(files: &[PathBuf]) -> String {
    let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    match &files[..] {
        [] => String::new(),
        files => format!(". For other programs: {}", files.join(", ")),
    }
}

/// A program, or kind of program, that opens an exported shot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum HandOver {
    /// Nuke: a script with a gain per lamp, key, fill and rim, and the rebuilt picture; needs --layers by lamp [.nk].
    Nuke,
    /// Blender: a script for compositor, world and lamps; needs --layers by lamp, and includes the environment [.blender.py].
    Blender,
    /// Resolve and other editors: a timeline of OpenTimelineIO [.otio].
    Otio,
    /// Premiere, Avid, Resolve: an edit decision list, CMX 3600 [.edl].
    Edl,
}

impl HandOver {
    pub const ALL: [Self; 4] = [Self::Nuke, Self::Blender, Self::Otio, Self::Edl];

    /// Common name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nuke => "Nuke",
            Self::Blender => "Blender",
            Self::Otio => "OTIO",
            Self::Edl => "EDL",
        }
    }

    /// Extension after the export's name.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Nuke => ".nk",
            Self::Blender => ".blender.py",
            Self::Otio => ".otio",
            Self::Edl => ".edl",
        }
    }

    /// True if the program rebuilds the picture from light layers.
    pub fn needs_layers(self) -> bool {
        matches!(self, Self::Nuke | Self::Blender)
    }
}
