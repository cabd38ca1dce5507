//! The look of a project between two sessions: `look.json` beside `project.toml`, saved automatically.

use super::look::LookSettings;
use base::error::{Error, Result};
use base::files;
use light::Lighting;
use light::keyframes::Keyframes;
use project::Project;
use scene::{Animation, Background, Effects, Inspection, Setting};
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::path::PathBuf;

/// Part of a look that is saved. A file may leave anything out: it is as in a new window then.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedLook {
    /// The environment's name in the list.
    environment: String,
    yaw_deg: f32,
    /// Keys as files had them before every setting could have some: they are read, and never written.
    #[serde(skip_serializing)]
    yaw_keys: Keyframes,
    #[serde(skip_serializing)]
    intensity_keys: Keyframes,
    /// Keys by the names of their settings.
    keys: Animation,
    exposure_stops: f32,
    lighting: Lighting,
    effects: Effects,
    background: Background,
    /// First and last frame that are played and exported; none for all.
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<(usize, usize)>,
}

impl SavedLook {
    /// The file of a project.
    pub fn path(project: &Project) -> PathBuf {
        project.root.join("look.json")
    }

    /// Saved part of a look.
    pub fn of(look: &LookSettings) -> Self {
        let shown = look.environments.get(look.environment);
        Self {
            environment: shown.map_or(String::new(), |listed| listed.name.clone()),
            yaw_deg: look.yaw_deg,
            yaw_keys: Keyframes::NONE,
            intensity_keys: Keyframes::NONE,
            keys: look.animation.clone(),
            exposure_stops: look.exposure_stops,
            lighting: look.lighting.clone(),
            effects: look.effects,
            background: look.background,
            range: look.range,
        }
    }

    /// The same for other clips too: without the frames that are played and exported.
    pub(super) fn of_any_clip(self) -> Self {
        Self { range: None, ..self }
    }

    /// Look that is saved in a project; None if nothing is yet. With `mine`, this window may write there.
    ///
    /// # Errors
    /// When the file cannot be understood: if it is `mine`, it is renamed to `look.json.old`.
    pub fn load(project: &Project, mine: bool) -> Result<Option<Self>> {
        let path = Self::path(project);
        let parsed = match files::read_text(&path, files::MOST_TEXT) {
            Ok(text) => serde_json::from_str(&text).map_err(|e| e.to_string()),
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            // It cannot be read, holds no text or far too much, or is no file at all.
            Err(e) => Err(e.to_string()),
        };
        parsed.map(Some).map_err(|e| {
            let aside = path.with_extension("json.old");
            if !mine {
                let remedy = "It is left as it is, because this window only reads the project";
                return Error::codec("understand the look in", path, e, remedy);
            }
            // If it cannot be renamed, the next change overwrites it, and the error says so.
            let moved = std::fs::rename(&path, &aside);
            let remedy = match moved {
                Ok(()) => format!("It was renamed to {}", files::shown(&aside)),
                Err(_) => "Copy it before you change the light, which overwrites it".to_owned(),
            };
            Error::codec("understand the look in", path, e, remedy)
        })
    }

    /// Applies it to the look of a window at its first frame, after the list of environments is known.
    pub fn apply(self, look: &mut LookSettings) {
        let place = (look.environments.iter()).position(|listed| listed.name == self.environment);
        look.environment = place.unwrap_or(look.environment);
        look.animation = self.keys;
        for (setting, keys) in
            [(Setting::Yaw, self.yaw_keys), (Setting::Intensity, self.intensity_keys)]
        {
            if !look.is_keyed(setting) {
                look.animation.set(setting, keys);
            }
        }
        look.turn_to(self.yaw_deg);
        look.expose(self.exposure_stops);
        look.lighting = self.lighting;
        look.effects = Effects {
            // What is looked at in place of the picture was once part of the look.
            inspection: Inspection::Picture,
            ..self.effects.bounded()
        };
        look.background = self.background;
        look.range = self.range.filter(|(first, last)| first <= last);
        look.number_lights();
        look.follow(0);
    }

    /// Look from the text that [`Self::text`] gave.
    pub fn of_text(text: &str) -> Option<Self> {
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
    use test_support::small_disk::names;

    #[test]
    fn a_look_comes_back_and_a_broken_file_is_put_aside() {
        let folder = tempfile::tempdir().unwrap();
        let project = project::Project::without_shoot(folder.path());
        assert_eq!(SavedLook::load(&project, true).unwrap(), None);
        let mut state = State::new(10, 24.0);
        state.change(LookCommand::Yaw(40.0));
        state.change(LookCommand::Exposure(-1.5));
        state.change(LookCommand::Background(Background::None));
        let kept = SavedLook::of(&state.look);
        std::fs::write(SavedLook::path(&project), kept.text()).unwrap();
        let mut other = State::new(10, 24.0);
        let read = SavedLook::load(&project, true).unwrap().unwrap();
        read.apply(&mut other.look);
        assert_eq!(other.look, state.look);

        // With keys it was saved at the last frame and is shown at the first.
        state.change(LookCommand::ToggleKey(Setting::Yaw));
        state.show(ViewCommand::LastFrame);
        state.change(LookCommand::Yaw(90.0));
        SavedLook::of(&state.look).apply(&mut other.look);
        assert_eq!(other.look.yaw_deg, 40.0);

        std::fs::write(SavedLook::path(&project), "{\"exposure_stops\": 99}").unwrap();
        let read = SavedLook::load(&project, true).unwrap().unwrap();
        read.apply(&mut other.look);
        assert_eq!((other.look.exposure_stops, other.look.yaw_deg), (10.0, 0.0));

        // Keys as files had them before every setting could have some, and of a light that is gone.
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
        let text = SavedLook::of(&other.look).text();
        assert!(!text.contains("yaw_keys") && text.contains("\"yaw\": {"), "{text}");
        let mut again = State::new(10, 24.0);
        SavedLook::of_text(&text).unwrap().apply(&mut again.look);
        assert_eq!(again.look, other.look);

        std::fs::write(SavedLook::path(&project), "half a f").unwrap();
        // Another window's file stays where it is.
        let said = SavedLook::load(&project, false).unwrap_err().to_string();
        assert!(said.contains("look.json") && !said.contains(".old"), "{said}");
        assert_eq!(names(folder.path()), ["look.json"]);
        let said = SavedLook::load(&project, true).unwrap_err().to_string();
        assert!(said.contains("look.json.old"), "{said}");
        let aside = folder.path().join("look.json.old");
        assert_eq!(std::fs::read_to_string(aside).unwrap(), "half a f");
        // What has no end is put aside too.
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("/dev/zero", SavedLook::path(&project)).unwrap();
            let said = SavedLook::load(&project, true).unwrap_err().to_string();
            assert!(said.contains("device"), "{said}");
            assert_eq!(names(folder.path()), ["look.json.old"]);
        }
        test_support::shown!(
            Accidents,
            "`look.json` that cannot be understood",
            danger: "a second window, which only reads, renames a file that another window writes",
            done: "only the window that may write puts it aside; any other leaves it and says so"
        );
    }
}
