//! The look of a project between two sessions: `look.json` beside `project.toml`, saved automatically.

use super::environment_list;
use super::look::LookSettings;
use base::error::{Error, Result};
use base::files;
use light::keyframes::Keyframes;
use project::Project;
use scene::{Effects, Inspection, Look, Setting};
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::path::PathBuf;

/// The saved part of a look. Missing fields have the values of a new window.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedLook {
    /// Name of the environment in the list.
    environment: String,
    #[serde(flatten)]
    look: Look,
    /// Keys of older files, from before every setting could have keys: read, but never written.
    #[serde(skip_serializing)]
    yaw_keys: Keyframes,
    #[serde(skip_serializing)]
    intensity_keys: Keyframes,
    /// First and last frame to play and export; None for all.
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<(usize, usize)>,
}

impl SavedLook {
    /// The look file of a project.
    pub fn path(project: &Project) -> PathBuf {
        project.root.join("look.json")
    }

    /// The saved part of a look.
    pub fn from_look(look: &LookSettings) -> Self {
        let shown = look.environments.get(look.environment);
        Self {
            environment: shown.map_or(String::new(), |listed| listed.name.clone()),
            look: look.shown.clone(),
            yaw_keys: Keyframes::NONE,
            intensity_keys: Keyframes::NONE,
            range: look.range,
        }
    }

    /// The same for any clip: without the range of frames to play and export.
    pub(super) fn of_any_clip(self) -> Self {
        Self { range: None, ..self }
    }

    /// The look saved in a project; None if there is none yet. `mine`: this window may write to the project.
    ///
    /// # Errors
    /// If the file cannot be parsed. If `mine`, it is then renamed to `look.json.old`.
    pub fn load(project: &Project, mine: bool) -> Result<Option<Self>> {
        let path = Self::path(project);
        let parsed = match files::read_text(&path, files::MOST_TEXT) {
            Ok(text) => serde_json::from_str(&text).map_err(|e| e.to_string()),
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            // Unreadable, not text, far too long, or not a file.
            Err(e) => Err(e.to_string()),
        };
        parsed.map(Some).map_err(|e| {
            let aside = path.with_extension("json.old");
            if !mine {
                let remedy = "The file is unchanged: this window is read-only";
                return Error::codec("understand the look in", path, e, remedy);
            }
            // Without a rename, the next change overwrites the file, as the error says.
            let moved = std::fs::rename(&path, &aside);
            let remedy = match moved {
                Ok(()) => format!("It was renamed to {}", files::shown(&aside)),
                Err(_) => "Copy it before you change the light, which overwrites it".to_owned(),
            };
            Error::codec("understand the look in", path, e, remedy)
        })
    }

    /// Applies it to the look of a window at frame 0, once the environment list is known.
    pub fn apply(self, look: &mut LookSettings) {
        let place = environment_list::named(&look.environments, &self.environment);
        look.environment = place.unwrap_or(look.environment);
        let Look { yaw_deg, exposure_stops, .. } = self.look;
        look.shown = Look {
            yaw_deg: look.yaw_deg,
            exposure_stops: look.exposure_stops,
            // In older files, the inspection was part of the look.
            effects: Effects { inspection: Inspection::Picture, ..self.look.effects.bounded() },
            background: self.look.background.bounded(),
            ..self.look
        };
        for (setting, keys) in [(Setting::Yaw, self.yaw_keys), (Setting::Intensity, self.intensity_keys)] {
            if !look.is_keyed(setting) {
                look.animation.set(setting, keys);
            }
        }
        look.set(Setting::Yaw, yaw_deg);
        look.set(Setting::Exposure, exposure_stops);
        look.range = self.range.filter(|(first, last)| first <= last);
        look.number_lights();
        look.follow(0);
    }

    /// Parses the text from [`Self::text`].
    pub fn parse(text: &str) -> Option<Self> {
        serde_json::from_str(text).ok()
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }
}

#[cfg(all(test, target_os = "linux"))]
#[path = "saved_look_crash_tests.rs"]
mod crash_tests;

#[cfg(test)]
mod tests {
    use super::super::command::{LookCommand, ViewCommand};
    use super::super::state::State;
    use super::*;
    use scene::Background;
    use test_support::small_disk::names;

    #[test]
    fn a_look_comes_back_and_a_broken_file_is_put_aside() {
        let folder = tempfile::tempdir().unwrap();
        let project = project::Project::without_shoot(folder.path());
        assert_eq!(SavedLook::load(&project, true).unwrap(), None);
        let mut state = State::new(10, 24.0);
        state.change(LookCommand::Set(Setting::Yaw, 40.0));
        state.change(LookCommand::Set(Setting::Exposure, -1.5));
        state.change(LookCommand::Background(Background::None));
        let kept = SavedLook::from_look(&state.look);
        std::fs::write(SavedLook::path(&project), kept.text()).unwrap();
        let mut other = State::new(10, 24.0);
        let read = SavedLook::load(&project, true).unwrap().unwrap();
        read.apply(&mut other.look);
        assert_eq!(other.look, state.look);

        // Saved at the last frame, and shown at the first because of its keys.
        state.change(LookCommand::ToggleKey(Setting::Yaw));
        state.show(ViewCommand::LastFrame);
        state.change(LookCommand::Set(Setting::Yaw, 90.0));
        SavedLook::from_look(&state.look).apply(&mut other.look);
        assert_eq!(other.look.yaw_deg, 40.0);

        std::fs::write(SavedLook::path(&project), "{\"exposure_stops\": 99}").unwrap();
        let read = SavedLook::load(&project, true).unwrap().unwrap();
        read.apply(&mut other.look);
        assert_eq!((other.look.exposure_stops, other.look.yaw_deg), (10.0, 0.0));

        // Keys of an older file, from before every setting could have keys, and keys of a removed light.
        let old = r#"{"yaw_keys": {"keys": [{"frame": 0, "value": 10}, {"frame": 8, "value": 30}]},
            "intensity_keys": {"interpolation": "linear", "keys": [{"frame": 4, "value": 1.5}]},
            "keys": {"lights.4.yaw": {"keys": [{"frame": 0, "value": 10}]}},
            "lighting": {"placed": [{"yaw_deg": 20}]}}"#;
        std::fs::write(SavedLook::path(&project), old).unwrap();
        let read = SavedLook::load(&project, true).unwrap().unwrap();
        read.apply(&mut other.look);
        let keyed: Vec<Setting> = other.look.animation.lanes().map(|(of, _)| of).collect();
        assert_eq!(keyed, [Setting::Yaw, Setting::Intensity]);
        assert_eq!(other.look.yaw_deg, 10.0);
        assert_eq!(other.look.lighting.intensity_stops, 1.5);
        assert_eq!(other.look.lighting.placed[0].id, 1);
        let text = SavedLook::from_look(&other.look).text();
        assert!(!text.contains("yaw_keys") && text.contains("\"yaw\": {"), "{text}");
        let mut again = State::new(10, 24.0);
        SavedLook::parse(&text).unwrap().apply(&mut again.look);
        assert_eq!(again.look, other.look);

        std::fs::write(SavedLook::path(&project), "half a f").unwrap();
        // A file of another window stays in place.
        let said = SavedLook::load(&project, false).unwrap_err().to_string();
        assert!(said.contains("look.json") && !said.contains(".old"), "{said}");
        assert_eq!(names(folder.path()), ["look.json"]);
        let said = SavedLook::load(&project, true).unwrap_err().to_string();
        assert!(said.contains("look.json.old"), "{said}");
        let aside = folder.path().join("look.json.old");
        assert_eq!(std::fs::read_to_string(aside).unwrap(), "half a f");
        // An endless file is put aside too.
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("/dev/zero", SavedLook::path(&project)).unwrap();
            let said = SavedLook::load(&project, true).unwrap_err().to_string();
            assert!(said.contains("device"), "{said}");
            assert_eq!(names(folder.path()), ["look.json.old"]);
        }
        test_support::shown!(
            Accidents,
            "`look.json` that cannot be parsed",
            done: "only the window that may write puts it aside; any other window leaves it and says so"
        );
    }
}
