//! The list of environments as a setting.

use super::LookSettings;
use crate::environment_list::{ListedEnvironment, Owner};
use light::conventions::Front;
use project::free_name;
use std::path::PathBuf;
use std::sync::Arc;
use worker::Origin;

impl LookSettings {
    /// Appends panoramas to the list, and lights with the first of them. A file is listed once.
    pub(crate) fn add(&mut self, files: &[PathBuf]) {
        let list = Arc::make_mut(&mut self.environments);
        let mut first = None;
        for file in files {
            let file = std::path::absolute(file).unwrap_or_else(|_| file.clone());
            let same = |listed: &ListedEnvironment| listed.file() == Some(&file);
            let place = list.iter().position(same).unwrap_or_else(|| {
                let names = list.iter().map(|listed| listed.name.as_str());
                list.push(ListedEnvironment {
                    name: free_name(&file, names),
                    origin: Origin::File(file),
                    front: None,
                    owner: Owner::Person,
                });
                list.len() - 1
            });
            first.get_or_insert(place);
        }
        self.environment = first.unwrap_or(self.environment);
    }

    /// Removes an added environment from the list. The current environment stays, unless it is this one.
    pub(crate) fn remove(&mut self, place: usize) {
        let list = Arc::make_mut(&mut self.environments);
        if list.get(place).is_some_and(|one| one.owner == Owner::Person) {
            list.remove(place);
            if self.environment > place || self.environment == list.len() {
                self.environment -= 1;
            }
        }
    }

    /// Sets the front direction in a listed file.
    pub(crate) fn set_front(&mut self, place: usize, front: Option<Front>) {
        let list = Arc::make_mut(&mut self.environments);
        if let Some(listed) = list.get_mut(place).filter(|one| one.owner != Owner::Program) {
            listed.front = front;
        }
    }

    /// Front direction of the current environment.
    pub fn front(&self) -> Front {
        let shown = self.environments.get(self.environment);
        shown.map_or(Front::default(), ListedEnvironment::front)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::LookCommand;
    use crate::state::State;
    use light::conventions::Tool;
    use scene::Setting;

    /// A window with two environments from the shoot.
    fn state() -> State {
        let mut state = State::new(1, 24.0);
        let shoots = ["sky", "night"].map(|name| ListedEnvironment {
            name: name.to_owned(),
            origin: Origin::File(PathBuf::from("/shoot").join(name)),
            front: None,
            owner: Owner::Shoot,
        });
        state.look.environments = Arc::new(shoots.into());
        state
    }

    fn apply(state: &mut State, command: LookCommand) {
        state.change(command);
        state.release();
    }

    fn names(state: &State) -> Vec<&str> {
        let list = state.look.environments.iter();
        list.map(|listed| listed.name.as_str()).collect()
    }

    #[test]
    fn the_picture_of_a_front_is_the_picture_of_the_yaw_that_it_stands_for() {
        let mut s = state();
        apply(&mut s, LookCommand::Set(Setting::Yaw, 25.0));
        for tool in Tool::ALL {
            let front = Front::from_tool(tool);
            let mut turned = s.clone();
            apply(&mut turned, LookCommand::Set(Setting::Yaw, 25.0 + front.yaw_deg()));
            apply(&mut s, LookCommand::Front(0, Some(front)));
            let off = s.scene().yaw_deg - turned.scene().yaw_deg;
            assert!(off.rem_euclid(360.0) < 1e-3, "{tool:?}: {off}");
            assert_eq!(s.look.yaw_deg, 25.0);
            apply(&mut s, LookCommand::Front(0, None));
        }
        // Front belongs to the file: other environments are unaffected.
        apply(&mut s, LookCommand::Front(0, Some(Front::new(90.0))));
        apply(&mut s, LookCommand::Environment(1));
        assert_eq!(s.scene().yaw_deg, 25.0);
    }

    #[test]
    fn what_is_added_comes_last_and_is_shown_once_and_undone() {
        let mut s = state();
        let files = ["/a/sky.hdr", "/b/yard.hdr", "/a/sky.hdr"].map(PathBuf::from);
        apply(&mut s, LookCommand::AddEnvironments(files.into()));
        assert_eq!(names(&s), ["sky", "night", "sky 2", "yard"]);
        assert_eq!(s.look.environment, 2);
        assert!(s.look.environments[2].asks() && !s.look.environments[0].asks());
        apply(&mut s, LookCommand::Undo);
        assert_eq!((names(&s), s.look.environment), (vec!["sky", "night"], 0));
    }

    #[test]
    fn only_what_was_added_is_removed_and_the_one_that_is_shown_stays() {
        let mut s = state();
        let files = ["/a", "/b", "/c"].map(PathBuf::from);
        apply(&mut s, LookCommand::AddEnvironments(files.into()));
        apply(&mut s, LookCommand::Environment(4));
        for (removed, left, shown) in [
            (0, vec!["sky", "night", "a", "b", "c"], "c"),
            (99, vec!["sky", "night", "a", "b", "c"], "c"),
            (2, vec!["sky", "night", "b", "c"], "c"),
            (3, vec!["sky", "night", "b"], "b"),
            (2, vec!["sky", "night"], "night"),
        ] {
            apply(&mut s, LookCommand::RemoveEnvironment(removed));
            assert_eq!(names(&s), left);
            assert_eq!(names(&s)[s.look.environment], shown);
        }
        for _ in 0..3 {
            apply(&mut s, LookCommand::Undo);
        }
        assert_eq!(names(&s)[s.look.environment], "c");
    }
}
