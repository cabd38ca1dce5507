//! Settings with keyframes: their value follows the keys, and changing the value sets a key at the current frame.

use super::{LookSettings, within_a_turn};
use light::keyframes::Keyframes;
use scene::{LightSetting, Look, Setting};

impl LookSettings {
    /// Index of the key at a frame.
    pub fn key_at(&self, of: Setting, frame: usize) -> Option<usize> {
        self.keys(of).index_at(frame as f64)
    }

    /// Removes the keys of lights that are gone, and gives each light an id for its keys.
    pub(crate) fn number_lights(&mut self) {
        let Look { lighting, animation, .. } = &mut self.shown;
        animation.retain(|setting| setting.exists(lighting));
        lighting.number_lights();
    }

    /// Sets a key at a frame for each animated setting whose value differs from `before`.
    pub(crate) fn set_keys(&mut self, before: &Self, frame: usize) {
        let keyed: Vec<Setting> = self.animation.lanes().map(|(setting, _)| setting).collect();
        for of in keyed {
            let (value, was) = (self.value(of), before.value(of));
            if let (Some(value), Some(was)) = (value, was)
                && value != was
                && self.keys(of) == before.keys(of)
            {
                self.set_key(of, frame, nearest_turn(of, f64::from(value), f64::from(was)));
            }
        }
    }

    /// Sets a key, within the setting's range.
    fn set_key(&mut self, of: Setting, frame: usize, value: f64) {
        let mut keys = self.keys(of).clone();
        // NaN is refused: the keys stay.
        if keys.insert(frame as f64, of.bounded(value)).is_ok() {
            self.animation.set(of, keys);
        }
    }

    /// Wraps angles without keys to one turn: only keys can make several turns.
    pub(crate) fn unwind(&mut self) {
        let mut all = Setting::all(&self.lighting);
        all.retain(|of| of.turns() && !self.is_keyed(*of));
        for of in all {
            let field = of.field(&mut self.shown);
            if let Some(degrees) = field.filter(|degrees| degrees.is_finite()) {
                *degrees = within_a_turn(*degrees);
            }
        }
    }

    /// Sets a key at a frame, or removes the existing one.
    pub(crate) fn toggle_key(&mut self, of: Setting, frame: usize) {
        match self.key_at(of, frame) {
            Some(index) => {
                let mut keys = self.keys(of).clone();
                keys.remove(index);
                self.animation.set(of, keys);
                self.unwind();
            }
            None => {
                if let Some(value) = self.value(of) {
                    self.set_key(of, frame, f64::from(value));
                }
            }
        }
    }

    /// Replaces the keys of these settings, if the settings exist.
    pub(crate) fn set_lanes(&mut self, lanes: Vec<(Setting, Keyframes)>) {
        for (of, keys) in lanes {
            if of.exists(&self.lighting) {
                self.animation.set(of, keys);
            }
        }
        self.unwind();
    }
}

/// Nearest equivalent angle: a placed light dragged across the seam of the panorama keeps turning the same way.
fn nearest_turn(of: Setting, value: f64, was: f64) -> f64 {
    match of {
        Setting::Light(_, LightSetting::Yaw) => value - 360.0 * ((value - was) / 360.0).round(),
        _ => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{AimedLight, LookCommand, ViewCommand};
    use crate::state::State;
    use glam::Vec3;
    use light::keyframes::Interpolation;
    use light::{Lighting, PlacedLight};
    use scene::{Effects, Pass};

    fn at(state: &mut State, frame: usize, command: LookCommand) {
        state.show(ViewCommand::Frame(frame));
        state.release();
        state.change(command);
        state.release();
    }

    fn frames(state: &State, of: Setting) -> Vec<f64> {
        state.look.keys(of).keys().iter().map(|k| k.frame).collect()
    }

    #[test]
    fn a_change_of_what_has_keys_sets_a_key_at_the_shown_frame() {
        let mut s = State::new(11, 24.0);
        s.change(LookCommand::Set(Setting::Yaw, 10.0));
        s.show(ViewCommand::Frame(4));
        assert!(!s.look.is_keyed(Setting::Yaw), "a value without a key");
        s.change(LookCommand::ToggleKey(Setting::Yaw));
        // Beyond half a turn, the light keeps turning the same way.
        at(&mut s, 8, LookCommand::Set(Setting::Yaw, 400.0));
        at(&mut s, 6, LookCommand::Turn(5.0));
        assert_eq!(frames(&s, Setting::Yaw), [4.0, 6.0, 8.0]);
        let yaws: Vec<f32> = [0, 4, 6, 8, 10]
            .map(|frame| {
                s.show(ViewCommand::Frame(frame));
                s.scene().yaw_deg
            })
            .into();
        assert_eq!(yaws, [10.0, 10.0, 210.0, 400.0, 400.0]);
        for expected in [vec![4.0, 8.0], vec![4.0], vec![]] {
            s.change(LookCommand::Undo);
            assert_eq!(frames(&s, Setting::Yaw), expected);
        }
        assert_eq!(s.look.yaw_deg, 10.0);
    }

    #[test]
    fn going_through_the_frames_is_no_change() {
        let mut s = State::new(11, 24.0);
        s.change(LookCommand::ToggleKey(Setting::Yaw));
        at(&mut s, 10, LookCommand::Set(Setting::Yaw, 90.0));
        s.show(ViewCommand::Frame(0));
        let look = s.look.clone();
        (0..11).for_each(|_| s.advance());
        s.show(ViewCommand::LastFrame);
        s.show(ViewCommand::StepFrame(-10));
        assert_eq!(s.look, look);
        (0..2).for_each(|_| s.change(LookCommand::Undo));
        assert!(!s.can_undo());
    }

    #[test]
    fn intensity_has_keys_of_its_own_and_other_settings_of_the_light_set_none() {
        let mut s = State::new(11, 24.0);
        let intensity = |s: &State, stops: f32| {
            LookCommand::Lighting(Box::new(Lighting { intensity_stops: stops, ..s.look.lighting.clone() }))
        };
        s.change(LookCommand::ToggleKey(Setting::Intensity));
        let brighter = intensity(&s, 2.0);
        at(&mut s, 10, brighter);
        let mut linear = s.look.keys(Setting::Intensity).clone();
        linear.interpolation = Interpolation::Linear;
        s.change(LookCommand::Keys(vec![(Setting::Intensity, linear)]));
        s.show(ViewCommand::Frame(5));
        assert_eq!(s.scene().lighting.intensity_stops, 1.0);
        let warmer = Lighting { temperature_k: 4000.0, ..s.look.lighting.clone() };
        s.change(LookCommand::Lighting(Box::new(warmer)));
        assert_eq!(frames(&s, Setting::Intensity), [0.0, 10.0]);
        let broken = intensity(&s, f32::NAN);
        s.change(broken);
        assert_eq!(s.look.lighting.intensity_stops, 1.0);
        assert_eq!(frames(&s, Setting::Intensity), [0.0, 10.0]);
    }

    /// The look's lights after a change.
    fn lights(s: &State, change: impl FnOnce(&mut Vec<PlacedLight>)) -> LookCommand {
        let mut lighting = s.look.lighting.clone();
        change(&mut lighting.placed);
        LookCommand::Lighting(Box::new(lighting))
    }

    #[test]
    fn every_setting_is_animated_and_goes_through_its_keys() {
        let mut s = State::new(11, 24.0);
        let added = lights(&s, |lights| lights.push(PlacedLight::default()));
        at(&mut s, 0, added);
        let settings = [
            Setting::Pitch,
            Setting::Roll,
            Setting::BackgroundYaw,
            Setting::Temperature,
            Setting::Tint,
            Setting::Exposure,
            Setting::Effect(Pass::Vignette),
            Setting::Light(1, LightSetting::Radius),
            Setting::Light(1, LightSetting::Blue),
        ];
        for of in settings {
            at(&mut s, 0, LookCommand::ToggleKey(of));
        }
        s.show(ViewCommand::LastFrame);
        let mut lighting = s.look.lighting.clone();
        (lighting.pitch_deg, lighting.roll_deg) = (20.0, -40.0);
        lighting.background_yaw_deg = 8.0;
        (lighting.temperature_k, lighting.tint) = (4504.0, 10.0);
        lighting.placed[0].radius_deg = 32.5;
        lighting.placed[0].color[2] = 0.0;
        at(&mut s, 10, LookCommand::Lighting(Box::new(lighting)));
        at(&mut s, 10, LookCommand::Set(Setting::Exposure, -2.0));
        let dark = Effects { vignette: 0.5, ..Effects::default() };
        at(&mut s, 10, LookCommand::Effects(dark));
        s.show(ViewCommand::Frame(5));
        let scene = s.scene();
        let light = &scene.lighting.placed[0];
        assert_eq!(
            [
                scene.lighting.pitch_deg,
                scene.lighting.roll_deg,
                scene.lighting.background_yaw_deg,
                scene.lighting.temperature_k,
                scene.lighting.tint,
                scene.exposure_stops,
                scene.effects.vignette,
                light.radius_deg,
                light.color[2],
            ],
            [10.0, -20.0, 4.0, 5504.0, 5.0, -1.0, 0.25, 22.5, 0.5]
        );
        assert_eq!((light.yaw_deg, light.color[0]), (-135.0, 1.0));
        assert_eq!(frames(&s, Setting::Exposure), [0.0, 10.0]);
    }

    #[test]
    fn keys_stay_with_their_light_and_go_with_it() {
        let mut s = State::new(11, 24.0);
        let added = lights(&s, |lights| lights.resize(3, PlacedLight::default()));
        at(&mut s, 0, added);
        let ids = |s: &State| -> Vec<u32> {
            let lights = s.look.lighting.placed.iter();
            lights.map(|light| light.id).collect()
        };
        assert_eq!(ids(&s), [1, 2, 3]);
        let setting = Setting::Light(2, LightSetting::Intensity);
        at(&mut s, 0, LookCommand::ToggleKey(setting));
        let brighter = lights(&s, |lights| lights[1].intensity = 6.0);
        at(&mut s, 10, brighter);
        let first = lights(&s, |lights| lights.swap(0, 1));
        at(&mut s, 10, first);
        let removed = lights(&s, |lights| drop(lights.remove(1)));
        at(&mut s, 10, removed);
        assert_eq!((ids(&s), frames(&s, setting)), (vec![2, 3], vec![0.0, 10.0]));
        s.show(ViewCommand::Frame(0));
        assert_eq!(s.look.lighting.placed[0].intensity, std::f32::consts::PI);
        s.show(ViewCommand::Frame(10));
        assert_eq!(s.look.lighting.placed[0].intensity, 6.0);
        // A new light in its place has its own id, and no keys.
        let replaced = lights(&s, |lights| lights[0] = PlacedLight::default());
        at(&mut s, 10, replaced);
        assert_eq!((ids(&s), s.look.is_keyed(setting)), (vec![1, 3], false));
        s.change(LookCommand::Undo);
        assert_eq!((ids(&s), frames(&s, setting)), (vec![2, 3], vec![0.0, 10.0]));
        let lost = LookCommand::Keys(vec![(Setting::Light(9, LightSetting::Yaw), "0:1".parse().unwrap())]);
        at(&mut s, 10, lost);
        at(&mut s, 10, LookCommand::ToggleKey(Setting::Light(9, LightSetting::Yaw)));
        assert_eq!(s.look.animation.lanes().count(), 1);
    }

    #[test]
    fn an_angle_without_keys_stays_within_a_turn() {
        let mut s = State::new(11, 24.0);
        let added = lights(&s, |lights| lights.push(PlacedLight::default()));
        at(&mut s, 0, added);
        let azimuth = Setting::Light(1, LightSetting::Yaw);
        for of in [Setting::Yaw, Setting::Pitch, azimuth] {
            let far = "0:442".parse().unwrap();
            at(&mut s, 0, LookCommand::Keys(vec![(of, far)]));
            assert_eq!(s.look.value(of), Some(442.0));
        }
        at(&mut s, 0, LookCommand::ToggleKey(Setting::Yaw));
        let none = vec![(Setting::Pitch, Keyframes::NONE), (azimuth, Keyframes::NONE)];
        at(&mut s, 0, LookCommand::Keys(none));
        for of in [Setting::Yaw, Setting::Pitch, azimuth] {
            assert_eq!(s.look.value(of), Some(82.0), "{of:?}");
        }
        let typed = lights(&s, |lights| lights[0].yaw_deg = 190.0);
        at(&mut s, 0, typed);
        assert_eq!(s.look.value(azimuth), Some(-170.0));
    }

    #[test]
    fn a_light_that_is_dragged_over_the_seam_goes_on_turning() {
        let mut s = State::new(11, 24.0);
        let added = lights(&s, |lights| {
            lights.push(PlacedLight { yaw_deg: 170.0, ..PlacedLight::default() });
        });
        at(&mut s, 0, added);
        let setting = Setting::Light(1, LightSetting::Yaw);
        at(&mut s, 0, LookCommand::ToggleKey(setting));
        // The panorama wraps azimuths.
        let over = lights(&s, |lights| lights[0].yaw_deg = -170.0);
        at(&mut s, 10, over);
        assert_eq!(s.look.lighting.placed[0].yaw_deg, 190.0);
        s.show(ViewCommand::Frame(5));
        assert_eq!(s.look.lighting.placed[0].yaw_deg, 180.0);
    }

    #[test]
    fn a_light_that_is_aimed_by_the_face_gets_keys_if_it_is_animated() {
        let mut s = State::new(11, 24.0);
        let aimed = |frame, direction| LookCommand::Aim(AimedLight { drag: 1, frame, pixel: [2, 2], direction });
        s.begin_aim(None);
        s.change(aimed(0, Vec3::NEG_X));
        let setting = Setting::Light(1, LightSetting::Yaw);
        s.look.toggle_key(setting, 0);
        s.show(ViewCommand::Frame(10));
        // The drag and the clip go on: the key is set at the frame in which the light was seen.
        let seen = aimed(10, Vec3::Z);
        s.show(ViewCommand::Frame(5));
        s.change(seen);
        s.show(ViewCommand::Frame(10));
        let keys: Vec<f64> = s.look.keys(setting).keys().iter().map(|k| k.value).collect();
        assert_eq!(keys, [-90.0, -180.0], "the shorter way around");
        assert_eq!(s.look.lighting.placed[0].yaw_deg, -180.0);
    }

    #[test]
    fn keys_have_values_within_the_range_of_their_setting() {
        let mut s = State::new(11, 24.0);
        s.change(LookCommand::ToggleKey(Setting::Tint));
        let tint = |tint: f32| LookCommand::Lighting(Box::new(Lighting { tint, ..Lighting::default() }));
        at(&mut s, 4, tint(1e6));
        at(&mut s, 4, tint(f32::NAN));
        assert_eq!(s.look.keys(Setting::Tint).at(4.0), Some(150.0));
        assert_eq!(s.look.lighting.tint, 150.0);
    }

    #[test]
    fn keys_are_replaced_in_one_step_and_none_end_the_animation() {
        let mut s = State::new(11, 24.0);
        let setting = Setting::Yaw;
        at(&mut s, 2, LookCommand::ToggleKey(setting));
        at(&mut s, 2, LookCommand::Set(Setting::Exposure, 1.0));
        at(&mut s, 2, LookCommand::ToggleKey(Setting::Exposure));
        let moved = |frame: &str| {
            let keys: Keyframes = frame.parse().unwrap();
            LookCommand::Keys(vec![(setting, keys.clone()), (Setting::Exposure, keys)])
        };
        // A drag.
        s.change(moved("3:0"));
        s.change(moved("4:0"));
        s.release();
        assert_eq!((frames(&s, setting), frames(&s, Setting::Exposure)), (vec![4.0], vec![4.0]));
        s.change(LookCommand::Undo);
        assert_eq!((frames(&s, setting), frames(&s, Setting::Exposure)), (vec![2.0], vec![2.0]));
        at(&mut s, 2, LookCommand::Keys(vec![(setting, Keyframes::NONE)]));
        at(&mut s, 2, LookCommand::ToggleKey(Setting::Exposure));
        assert!(s.look.animation.is_empty());
    }
}
