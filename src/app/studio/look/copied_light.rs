//! A placed light on the clipboard, with its keys, for this look or another.

use super::LookSettings;
use light::{Lighting, PlacedLight};
use scene::{Animation, LightSetting, Setting};
use serde::{Deserialize, Serialize};

/// Most letters in the name of a light or a group.
pub const MOST_LETTERS: usize = 40;

/// A light, with the keys of its settings at their own frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CopiedLight {
    light: PlacedLight,
    #[serde(default, skip_serializing_if = "Animation::is_empty")]
    keys: Animation,
}

impl From<PlacedLight> for CopiedLight {
    /// A copy without keys.
    fn from(light: PlacedLight) -> Self {
        Self { light, keys: Animation::default() }
    }
}

impl CopiedLight {
    /// A copy of the light with this index.
    pub fn new(look: &LookSettings, index: usize) -> Option<Self> {
        let light = look.lighting.placed.get(index)?.clone();
        let mut keys = look.animation.clone();
        keys.retain(|setting| matches!(setting, Setting::Light(of, _) if of == light.id));
        Some(Self { light, keys })
    }

    /// The text for the clipboard.
    pub fn text(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Parses the text from [`Self::text`].
    ///
    /// # Errors
    /// A sentence if the text holds no light.
    pub fn parse(text: &str) -> Result<Self, String> {
        let none = "The clipboard holds no light. Choose one and press Ctrl+C";
        serde_json::from_str(text).map_err(|_| none.to_owned())
    }
}

impl LookSettings {
    /// Adds a light with its keys. It gets a new id, a new name if its own is taken, and its group if that exists here.
    pub(crate) fn add_light(&mut self, CopiedLight { light, keys }: CopiedLight) {
        let lighting = &mut self.lighting;
        let id = lighting.another_light().id;
        let group = lighting.group_of(&light).map(|group| group.name.clone());
        let added =
            PlacedLight { id, name: free_name(&light.name, lighting), group: group.unwrap_or_default(), ..light };
        lighting.placed.push(added);
        for (setting, keys) in keys.lanes() {
            if let Setting::Light(_, setting) = setting {
                self.animation.set(Setting::Light(id, setting), keys.clone());
            }
        }
        // The id in the text is arbitrary.
        for setting in LightSetting::ALL {
            let look_setting = Setting::Light(id, setting);
            if let Some(value) = look_setting.field(&mut self.shown) {
                *value = look_setting.bounded(f64::from(*value)) as f32;
            }
        }
    }
}

/// The name, or the first free one of "NAME 2", "NAME 3"…. A light without a name is called by its place.
fn free_name(name: &str, lighting: &Lighting) -> String {
    let is_taken = |name: &str| lighting.placed.iter().any(|light| light.name == name);
    if name.is_empty() || !is_taken(name) {
        return name.chars().take(MOST_LETTERS).collect();
    }
    let bare = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let bare = if bare.ends_with(' ') { bare } else { name };
    let stem: String = bare.trim_end().chars().take(MOST_LETTERS - 4).collect();
    let mut all = (2..).map(|number| format!("{stem} {number}"));
    all.find(|name| !is_taken(name)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{LookCommand, ViewCommand};
    use crate::state::State;
    use light::LightGroup;

    /// A look with a light in a group, whose azimuth goes from −90° to 90°.
    fn lit() -> State {
        let mut s = State::new(11, 24.0);
        let lighting = Lighting {
            placed: vec![PlacedLight {
                name: "Key".to_owned(),
                group: "Left".to_owned(),
                yaw_deg: -90.0,
                ..PlacedLight::default()
            }],
            groups: vec![LightGroup { name: "Left".to_owned(), ..LightGroup::default() }],
            ..Lighting::default()
        };
        s.change(LookCommand::Lighting(Box::new(lighting)));
        let keys = "0:-90,10:90".parse().unwrap();
        let setting = Setting::Light(1, LightSetting::Yaw);
        s.change(LookCommand::Keys(vec![(setting, keys)]));
        s.release();
        s
    }

    fn add(s: &mut State, copied: CopiedLight) {
        s.change(LookCommand::AddLight(Box::new(copied)));
        s.release();
    }

    #[test]
    fn a_copy_has_the_keys_the_group_and_a_name_of_its_own_and_is_one_step() {
        let mut s = lit();
        s.show(ViewCommand::Frame(5));
        let before = s.look.clone();
        let copied = CopiedLight::new(&s.look, 0).unwrap();
        for _ in 0..2 {
            add(&mut s, copied.clone());
        }
        let lights = &s.look.lighting.placed;
        let names: Vec<_> = lights.iter().map(|l| (l.id, &*l.name, &*l.group)).collect();
        let expected = [(1, "Key", "Left"), (2, "Key 2", "Left"), (3, "Key 3", "Left")];
        assert_eq!(names, expected);
        let yaw = |id| Setting::Light(id, LightSetting::Yaw);
        assert_eq!(s.look.keys(yaw(3)), s.look.keys(yaw(1)));
        // A copy of a copy continues the numbers.
        let third = CopiedLight::new(&s.look, 2).unwrap();
        add(&mut s, third);
        assert_eq!(s.look.lighting.placed[3].name, "Key 4");
        for _ in 0..3 {
            s.change(LookCommand::Undo);
        }
        assert_eq!(s.look, before);
        assert_eq!(s.look.animation.lanes().count(), 1);
    }

    #[test]
    fn a_light_goes_through_the_clipboard_into_another_look() {
        let copied = CopiedLight::new(&lit().look, 0).unwrap();
        let pasted = CopiedLight::parse(&copied.text()).unwrap();
        assert_eq!(pasted, copied);
        let mut other = State::new(11, 24.0);
        add(&mut other, pasted);
        let light = &other.look.lighting.placed[0];
        assert_eq!((light.id, &*light.name, &*light.group), (1, "Key", ""));
        other.show(ViewCommand::Frame(10));
        assert_eq!(other.look.lighting.placed[0].yaw_deg, 90.0);
    }

    #[test]
    fn any_text_is_refused_or_gives_a_light_within_the_ranges() {
        for text in ["", "no light", "{}", "[1]", "{\"yaw\": {\"keys\": []}}"] {
            let said = CopiedLight::parse(text).unwrap_err();
            assert!(said.contains("no light"), "{text}: {said}");
        }
        let far = r#"{"light": {"id": 7, "pitch_deg": 1e30, "radius_deg": -5, "intensity": 1e30},
            "keys": {"lights.9.red": {"keys": [{"frame": 0, "value": 0.5}]}, "yaw": {"keys": [{"frame": 0, "value": 1}]}}}"#;
        let mut s = lit();
        add(&mut s, CopiedLight::parse(far).unwrap());
        let light = &s.look.lighting.placed[1];
        assert_eq!(
            (light.id, light.pitch_deg, light.radius_deg, light.intensity, light.color[0]),
            (2, 90.0, 0.0, 1e4, 0.5)
        );
        assert!(!s.look.is_keyed(Setting::Yaw), "the key belongs to no light");
        let long = "x".repeat(90);
        let name = free_name(&long, &s.look.lighting);
        assert_eq!(name.chars().count(), MOST_LETTERS);
    }
}
