//! One version of a stored look, as a file: the look, its time of storing, and its environment, described so that
//! another project can find it.

use super::environment_list::{self, ListedEnvironment};
use super::look::LookSettings;
use super::saved_look::SavedLook;
use base::error::{Error, Result};
use base::files;
use light::built_in;
use light::conventions::Front;
use serde::{Deserialize, Serialize};
use std::fs::OpenOptions;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};
use worker::Origin;

/// Ending of look files.
pub const ENDING: &str = ".look.json";

/// Newest file version known to this program.
const FORM: u32 = 1;
/// Largest size of such a file in bytes. A look with a thousand keys has a tenth of that.
pub const MOST_BYTES: u64 = 1 << 20;

/// A look, with the data needed to show it elsewhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredLook {
    /// Version of the file format.
    afterlight_look: u32,
    /// Time of storing, in seconds since 1970.
    #[serde(default)]
    pub stored: u64,
    #[serde(default)]
    pub environment: LookEnvironment,
    look: SavedLook,
}

/// The environment of a look.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LookEnvironment {
    /// Name in the list.
    pub name: String,
    /// File of the panorama.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Name of a built-in environment.
    #[serde(skip_serializing_if = "Option::is_none")]
    built_in: Option<String>,
    /// Front direction in the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub front: Option<Front>,
}

impl LookEnvironment {
    fn from_listed(listed: &ListedEnvironment) -> Self {
        // A path that is not UTF-8 cannot be written; the name remains.
        let file = listed.file().filter(|file| file.to_str().is_some());
        Self {
            name: listed.name.clone(),
            file: file.map(Path::to_path_buf),
            built_in: match &listed.origin {
                Origin::BuiltIn(own) => Some(own.name.to_owned()),
                Origin::File(_) => None,
            },
            front: listed.front,
        }
    }

    fn origin(&self) -> Option<Origin> {
        match (&self.built_in, &self.file) {
            (Some(name), _) => built_in::named(name).map(Origin::BuiltIn),
            (None, file) => file.clone().map(Origin::File),
        }
    }

    /// Index in a list of the same file or built-in environment.
    pub fn place_in(&self, list: &[ListedEnvironment]) -> Option<usize> {
        let origin = self.origin()?;
        list.iter().position(|listed| listed.origin == origin)
    }

    /// Index of an environment with the same name, possibly a different file.
    pub fn namesake_in(&self, list: &[ListedEnvironment]) -> Option<usize> {
        environment_list::named(list, &self.name)
    }
}

/// Seconds since 1970.
fn now() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    now.map_or(0, |now| now.as_secs())
}

impl StoredLook {
    /// The current look, stored now.
    pub fn from_look(look: &LookSettings) -> Self {
        let shown = look.environments.get(look.environment);
        Self {
            afterlight_look: FORM,
            stored: now(),
            environment: shown.map_or_else(LookEnvironment::default, LookEnvironment::from_listed),
            look: SavedLook::from_look(look).of_any_clip(),
        }
    }

    /// Applies it to a look at frame 0, with the environment at `place`; None keeps the environment.
    pub fn apply(&self, look: &mut LookSettings, place: Option<usize>) {
        let (place, range) = (place.unwrap_or(look.environment), look.range);
        self.look.clone().apply(look);
        (look.environment, look.range) = (place, range);
    }

    /// This look in a window with this list and frame, under its own environment or else one of the same name. None if
    /// the list has neither.
    pub fn in_window(&self, window: &LookSettings, frame: usize) -> Option<LookSettings> {
        let list = &window.environments;
        let named = || self.environment.namesake_in(list);
        let place = self.environment.place_in(list).or_else(named)?;
        let mut look = window.clone();
        self.apply(&mut look, Some(place));
        look.follow(frame);
        Some(look)
    }

    /// True if a window at this frame shows this look.
    pub fn is(&self, window: &LookSettings, frame: usize) -> bool {
        self.in_window(window, frame).as_ref() == Some(window)
    }

    /// True if look and environment are the same, whenever both were stored.
    pub fn is_same(&self, other: &Self) -> bool {
        (&self.environment, &self.look) == (&other.environment, &other.look)
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Reads a file chosen in a dialog, following links.
    ///
    /// # Errors
    /// If it cannot be read, is too long, or is not a look.
    pub fn read(path: &Path) -> Result<Self> {
        let text = files::read_text(path, MOST_BYTES);
        let text = text.map_err(|e| Error::io("read", path, e, "Choose another file"))?;
        Self::parse(&text, path)
    }

    /// Reads one of the program's own files.
    ///
    /// # Errors
    /// As [`Self::read`], and if it is a link.
    pub fn read_own(path: &Path) -> Result<Self> {
        let read = || {
            let file = files::open_own(path, OpenOptions::new().read(true))?;
            let mut text = String::new();
            file.take(MOST_BYTES + 1).read_to_string(&mut text)?;
            Ok(text)
        };
        let text: std::io::Result<String> = read();
        let text = text.map_err(|e| Error::io("read the look in", path, e, LEFT))?;
        if text.len() as u64 > MOST_BYTES {
            let cause = format!("it has more than {MOST_BYTES} bytes");
            return Err(Error::codec("understand the look in", path, cause, LEFT));
        }
        Self::parse(&text, path)
    }

    fn parse(text: &str, path: &Path) -> Result<Self> {
        let fail = |cause: String| Error::codec("understand the look in", path, cause, LEFT);
        let look: Self = serde_json::from_str(text).map_err(|e| fail(e.to_string()))?;
        match look.afterlight_look {
            1..=FORM => Ok(look),
            _ => Err(fail("made by a newer Afterlight: update to open it".to_owned())),
        }
    }
}

/// Remedy for a file that cannot be parsed.
const LEFT: &str = "The file is unchanged";

#[cfg(test)]
mod tests {
    use super::super::command::LookCommand;
    use super::super::environment_list::Owner;
    use super::super::state::State;
    use super::*;
    use crate::command::ViewCommand;
    use scene::Setting;
    use std::sync::Arc;

    fn listed(name: &str, origin: Origin) -> ListedEnvironment {
        ListedEnvironment { name: name.to_owned(), origin, front: None, owner: Owner::Person }
    }

    fn window(environments: Vec<ListedEnvironment>) -> State {
        let mut state = State::new(10, 24.0);
        state.look.environments = Arc::new(environments);
        state
    }

    #[test]
    fn a_look_that_is_written_and_read_is_the_same_to_its_last_bit() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("look.json");
        let sky = listed("sky", Origin::File("/film/sky.exr".into()));
        let mut state = window(vec![sky]);
        // Numbers without a short decimal form.
        for i in 1..200u32 {
            let value = (i as f32).sqrt() * std::f32::consts::PI;
            state.change(LookCommand::Set(Setting::Yaw, value));
            state.release();
            state.change(LookCommand::Set(Setting::Exposure, value * 1e-3));
            state.release();
            let stored = StoredLook::from_look(&state.look);
            std::fs::write(&file, stored.text()).unwrap();
            let read = StoredLook::read(&file).unwrap();
            assert_eq!(read, stored);
            assert!(read.is(&state.look, 0), "{value}");
        }
        state.change(LookCommand::ToggleKey(Setting::Yaw));
        state.show(ViewCommand::LastFrame);
        state.change(LookCommand::Set(Setting::Yaw, 90.3));
        let stored = StoredLook::from_look(&state.look);
        assert!(stored.is(&state.look, 9));
        state.show(ViewCommand::Frame(4));
        assert!(stored.is(&state.look, 4), "the frame does not matter");
    }

    #[test]
    fn an_environment_is_found_by_its_file_before_its_name() {
        let own = built_in::all()[2];
        let one =
            window(vec![listed("sky", Origin::File("/film/sky.exr".into())), listed("Nave", Origin::BuiltIn(own))]);
        let stored = StoredLook::from_look(&one.look);
        let there = [
            listed("sky", Origin::File("/other/sky.exr".into())),
            listed("yard", Origin::File("/film/sky.exr".into())),
        ];
        assert_eq!(stored.environment.place_in(&there), Some(1));
        assert_eq!(stored.environment.namesake_in(&there), Some(0));
        let mut other = window(there[..1].to_vec());
        let shown = stored.in_window(&other.look, 0).unwrap();
        assert_eq!(shown.environment, 0);
        other.look.environments = Arc::default();
        assert_eq!(stored.in_window(&other.look, 0), None);

        let mut built_in = one;
        built_in.change(LookCommand::Environment(1));
        let stored = StoredLook::from_look(&built_in.look);
        let renamed = [listed("Chapel", Origin::BuiltIn(own))];
        assert_eq!(stored.environment.place_in(&renamed), Some(0));
    }

    #[test]
    fn what_is_no_look_is_refused_in_a_sentence() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("0001.json");
        let long = format!("\"{}\"", "x".repeat(MOST_BYTES as usize));
        for text in [
            "",
            "{}",
            "[1]",
            "{\"afterlight_look\": 1}",
            "{\"afterlight_look\": 9, \"look\": {}}",
            "{\"afterlight_look\": 1, \"look\": {\"exposure_stops\": \"bright\"}}",
            &long,
        ] {
            std::fs::write(&file, text).unwrap();
            for said in [StoredLook::read(&file), StoredLook::read_own(&file)] {
                let said = said.unwrap_err().to_string();
                assert!(said.contains("0001.json"), "{said}");
            }
        }
        std::fs::write(&file, [0xff, 0xfe, 0x00]).unwrap();
        assert!(StoredLook::read_own(&file).is_err());
        std::fs::write(&file, "{\"afterlight_look\": 1, \"look\": {}}").unwrap();
        assert!(StoredLook::read_own(&file).is_ok());
        #[cfg(unix)]
        {
            let link = folder.path().join("0002.json");
            std::os::unix::fs::symlink(&file, &link).unwrap();
            assert!(StoredLook::read(&link).is_ok());
            assert!(StoredLook::read_own(&link).is_err());
            let device = folder.path().join("0003.json");
            std::os::unix::fs::symlink("/dev/zero", &device).unwrap();
            assert!(StoredLook::read(&device).is_err());
        }
    }
}
