//! Selected keys of the timeline, and operations on them. Each operation returns the changed lanes.

use light::Lighting;
use light::keyframes::{Interpolation, Key, Keyframes};
use scene::{Animation, Setting};

/// Settings with their new keys.
pub type Lanes = Vec<(Setting, Keyframes)>;

/// Selected keys, by setting and frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KeySelection {
    keys: Vec<(Setting, f64)>,
}

impl KeySelection {
    /// A single key.
    pub fn one(setting: Setting, frame: f64) -> Self {
        Self { keys: vec![(setting, frame)] }
    }

    /// All keys of a setting.
    pub fn lane(setting: Setting, animation: &Animation) -> Self {
        let keys = animation.keys(setting).map_or(&[][..], Keyframes::keys);
        Self { keys: keys.iter().map(|key| (setting, key.frame)).collect() }
    }

    /// All keys of all settings.
    pub fn all(animation: &Animation) -> Self {
        let lanes = animation.lanes().map(|(setting, _)| setting);
        Self { keys: lanes.flat_map(|of| Self::lane(of, animation).keys).collect() }
    }

    pub fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    pub fn len(&self) -> usize {
        self.keys.len()
    }

    pub fn contains(&self, setting: Setting, frame: f64) -> bool {
        self.keys.contains(&(setting, frame))
    }

    pub fn add(&mut self, setting: Setting, frame: f64) {
        if !self.contains(setting, frame) {
            self.keys.push((setting, frame));
        }
    }

    /// Adds a key, or removes it.
    pub fn toggle(&mut self, setting: Setting, frame: f64) {
        match self.keys.iter().position(|key| *key == (setting, frame)) {
            Some(place) => drop(self.keys.remove(place)),
            None => self.add(setting, frame),
        }
    }

    /// Drops keys that no longer exist.
    pub fn keep(&mut self, animation: &Animation) {
        self.keys.retain(|(setting, frame)| {
            let keys = animation.keys(*setting);
            keys.is_some_and(|keys| keys.index_at(*frame).is_some())
        });
    }

    /// The selected keys of one setting.
    pub fn within(&self, setting: Setting) -> Self {
        let own = self.keys.iter().filter(|(of, _)| *of == setting);
        Self { keys: own.copied().collect() }
    }

    /// The lanes with selected keys after `change`, which gets each lane and its selected frames.
    fn changed(&self, animation: &Animation, change: impl Fn(Setting, &mut Keyframes, &[f64])) -> Lanes {
        let mut lanes = Lanes::new();
        for (setting, keys) in animation.lanes() {
            let own = self.keys.iter().filter(|(of, _)| *of == setting);
            let frames: Vec<f64> = own.map(|(_, frame)| *frame).collect();
            if !frames.is_empty() {
                let mut keys = keys.clone();
                change(setting, &mut keys, &frames);
                lanes.push((setting, keys));
            }
        }
        lanes
    }

    /// Moves all keys by `frames`, within the first frame and `last`, and raises their values by `value`, within the
    /// range of their settings. A moved key replaces an unselected key at its new frame.
    pub fn moved(&self, animation: &Animation, frames: f64, value: f64, last: usize) -> (Lanes, Self) {
        let all = self.keys.iter().map(|(_, frame)| *frame);
        let earliest = all.clone().fold(f64::INFINITY, f64::min);
        let latest = all.fold(f64::NEG_INFINITY, f64::max);
        let least = (-earliest).min(0.0);
        let frames = frames.clamp(least, (last as f64 - latest).max(0.0).max(least));
        let lanes = self.changed(animation, |setting, keys, selected| {
            let taken = take(keys, selected);
            for key in taken {
                // The frame is within the bounds of a key.
                let _ = keys.put(Key {
                    frame: key.frame + frames,
                    value: match value {
                        0.0 => key.value,
                        _ => setting.bounded(key.value + value),
                    },
                    ..key
                });
            }
        });
        let keys = self.keys.iter();
        let keys = keys.map(|(setting, frame)| (*setting, frame + frames));
        let moved = Self { keys: keys.collect() };
        (lanes, moved)
    }

    /// Removes all selected keys.
    pub fn removed(&self, animation: &Animation) -> Lanes {
        self.changed(animation, |_, keys, selected| drop(take(keys, selected)))
    }

    /// Sets the interpolation from the selected keys to the next ones.
    pub fn interpolated(&self, animation: &Animation, kind: Interpolation) -> Lanes {
        self.changed(animation, |_, keys, selected| {
            for index in selected.iter().filter_map(|frame| keys.index_at(*frame)).collect::<Vec<_>>() {
                keys.set_kind(index, kind);
            }
        })
    }

    /// Resets the tangents to automatic.
    pub fn with_automatic_tangents(&self, animation: &Animation) -> Lanes {
        self.changed(animation, |_, keys, selected| {
            for index in selected.iter().filter_map(|frame| keys.index_at(*frame)).collect::<Vec<_>>() {
                // The key exists.
                let _ = keys.set_slopes(index, [None, None]);
            }
        })
    }

    /// True if at least one selected key has a tangent that was set by hand.
    pub fn has_own_tangents(&self, animation: &Animation) -> bool {
        self.changed(animation, |_, _, _| {})
            .iter()
            .flat_map(|(setting, keys)| keys.keys().iter().map(|key| (*setting, key)))
            .filter(|(setting, key)| self.contains(*setting, key.frame))
            .any(|(_, key)| key.slope_in.is_some() || key.slope_out.is_some())
    }

    /// The common interpolation of the selected keys; None if they differ.
    pub fn kind(&self, animation: &Animation) -> Option<Interpolation> {
        let mut kinds = self.keys.iter().filter_map(|(setting, frame)| {
            let keys = animation.keys(*setting)?;
            Some(keys.kind(keys.index_at(*frame)?))
        });
        let first = kinds.next()?;
        kinds.all(|kind| kind == first).then_some(first)
    }

    /// A copy as text with the first key at frame 0, in the format of `relight --keys`.
    pub fn copied(&self, animation: &Animation) -> String {
        let frames = self.keys.iter().map(|(_, frame)| *frame);
        let first = frames.fold(f64::INFINITY, f64::min);
        let mut copy = Animation::default();
        for (setting, keys) in self.changed(animation, |_, _, _| {}) {
            let mut own = Keyframes::NONE;
            own.interpolation = keys.interpolation;
            for (index, key) in keys.keys().iter().enumerate() {
                if self.contains(setting, key.frame) {
                    let key = Key { frame: key.frame - first, interpolation: Some(keys.kind(index)), ..*key };
                    // The frame is within the bounds of a key.
                    let _ = own.put(key);
                }
            }
            copy.set(setting, own);
        }
        serde_json::to_string_pretty(&copy).unwrap_or_default()
    }
}

/// Removes the keys at these frames and returns them.
fn take(keys: &mut Keyframes, frames: &[f64]) -> Vec<Key> {
    let take = |frame: &f64| keys.remove(keys.index_at(*frame)?);
    frames.iter().filter_map(take).collect()
}

/// Target of a paste.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Onto {
    /// Keys of a single lane go to this lane, if it has the same unit. Keys of a single light go to this lane's light.
    /// All others go to their own settings.
    Lane(Option<Setting>),
    /// Keys of a single light go to this light.
    Light(u32),
}

impl Onto {
    /// The light that keys of a single light go to.
    fn light(self) -> Option<u32> {
        match self {
            Self::Lane(Some(Setting::Light(id, _))) | Self::Light(id) => Some(id),
            Self::Lane(_) => None,
        }
    }

    /// Target of a setting's keys. `is_one`: the copy has a single lane; `is_light`: its keys belong to a single light.
    fn target(self, of: Setting, (is_one, is_light): (bool, bool)) -> Setting {
        match (self, of) {
            (Self::Lane(Some(lane)), _) if is_one && lane.unit() == of.unit() => lane,
            (_, Setting::Light(own, setting)) if is_light => Setting::Light(self.light().unwrap_or(own), setting),
            _ => of,
        }
    }
}

/// Pastes keys from [`KeySelection::copied`], the first at `frame`. Returns the changed lanes and the pasted keys.
///
/// # Errors
/// A sentence if the text holds no keys, no keys of existing settings, or, for a light, other keys than those of a
/// single light.
pub fn pasted(
    text: &str,
    frame: usize,
    onto: Onto,
    (animation, lighting): (&Animation, &Lighting),
) -> Result<(Lanes, KeySelection), String> {
    let copy: Option<Animation> = serde_json::from_str(text).ok();
    let copy =
        copy.filter(|copy| !copy.is_empty()).ok_or("The clipboard holds no keys. Select some and press Ctrl+C")?;
    let is_one = copy.lanes().count() == 1;
    let light = |(of, _)| match of {
        Setting::Light(id, _) => Some(id),
        _ => None,
    };
    let first = copy.lanes().next().and_then(light);
    let is_light = first.is_some() && copy.lanes().all(|lane| light(lane) == first);
    if !is_light && matches!(onto, Onto::Light(_)) {
        return Err("Only keys of one light can be pasted onto another light".to_owned());
    }
    let (mut lanes, mut selection) = (Lanes::new(), KeySelection::default());
    for (of, copied) in copy.lanes() {
        let setting = onto.target(of, (is_one, is_light));
        if !setting.exists(lighting) {
            continue;
        }
        let mut keys = animation.keys(setting).cloned().unwrap_or_default();
        for (index, key) in copied.keys().iter().enumerate() {
            let key = Key {
                frame: key.frame + frame as f64,
                value: setting.bounded(key.value),
                interpolation: Some(copied.kind(index)),
                ..*key
            };
            if keys.put(key).is_ok() {
                selection.add(setting, key.frame);
            }
        }
        lanes.push((setting, keys));
    }
    if selection.is_empty() {
        Err("The copied keys belong to lights that are not in this look".to_owned())
    } else {
        Ok((lanes, selection))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use light::PlacedLight;
    use scene::{LightSetting, Pass};

    fn keys(text: &str) -> Keyframes {
        text.parse().unwrap()
    }

    fn animation(lanes: &[(Setting, &str)]) -> Animation {
        let mut animation = Animation::default();
        for (setting, text) in lanes {
            animation.set(*setting, keys(text));
        }
        animation
    }

    fn selection(keys: &[(Setting, f64)]) -> KeySelection {
        KeySelection { keys: keys.into() }
    }

    const YAW: Setting = Setting::Yaw;
    const PITCH: Setting = Setting::Pitch;
    const GLARE: Setting = Setting::Effect(Pass::Glare);

    fn frames(lanes: &Lanes, of: Setting) -> Vec<f64> {
        let lane = lanes.iter().find(|(setting, _)| *setting == of);
        let keys = lane.unwrap().1.keys();
        keys.iter().map(|key| key.frame).collect()
    }

    #[test]
    fn keys_of_many_lanes_move_together_and_stay_within_the_clip() {
        let animation = animation(&[(YAW, "2:0,5:30,9:60"), (GLARE, "4:0.5,8:1")]);
        let selected = selection(&[(YAW, 2.0), (YAW, 5.0), (GLARE, 4.0)]);
        let (lanes, moved) = selected.moved(&animation, 2.0, 0.0, 10);
        assert_eq!(frames(&lanes, YAW), [4.0, 7.0, 9.0]);
        assert_eq!(frames(&lanes, GLARE), [6.0, 8.0]);
        assert!(moved.contains(YAW, 7.0) && moved.contains(GLARE, 6.0) && moved.len() == 3);
        let (lanes, _) = selected.moved(&animation, -99.0, 0.0, 10);
        assert_eq!(frames(&lanes, YAW), [0.0, 3.0, 9.0]);
        let (lanes, _) = selected.moved(&animation, 99.0, 0.0, 10);
        assert_eq!(frames(&lanes, YAW), [7.0, 9.0, 10.0]);
        // An unselected key is replaced, and returns when the drag goes on.
        let (lanes, _) = selected.moved(&animation, 4.0, 0.0, 10);
        assert_eq!(frames(&lanes, GLARE), [8.0]);
        assert_eq!(lanes[1].1.keys()[0].value, 0.5);
        let (lanes, _) = selected.moved(&animation, 5.0, 0.0, 10);
        assert_eq!(frames(&lanes, GLARE), [8.0, 9.0]);
        // Keys beyond the clip do not move into it on their own.
        let beyond = selection(&[(YAW, 9.0)]);
        assert_eq!(beyond.moved(&animation, 3.0, 0.0, 5).1, beyond);
    }

    #[test]
    fn values_are_raised_within_the_range_of_their_setting() {
        let animation = animation(&[(GLARE, "0:0.5,8:0.75")]);
        let selected = KeySelection::lane(GLARE, &animation);
        let (lanes, _) = selected.moved(&animation, 0.0, 0.3, 10);
        let values: Vec<f64> = lanes[0].1.keys().iter().map(|key| key.value).collect();
        assert_eq!(values, [0.8, 1.0]);
    }

    #[test]
    fn selected_keys_are_removed_and_shaped() {
        let animation = animation(&[(YAW, "2:0,5:30,9:60"), (GLARE, "4:0.5")]);
        let selected = selection(&[(YAW, 5.0), (GLARE, 4.0)]);
        let lanes = selected.removed(&animation);
        assert_eq!((frames(&lanes, YAW), frames(&lanes, GLARE)), (vec![2.0, 9.0], vec![]));
        assert_eq!(selected.kind(&animation), Some(Interpolation::Smooth));
        let lanes = selected.interpolated(&animation, Interpolation::Hold);
        assert_eq!(lanes[0].1.kind(1), Interpolation::Hold);
        assert_eq!(lanes[0].1.kind(0), Interpolation::Smooth);
        let mut held = animation.clone();
        held.set(YAW, lanes[0].1.clone());
        assert_eq!(selected.kind(&held), None, "the interpolations differ");
        let mut own = keys("2:0,5:30");
        own.set_slopes(1, [Some(3.0), None]).unwrap();
        held.set(YAW, own);
        assert!(selected.has_own_tangents(&held));
        let lanes = selected.with_automatic_tangents(&held);
        assert_eq!(lanes[0].1, keys("2:0,5:30"));
        assert!(!selection(&[(YAW, 2.0)]).has_own_tangents(&held));
    }

    #[test]
    fn a_selection_forgets_what_is_gone() {
        let mut selected = selection(&[(YAW, 2.0), (YAW, 3.0), (PITCH, 2.0)]);
        selected.keep(&animation(&[(YAW, "2:0,9:1")]));
        assert_eq!(selected, KeySelection::one(YAW, 2.0));
        selected.toggle(YAW, 9.0);
        selected.toggle(YAW, 2.0);
        assert_eq!(selected, KeySelection::one(YAW, 9.0));
        assert!(selected.within(PITCH).is_empty());
    }

    #[test]
    fn keys_are_pasted_at_the_frame_in_their_lanes_or_in_one_of_the_same_unit() {
        let mut source = animation(&[(YAW, "2:0,5:30,9:60"), (GLARE, "4:0.5")]);
        let mut shaped = source.keys(YAW).unwrap().clone();
        shaped.set_kind(1, Interpolation::Hold);
        shaped.set_slopes(1, [Some(2.0), None]).unwrap();
        source.set(YAW, shaped);
        let lighting =
            Lighting { placed: vec![PlacedLight { id: 1, ..PlacedLight::default() }], ..Lighting::default() };
        let copied = selection(&[(YAW, 5.0), (YAW, 9.0)]).copied(&source);
        let paste = |text: &str, onto| pasted(text, 6, Onto::Lane(onto), (&source, &lighting));
        let (lanes, selected) = paste(&copied, None).unwrap();
        assert_eq!(frames(&lanes, YAW), [2.0, 5.0, 6.0, 9.0, 10.0]);
        assert!(selected.contains(YAW, 6.0) && selected.contains(YAW, 10.0));
        let azimuth = Setting::Light(1, LightSetting::Yaw);
        let (lanes, selected) = paste(&copied, Some(azimuth)).unwrap();
        assert_eq!((lanes.len(), frames(&lanes, azimuth)), (1, vec![6.0, 10.0]));
        assert_eq!(lanes[0].1.kind(0), Interpolation::Hold);
        assert_eq!(lanes[0].1.keys()[0].slope_in, Some(2.0));
        assert_eq!(selected.len(), 2);
        // Degrees are not strengths, and values stay within the range of the setting.
        let (lanes, _) = paste(&copied, Some(GLARE)).unwrap();
        assert_eq!(lanes[0].0, YAW);
        let pitch = Setting::Light(1, LightSetting::Pitch);
        let wide = selection(&[(YAW, 0.0)]).copied(&animation(&[(YAW, "0:700")]));
        assert_eq!(paste(&wide, Some(pitch)).unwrap().0[0].1.keys()[0].value, 90.0);
        // Keys of several lanes go to their own lanes.
        let both = selection(&[(YAW, 5.0), (GLARE, 4.0)]).copied(&source);
        let (lanes, _) = paste(&both, Some(azimuth)).unwrap();
        assert_eq!((frames(&lanes, GLARE), frames(&lanes, YAW)), (vec![4.0, 6.0], vec![2.0, 5.0, 7.0, 9.0]));
    }

    #[test]
    fn all_keys_of_a_light_go_onto_another_light() {
        let light = |id| PlacedLight { id, ..PlacedLight::default() };
        let lighting = Lighting { placed: vec![light(1), light(2), light(3)], ..Lighting::default() };
        let pair = |id| [LightSetting::Yaw, LightSetting::Intensity].map(|s| Setting::Light(id, s));
        let [yaw, intensity] = pair(1);
        let source = animation(&[(yaw, "2:0,5:30"), (intensity, "2:1"), (GLARE, "0:1")]);
        let both = selection(&[(yaw, 2.0), (yaw, 5.0), (intensity, 2.0)]).copied(&source);
        let pasted = |text: &str, onto| pasted(text, 6, onto, (&source, &lighting));
        let settings = |lanes: &Lanes| lanes.iter().map(|(of, _)| *of).collect::<Vec<_>>();
        for (onto, id) in [
            (Onto::Lane(Some(pair(2)[1])), 2),
            (Onto::Light(3), 3),
            (Onto::Lane(Some(yaw)), 1),
            (Onto::Lane(Some(GLARE)), 1),
            (Onto::Lane(None), 1),
        ] {
            let (lanes, selected) = pasted(&both, onto).unwrap();
            assert_eq!(settings(&lanes), pair(id), "{onto:?}");
            assert!(selected.contains(pair(id)[0], 9.0) && selected.len() == 3);
        }
        // A mix of picture and light settings goes to its own lanes, and cannot be pasted onto a light.
        let mixed = selection(&[(yaw, 2.0), (GLARE, 0.0)]).copied(&source);
        let (lanes, _) = pasted(&mixed, Onto::Lane(Some(pair(2)[1]))).unwrap();
        assert_eq!(settings(&lanes), [GLARE, yaw]);
        assert!(pasted(&mixed, Onto::Light(2)).unwrap_err().contains("one light"));
        assert!(pasted(&both, Onto::Light(9)).unwrap_err().contains("not in this look"));
        assert_eq!(KeySelection::all(&source).len(), 4);
    }

    #[test]
    fn what_is_no_copy_of_keys_is_refused() {
        let nothing = (&Animation::default(), &Lighting::default());
        for text in ["", "a text", "{\"tilt\": {}}", "[1, 2]"] {
            assert!(pasted(text, 0, Onto::Lane(None), nothing).unwrap_err().contains("no keys"));
        }
        let lost = "{\"lights.3.yaw\": {\"keys\": [{\"frame\": 0, \"value\": 1}]}}";
        let said = pasted(lost, 0, Onto::Lane(None), nothing).unwrap_err();
        assert!(said.contains("not in this look"), "{said}");
        assert!(pasted("{}", 0, Onto::Lane(None), nothing).is_err());
        let far = format!("{{\"yaw\": {{\"keys\": [{{\"frame\": {}, \"value\": 1}}]}}}}", 1e9);
        assert!(pasted(&far, 5, Onto::Lane(None), nothing).is_err());
    }
}
