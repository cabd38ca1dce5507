//! The environment list: its entries, their origin, and their front direction.

use light::built_in;
use light::conventions::Front;
use project::{NamedEnvironment, Project};
use std::path::Path;
use worker::Origin;

/// An entry of the list.
#[derive(Clone, Debug, PartialEq)]
pub struct ListedEnvironment {
    pub name: String,
    pub origin: Origin,
    /// Front direction in the file; None until set by hand.
    pub front: Option<Front>,
    pub owner: Owner,
}

/// Origin of an environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    Shoot,
    Program,
    /// Added by hand and saved in the project.
    Person,
    /// Found in a watched folder; in the list only once it is used.
    Folder,
}

impl Owner {
    /// Name of the origin in the window.
    pub fn says(self) -> &'static str {
        match self {
            Self::Shoot => "from the shoot",
            Self::Program => "built in",
            Self::Person => "added",
            Self::Folder => "in a watched folder",
        }
    }
}

impl ListedEnvironment {
    /// True if the front direction of an added file still has to be set.
    pub fn asks(&self) -> bool {
        self.owner == Owner::Person && self.front.is_none()
    }

    /// Front direction: set by hand, or Afterlight's convention.
    pub fn front(&self) -> Front {
        self.front.unwrap_or_default()
    }

    /// The file; None for a built-in environment.
    pub fn file(&self) -> Option<&Path> {
        match &self.origin {
            Origin::File(file) => Some(file),
            Origin::BuiltIn(_) => None,
        }
    }
}

/// The entry of this name, or otherwise the first that differs from it by case alone.
pub fn named(list: &[ListedEnvironment], name: &str) -> Option<usize> {
    let exact = list.iter().position(|listed| listed.name == name);
    let wanted = name.to_lowercase();
    exact.or_else(|| list.iter().position(|listed| listed.name.to_lowercase() == wanted))
}

/// The list of a newly opened project: from the shoot, built in without namesakes of the shoot's, and added.
pub fn of_project(project: &Project) -> Vec<ListedEnvironment> {
    let (added, shoots): (Vec<_>, Vec<_>) = project.environments().into_iter().partition(|e| e.added);
    let of_file = |owner| {
        move |known: project::KnownEnvironment| ListedEnvironment {
            name: known.name,
            origin: Origin::File(known.file),
            front: known.front,
            owner,
        }
    };
    let shoots: Vec<_> = shoots.into_iter().map(of_file(Owner::Shoot)).collect();
    let built_in = built_in::all().into_iter().map(|own| ListedEnvironment {
        name: own.title.to_owned(),
        origin: Origin::BuiltIn(own),
        front: None,
        owner: Owner::Program,
    });
    let built_in: Vec<_> = built_in.filter(|own| named(&shoots, &own.name).is_none()).collect();
    let added = added.into_iter().map(of_file(Owner::Person));
    shoots.into_iter().chain(built_in).chain(added).collect()
}

/// The part of a list that is saved in the project.
pub fn saved(list: &[ListedEnvironment]) -> Vec<NamedEnvironment> {
    let files = list.iter().filter_map(|listed| {
        Some(NamedEnvironment { name: listed.name.clone(), file: listed.file()?.to_path_buf(), front: listed.front })
    });
    files.collect()
}

/// A saved list in a project with the list `now`: entries of the project with the saved front directions, then the
/// saved added files.
pub fn restored(now: &[ListedEnvironment], saved: &[NamedEnvironment]) -> Vec<ListedEnvironment> {
    let known = |file: &Path| saved.iter().find(|one| one.file == file);
    let brought = now.iter().filter(|one| one.owner != Owner::Person);
    let brought: Vec<ListedEnvironment> = brought
        .map(|one| ListedEnvironment {
            front: (one.file().and_then(known)).map_or(one.front, |saved| saved.front),
            ..one.clone()
        })
        .collect();
    let is_brought = |file: &Path| brought.iter().any(|one| one.file() == Some(file));
    let added = saved.iter().filter(|saved| !is_brought(&saved.file));
    let added = added.map(|saved| ListedEnvironment {
        name: saved.name.clone(),
        origin: Origin::File(saved.file.clone()),
        front: saved.front,
        owner: Owner::Person,
    });
    let added: Vec<ListedEnvironment> = added.collect();
    brought.into_iter().chain(added).collect()
}
