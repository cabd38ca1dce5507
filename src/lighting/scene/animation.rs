//! Keys of settings, by setting name.

use super::Setting;
use light::keyframes::Keyframes;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Keys of each animated setting.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "BTreeMap<Setting, Keyframes>", into = "BTreeMap<Setting, Keyframes>")]
pub struct Animation {
    lanes: BTreeMap<Setting, Keyframes>,
}

impl From<BTreeMap<Setting, Keyframes>> for Animation {
    fn from(mut lanes: BTreeMap<Setting, Keyframes>) -> Self {
        lanes.retain(|_, keys| !keys.keys().is_empty());
        Self { lanes }
    }
}

impl From<Animation> for BTreeMap<Setting, Keyframes> {
    fn from(animation: Animation) -> Self {
        animation.lanes
    }
}

impl Animation {
    /// Keys of a setting; None without keys.
    pub fn keys(&self, setting: Setting) -> Option<&Keyframes> {
        self.lanes.get(&setting)
    }

    /// Animated settings, in the order of the window.
    pub fn lanes(&self) -> impl Iterator<Item = (Setting, &Keyframes)> {
        self.lanes.iter().map(|(setting, keys)| (*setting, keys))
    }

    /// True if no setting has keys.
    pub fn is_empty(&self) -> bool {
        self.lanes.is_empty()
    }

    /// Replaces the keys of a setting.
    pub fn set(&mut self, setting: Setting, keys: Keyframes) {
        if keys.keys().is_empty() {
            self.lanes.remove(&setting);
        } else {
            self.lanes.insert(setting, keys);
        }
    }

    /// Removes the keys of every setting for which `keeps` is false.
    pub fn retain(&mut self, keeps: impl Fn(Setting) -> bool) {
        self.lanes.retain(|setting, _| keeps(*setting));
    }

    /// Value of a setting at a frame, within its range; None without keys.
    pub fn value(&self, setting: Setting, frame: f64) -> Option<f32> {
        let value = self.keys(setting)?.at(frame)?;
        Some(setting.bounded(value) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LightSetting, Look, Pass};
    use light::keyframes::{Interpolation, Key};
    use light::{Lighting, PlacedLight};

    fn keys(text: &str) -> Keyframes {
        text.parse().unwrap()
    }

    #[test]
    fn what_has_keys_follows_them_and_nothing_else_changes() {
        let mut animation = Animation::default();
        let azimuth = Setting::Light(2, LightSetting::Yaw);
        animation.set(Setting::Pitch, keys("0:0,10:20"));
        animation.set(Setting::Effect(Pass::Glare), keys("0:0.5,10:0.5"));
        animation.set(azimuth, keys("0:-90,10:270"));
        // A light that does not exist.
        animation.set(Setting::Light(7, LightSetting::Yaw), keys("0:1"));
        let before = Lighting {
            placed: vec![
                PlacedLight { id: 1, ..PlacedLight::default() },
                PlacedLight { id: 2, ..PlacedLight::default() },
            ],
            roll_deg: 3.0,
            ..Lighting::default()
        };
        let before = Look { yaw_deg: 30.0, exposure_stops: 1.0, lighting: before, animation, ..Look::default() };
        let mut expected = before.clone();
        expected.lighting.pitch_deg = 10.0;
        expected.lighting.placed[1].yaw_deg = 90.0;
        expected.effects.glare = 0.5;
        assert_eq!(before.at(5), expected);
    }

    #[test]
    fn a_curve_that_leaves_the_range_of_its_setting_is_cut_there() {
        let mut steep = keys("0:0.8,10:0.8");
        steep.set_kind(0, Interpolation::Bezier);
        steep.set_slopes(0, [None, Some(2.0)]).unwrap();
        steep.set_slopes(1, [Some(2.0), None]).unwrap();
        assert!(steep.at(2.0).unwrap() > 2.0 && steep.at(8.0).unwrap() < -1.0);
        let mut animation = Animation::default();
        animation.set(Setting::Effect(Pass::Glare), steep);
        animation.set(Setting::Exposure, keys("3:1e9"));
        let glare = |frame| animation.value(Setting::Effect(Pass::Glare), frame);
        assert_eq!((glare(2.0), glare(8.0), glare(0.0)), (Some(1.0), Some(0.0), Some(0.8)));
        assert_eq!(animation.value(Setting::Exposure, 0.0), Some(10.0));
        assert_eq!(animation.value(Setting::Tint, 0.0), None);
    }

    #[test]
    fn a_file_names_each_setting_and_lanes_without_keys_are_left_out() {
        let mut animation = Animation::default();
        animation.set(Setting::Effect(Pass::Glare), keys("0:0.5"));
        animation.set(Setting::Light(3, LightSetting::Red), keys("0:1,8:0"));
        animation.set(Setting::Yaw, Keyframes::NONE);
        let text = serde_json::to_string(&animation).unwrap();
        assert_eq!(
            text,
            r#"{"effects.glare":{"interpolation":"smooth","keys":[{"frame":0.0,"value":0.5}]},"lights.3.red":{"interpolation":"smooth","keys":[{"frame":0.0,"value":1.0},{"frame":8.0,"value":0.0}]}}"#
        );
        assert_eq!(serde_json::from_str::<Animation>(&text).unwrap(), animation);
        let short = r#"{"tint": {"keys": [{"frame": 4, "value": -3}]}, "roll": {}}"#;
        let read: Animation = serde_json::from_str(short).unwrap();
        let lanes: Vec<Setting> = read.lanes().map(|(setting, _)| setting).collect();
        assert_eq!(lanes, [Setting::Tint]);
        let key = Key { frame: 4.0, value: -3.0, ..Key::default() };
        assert_eq!(read.keys(Setting::Tint).unwrap().keys(), [key]);
        for broken in [
            r#"{"tilt": {"keys": []}}"#,
            r#"{"tint": {"keys": [{"frame": 1e99, "value": 0}]}}"#,
            r#"{"tint": {"keys": [{"frame": 1, "value": 0, "in": 1e99}]}}"#,
        ] {
            assert!(serde_json::from_str::<Animation>(broken).is_err(), "{broken}");
        }
        animation.retain(|setting| setting == Setting::Yaw);
        assert!(animation.is_empty());
    }
}
