//! The list of environments as a setting: what is in it, where it comes from, and which way is front.

use super::look::LookSettings;
use light::built_in;
use light::conventions::Front;
use project::{NamedEnvironment, Project, free_name};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use worker::Origin;

/// An environment of the list.
#[derive(Clone, Debug, PartialEq)]
pub struct ListedEnvironment {
    pub name: String,
    pub origin: Origin,
    /// Which way is front in its file; None until the person says so.
    pub front: Option<Front>,
    pub owner: Owner,
}

/// Where an environment comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    Shoot,
    Program,
    /// Added by a person, and saved in the project.
    Person,
}

impl Owner {
    /// Where it comes from, for the window.
    pub fn says(self) -> &'static str {
        match self {
            Self::Shoot => "from the shoot",
            Self::Program => "built in",
            Self::Person => "added",
        }
    }
}

impl ListedEnvironment {
    /// Whether another one in the list has the same name, ignoring case.
    pub fn is_ambiguous(&self, list: &[Self]) -> bool {
        let name = self.name.to_lowercase();
        let same = list.iter().filter(|one| one.name.to_lowercase() == name);
        same.count() > 1
    }

    /// Whether the person still has to say which way is front in an added file.
    pub fn asks(&self) -> bool {
        self.owner == Owner::Person && self.front.is_none()
    }

    /// Which way is front: as the person said, or else Afterlight's convention.
    pub fn front(&self) -> Front {
        self.front.unwrap_or_default()
    }

    fn file(&self) -> Option<&Path> {
        match &self.origin {
            Origin::File(file) => Some(file),
            Origin::BuiltIn(_) => None,
        }
    }
}

/// The list of a project that was just opened: the shoot's environments, the built-in ones, and the added ones.
pub fn of_project(project: &Project) -> Vec<ListedEnvironment> {
    let (added, shoots): (Vec<_>, Vec<_>) =
        project.environments().into_iter().partition(|e| e.added);
    let of_file = |owner| {
        move |known: project::KnownEnvironment| ListedEnvironment {
            name: known.name,
            origin: Origin::File(known.file),
            front: known.front,
            owner,
        }
    };
    let built_in = built_in::all().into_iter().map(|own| ListedEnvironment {
        name: own.title.to_owned(),
        origin: Origin::BuiltIn(own),
        front: None,
        owner: Owner::Program,
    });
    let shoots = shoots.into_iter().map(of_file(Owner::Shoot));
    let added = added.into_iter().map(of_file(Owner::Person));
    shoots.chain(built_in).chain(added).collect()
}

/// What of a list is saved in the project.
pub fn saved(list: &[ListedEnvironment]) -> Vec<NamedEnvironment> {
    let files = list.iter().filter_map(|listed| {
        Some(NamedEnvironment {
            name: listed.name.clone(),
            file: listed.file()?.to_path_buf(),
            front: listed.front,
        })
    });
    files.collect()
}

impl LookSettings {
    /// Adds panoramas at the end of the list, and shows the first of them. A file is listed once.
    pub(super) fn add(&mut self, files: &[PathBuf]) {
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

    /// Removes an added environment from the list. The one that is shown stays, unless it is this one.
    pub(super) fn remove(&mut self, place: usize) {
        let list = Arc::make_mut(&mut self.environments);
        if list
            .get(place)
            .is_some_and(|one| one.owner == Owner::Person)
        {
            list.remove(place);
            if self.environment > place || self.environment == list.len() {
                self.environment -= 1;
            }
        }
    }

    /// Sets which way is front in a file of the list.
    pub(super) fn set_front(&mut self, place: usize, front: Option<Front>) {
        let list = Arc::make_mut(&mut self.environments);
        if let Some(listed) = list
            .get_mut(place)
            .filter(|one| one.owner != Owner::Program)
        {
            listed.front = front;
        }
    }

    /// Which way is front in the environment that is shown.
    pub fn front(&self) -> Front {
        let shown = self.environments.get(self.environment);
        shown.map_or(Front::default(), ListedEnvironment::front)
    }
}

#[cfg(test)]
mod tests {
    use super::super::command::LookCommand;
    use super::super::state::State;
    use super::*;
    use light::conventions::Tool;

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
        apply(&mut s, LookCommand::Yaw(25.0));
        for tool in Tool::ALL {
            let front = Front::of(tool);
            let mut turned = s.clone();
            apply(&mut turned, LookCommand::Yaw(25.0 + front.yaw_deg()));
            apply(&mut s, LookCommand::Front(0, Some(front)));
            let off = s.scene().yaw_deg - turned.scene().yaw_deg;
            assert!(off.rem_euclid(360.0) < 1e-3, "{tool:?}: {off}");
            assert_eq!(s.look.yaw_deg, 25.0);
            apply(&mut s, LookCommand::Front(0, None));
        }
        // It belongs to the file: other environments stay as they are.
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
