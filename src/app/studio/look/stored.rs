//! Applying a stored look.

use super::LookSettings;
use crate::stored_look::StoredLook;
use std::slice::from_ref;

impl LookSettings {
    /// Applies a stored look with its own environment, if that is in the list or can be added, or else with one of the
    /// same name. If neither exists, the environment stays.
    /// `exists`: the file of its environment exists.
    pub(crate) fn show_stored(&mut self, stored: &StoredLook, exists: bool) {
        let environment = &stored.environment;
        let mut place = environment.place_in(&self.environments);
        if let (None, true, Some(file)) = (place, exists, &environment.file) {
            self.add(from_ref(file));
            self.set_front(self.environment, environment.front);
            place = Some(self.environment);
        }
        let place = place.or_else(|| environment.namesake_in(&self.environments));
        stored.apply(self, place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{LookCommand, ViewCommand};
    use crate::state::State;
    use light::conventions::Front;
    use scene::Setting;
    use std::path::PathBuf;
    use std::sync::Arc;

    fn applied(look: &LookSettings, exists: bool) -> LookCommand {
        LookCommand::Apply { look: Arc::new(StoredLook::from_look(look)), exists }
    }

    #[test]
    fn a_stored_look_is_shown_in_one_step_of_undo() {
        let mut s = State::new(10, 24.0);
        s.change(LookCommand::AddEnvironments(["/a.exr", "/b.exr"].map(PathBuf::from).into()));
        s.release();
        s.change(LookCommand::Set(Setting::Yaw, 33.0));
        s.release();
        s.change(LookCommand::Set(Setting::Exposure, 1.0));
        s.release();
        let stored = s.look.clone();
        for command in [
            LookCommand::Environment(1),
            LookCommand::Set(Setting::Yaw, -5.0),
            LookCommand::Set(Setting::Exposure, 0.0),
        ] {
            s.change(command);
            s.release();
        }
        s.show(ViewCommand::Solo(Some(2)));
        let other = s.look.clone();
        s.change(applied(&stored, false));
        assert_eq!(s.look, stored);
        assert!(s.solo.is_empty(), "a solo lamp would hide it");
        s.change(LookCommand::Undo);
        assert_eq!(s.look, other);
    }

    #[test]
    fn at_any_frame_no_key_is_set_by_showing_a_look() {
        let mut s = State::new(10, 24.0);
        s.change(LookCommand::ToggleKey(Setting::Yaw));
        s.show(ViewCommand::LastFrame);
        s.change(LookCommand::Set(Setting::Yaw, 90.0));
        s.release();
        let stored = s.look.clone();
        s.change(LookCommand::Set(Setting::Exposure, 2.0));
        s.release();
        s.show(ViewCommand::Frame(4));
        s.change(applied(&stored, false));
        assert_eq!(s.look.keys(Setting::Yaw), stored.keys(Setting::Yaw));
        assert_eq!(s.look.exposure_stops, 0.0);
        s.show(ViewCommand::LastFrame);
        assert_eq!(s.look, stored);
    }

    #[test]
    fn an_environment_that_another_project_lacks_is_added_with_its_front_or_left() {
        let mut one = State::new(1, 24.0);
        one.change(LookCommand::AddEnvironments(vec!["/hdri/yard.exr".into()]));
        one.change(LookCommand::Front(0, Some(Front::new(40.0))));
        one.change(LookCommand::Set(Setting::Exposure, 1.0));
        let mut other = State::new(1, 24.0);
        other.change(LookCommand::AddEnvironments(vec!["/b/sky.exr".into()]));
        other.release();
        let mut without = other.clone();
        without.change(applied(&one.look, false));
        assert_eq!((without.look.environment, without.look.exposure_stops), (0, 1.0));
        assert_eq!(without.look.environments.len(), 1);
        other.change(applied(&one.look, true));
        let shown = &other.look.environments[other.look.environment];
        assert_eq!(shown.name, "yard");
        assert_eq!(other.look.front(), Front::new(40.0));
        other.change(LookCommand::Undo);
        assert_eq!(other.look.environments.len(), 1);
    }
}
