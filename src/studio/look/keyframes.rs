//! Settings with keyframes: their value follows the keys, and changing the value sets a key at the current frame.

use super::LookSettings;
use crate::keyframed::Keyframed;
use light::keyframes::{Interpolation, Keyframes};

impl LookSettings {
    /// The keys of a setting.
    pub fn keys(&self, of: Keyframed) -> &Keyframes {
        match of {
            Keyframed::Yaw => &self.yaw_keys,
            Keyframed::Intensity => &self.intensity_keys,
        }
    }

    fn keys_mut(&mut self, of: Keyframed) -> &mut Keyframes {
        match of {
            Keyframed::Yaw => &mut self.yaw_keys,
            Keyframed::Intensity => &mut self.intensity_keys,
        }
    }

    /// Whether a setting has any keys.
    pub fn is_keyed(&self, of: Keyframed) -> bool {
        !self.keys(of).keys().is_empty()
    }

    /// The index of the key at a frame.
    pub fn key_at(&self, of: Keyframed, frame: usize) -> Option<usize> {
        let keys = self.keys(of).keys();
        keys.iter().position(|key| key.frame == frame as f64)
    }

    fn value(&self, of: Keyframed) -> f32 {
        match of {
            Keyframed::Yaw => self.yaw_deg,
            Keyframed::Intensity => self.lighting.intensity_stops,
        }
    }

    fn value_mut(&mut self, of: Keyframed) -> &mut f32 {
        match of {
            Keyframed::Yaw => &mut self.yaw_deg,
            Keyframed::Intensity => &mut self.lighting.intensity_stops,
        }
    }

    /// Sets each setting that has keys to its value at a frame.
    pub(crate) fn follow(&mut self, frame: usize) {
        for of in Keyframed::ALL {
            if let Some(value) = self.keys(of).at(frame as f64) {
                *self.value_mut(of) = value as f32;
            }
        }
    }

    /// Sets a key at a frame for each setting that has keys and is another than `before`.
    pub(crate) fn set_keys(&mut self, before: &Self, frame: usize) {
        for of in Keyframed::ALL {
            let value = self.value(of);
            if self.is_keyed(of) && value != before.value(of) && self.keys(of) == before.keys(of) {
                // NaN is refused: the keys stay.
                let _ = self.keys_mut(of).insert(frame as f64, f64::from(value));
            }
        }
    }

    /// Sets a key at a frame, or removes the one that is there.
    pub(crate) fn toggle_key(&mut self, of: Keyframed, frame: usize) {
        match self.key_at(of, frame) {
            Some(index) => self.remove_key(of, index),
            None => {
                let value = f64::from(self.value(of));
                // NaN is refused: the keys stay.
                let _ = self.keys_mut(of).insert(frame as f64, value);
            }
        }
    }

    /// Removes a key, if there is one of this index.
    pub(crate) fn remove_key(&mut self, of: Keyframed, index: usize) {
        self.keys_mut(of).remove(index);
    }

    /// Moves a key to a frame, if there is one of this index.
    pub(crate) fn move_key(&mut self, of: Keyframed, index: usize, frame: usize) {
        if let Some(key) = self.keys(of).keys().get(index).copied() {
            // The key exists and its value is finite: nothing can fail.
            let _ = self.keys_mut(of).shift(index, frame as f64, key.value);
        }
    }

    /// How values go from key to key.
    pub(crate) fn interpolate(&mut self, of: Keyframed, interpolation: Interpolation) {
        self.keys_mut(of).interpolation = interpolation;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{LookCommand, ViewCommand};
    use crate::state::State;
    use light::Lighting;

    fn at(state: &mut State, frame: usize, command: LookCommand) {
        state.show(ViewCommand::Frame(frame));
        state.release();
        state.change(command);
        state.release();
    }

    fn frames(state: &State, of: Keyframed) -> Vec<f64> {
        state.look.keys(of).keys().iter().map(|k| k.frame).collect()
    }

    #[test]
    fn a_change_of_what_has_keys_sets_a_key_at_the_shown_frame() {
        let mut s = State::new(11, 24.0);
        s.change(LookCommand::Yaw(10.0));
        s.show(ViewCommand::Frame(4));
        assert!(!s.look.is_keyed(Keyframed::Yaw), "a value alone is no key");
        s.change(LookCommand::ToggleKey(Keyframed::Yaw));
        // Beyond half a turn: the light keeps turning the same way.
        at(&mut s, 8, LookCommand::Yaw(400.0));
        at(&mut s, 6, LookCommand::Turn(5.0));
        assert_eq!(frames(&s, Keyframed::Yaw), [4.0, 6.0, 8.0]);
        let yaws: Vec<f32> = [0, 4, 6, 8, 10]
            .map(|frame| {
                s.show(ViewCommand::Frame(frame));
                s.scene().yaw_deg
            })
            .into();
        assert_eq!(yaws, [10.0, 10.0, 210.0, 400.0, 400.0]);
        for expected in [vec![4.0, 8.0], vec![4.0], vec![]] {
            s.change(LookCommand::Undo);
            assert_eq!(frames(&s, Keyframed::Yaw), expected);
        }
        assert_eq!(s.look.yaw_deg, 10.0);
    }

    #[test]
    fn going_through_the_frames_is_no_change() {
        let mut s = State::new(11, 24.0);
        s.change(LookCommand::ToggleKey(Keyframed::Yaw));
        at(&mut s, 10, LookCommand::Yaw(90.0));
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
            LookCommand::Lighting(Box::new(Lighting {
                intensity_stops: stops,
                ..s.look.lighting.clone()
            }))
        };
        s.change(LookCommand::ToggleKey(Keyframed::Intensity));
        let brighter = intensity(&s, 2.0);
        at(&mut s, 10, brighter);
        s.change(LookCommand::Interpolate(
            Keyframed::Intensity,
            Interpolation::Linear,
        ));
        s.show(ViewCommand::Frame(5));
        assert_eq!(s.scene().lighting.intensity_stops, 1.0);
        let warmer = Lighting {
            temperature_k: 4000.0,
            ..s.look.lighting.clone()
        };
        s.change(LookCommand::Lighting(Box::new(warmer)));
        assert_eq!(frames(&s, Keyframed::Intensity), [0.0, 10.0]);
        let broken = intensity(&s, f32::NAN);
        s.change(broken);
        assert_eq!(s.look.lighting.intensity_stops, 1.0);
        assert_eq!(frames(&s, Keyframed::Intensity), [0.0, 10.0]);
    }

    #[test]
    fn keys_are_moved_and_removed_and_a_key_gives_way_to_the_one_that_is_moved_there() {
        let mut s = State::new(11, 24.0);
        for frame in [2, 5, 9] {
            at(&mut s, frame, LookCommand::ToggleKey(Keyframed::Yaw));
        }
        let of = Keyframed::Yaw;
        s.change(LookCommand::MoveKey {
            of,
            index: 0,
            frame: 7,
        });
        assert_eq!(frames(&s, of), [5.0, 7.0, 9.0]);
        s.release();
        s.change(LookCommand::MoveKey {
            of,
            index: 2,
            frame: 5,
        });
        assert_eq!(frames(&s, of), [5.0, 7.0]);
        s.change(LookCommand::RemoveKey { of, index: 0 });
        s.change(LookCommand::RemoveKey { of, index: 9 });
        assert_eq!(frames(&s, of), [7.0]);
        at(&mut s, 7, LookCommand::ToggleKey(of));
        assert!(!s.look.is_keyed(of));
    }
}
