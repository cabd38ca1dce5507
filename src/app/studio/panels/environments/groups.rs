//! Order of the environment list: favourites, shoot, built-in, then added and watched files by folder, by name. Only
//! entries that match the search are listed.

use crate::environment_list::{ListedEnvironment, Owner};
use crate::panels::environments::library::EnvironmentEntry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Entries under one heading.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EnvironmentGroup {
    pub title: String,
    /// Folder of added and watched files.
    pub folder: Option<PathBuf>,
    /// Indices in the list.
    pub entries: Vec<usize>,
}

/// Groups in the order of display.
pub fn shown(entries: &[EnvironmentEntry], search: &str) -> Vec<EnvironmentGroup> {
    let all = entries.iter().map(|entry| (&entry.listed, entry.favourite, entry.order));
    grouped(&all.collect::<Vec<_>>(), search)
}

/// The entry `step` places after `from` in display order, wrapping around. None if the list is empty. A hidden entry
/// counts as before the first.
pub fn step(groups: &[EnvironmentGroup], from: usize, step: isize) -> Option<usize> {
    let order: Vec<usize> = groups.iter().flat_map(|group| group.entries.clone()).collect();
    let count = order.len() as isize;
    let place = order.iter().position(|&entry| entry == from);
    let place = place.map_or(if step > 0 { -1 } else { 0 }, |place| place as isize);
    let next = (count > 0).then(|| (place + step).rem_euclid(count));
    next.map(|next| order[next as usize])
}

fn grouped(list: &[(&ListedEnvironment, bool, usize)], search: &str) -> Vec<EnvironmentGroup> {
    let folders = folder_titles(list.iter().map(|(listed, ..)| *listed));
    let mut groups: BTreeMap<(usize, String), Vec<usize>> = BTreeMap::new();
    for (place, (listed, favourite, _)) in list.iter().enumerate() {
        let folder = listed.file().and_then(Path::parent);
        let title = folder.and_then(|folder| folders.get(folder));
        let own = match listed.owner {
            Owner::Shoot => (1, "Shoot".to_owned()),
            Owner::Program => (2, "Built in".to_owned()),
            Owner::Person | Owner::Folder => (3, title.cloned().unwrap_or_default()),
        };
        let is_own = is_found(&listed.name, &own.1, search);
        let key = match favourite {
            true => (0, "Favourites".to_owned()),
            false => own,
        };
        if is_own || is_found(&listed.name, &key.1, search) {
            groups.entry(key).or_default().push(place);
        }
    }
    let group = |((rank, title), mut entries): ((usize, String), Vec<usize>)| {
        // Use of a watched file moves it in the list, and leaves it where it is in the window.
        if [0, 3].contains(&rank) {
            entries.sort_by_key(|&place| list[place].2);
        }
        let first = (rank == 3).then(|| list[entries[0]].0.file()?.parent());
        EnvironmentGroup { title, folder: first.flatten().map(Path::to_path_buf), entries }
    };
    groups.into_iter().map(group).collect()
}

/// True if a name together with its heading contains each word of the search.
fn is_found(name: &str, heading: &str, search: &str) -> bool {
    if search.trim().is_empty() {
        return true;
    }
    let text = format!("{name}\n{heading}").to_lowercase();
    let search = search.to_lowercase();
    search.split_whitespace().all(|word| text.contains(word))
}

/// Titles of the folders of added and watched files. A title is the folder's name, extended by its parents until it is unique.
fn folder_titles<'a>(list: impl Iterator<Item = &'a ListedEnvironment>) -> BTreeMap<&'a Path, String> {
    let files = list.filter(|listed| matches!(listed.owner, Owner::Person | Owner::Folder));
    let folders = files.filter_map(|listed| listed.file()?.parent());
    let folders: BTreeSet<&Path> = folders.collect();
    let ending = |folder: &Path, parts: usize| {
        let all: Vec<_> = folder.components().collect();
        let end: PathBuf = all[all.len().saturating_sub(parts)..].iter().collect();
        end.display().to_string()
    };
    let mut titles = BTreeMap::new();
    let longest = folders.iter().map(|folder| folder.components().count()).max();
    for parts in 1..=longest.unwrap_or(0) {
        let mut alike: BTreeMap<String, Vec<&Path>> = BTreeMap::new();
        for folder in &folders {
            alike.entry(ending(folder, parts)).or_default().push(folder);
        }
        for (end, of) in alike {
            if let [one] = of[..] {
                titles.entry(one).or_insert(end);
            }
        }
        if titles.len() == folders.len() {
            break;
        }
    }
    titles
}

#[cfg(test)]
mod tests {
    use super::*;
    use light::built_in;
    use worker::Origin;

    fn listed(name: &str, origin: Origin, owner: Owner) -> ListedEnvironment {
        ListedEnvironment { name: name.to_owned(), origin, front: None, owner }
    }

    fn list() -> Vec<ListedEnvironment> {
        let file = |path: &str, owner| {
            let name = Path::new(path).file_stem().unwrap().to_string_lossy();
            listed(&name, Origin::File(path.into()), owner)
        };
        let own = built_in::all()[0];
        vec![
            file("/shoot/sky.exr", Owner::Shoot),
            listed(own.title, Origin::BuiltIn(own), Owner::Program),
            file("/hdri/night/alley.exr", Owner::Person),
            file("/hdri/day/beach.exr", Owner::Person),
            file("/hdri/night/bar.exr", Owner::Person),
            file("/old/day/field.exr", Owner::Folder),
        ]
    }

    fn titled(favourites: &[usize], search: &str) -> Vec<(String, Vec<usize>)> {
        let list = list();
        let marked = list.iter().enumerate();
        let names = |one: &ListedEnvironment| list.iter().filter(|o| o.name < one.name).count();
        let marked = marked.map(|(i, one)| (one, favourites.contains(&i), names(one)));
        let marked: Vec<_> = marked.collect();
        let groups = grouped(&marked, search);
        groups.into_iter().map(|group| (group.title, group.entries)).collect()
    }

    #[test]
    fn added_ones_stand_under_their_folders_and_favourites_come_first() {
        let group = |title: &str, entries: &[usize]| (title.to_owned(), entries.to_vec());
        assert_eq!(
            titled(&[4, 0], ""),
            [
                group("Favourites", &[4, 0]),
                group("Built in", &[1]),
                group("hdri/day", &[3]),
                group("night", &[2]),
                group("old/day", &[5]),
            ]
        );
        assert_eq!(titled(&[], "NIGHT"), [group("night", &[2, 4])]);
        assert_eq!(titled(&[], "b ni"), [group("night", &[4])]);
        assert_eq!(titled(&[4], "night"), [group("Favourites", &[4]), group("night", &[2])]);
        assert_eq!(titled(&[4], "favour"), [group("Favourites", &[4])]);
        assert_eq!(titled(&[], "no such"), []);
    }

    #[test]
    fn a_step_follows_what_is_shown_around_its_end() {
        let group =
            |entries: &[usize]| EnvironmentGroup { title: String::new(), folder: None, entries: entries.to_vec() };
        let groups = [group(&[4, 1]), group(&[0])];
        assert_eq!(step(&groups, 4, 1), Some(1));
        assert_eq!(step(&groups, 0, 1), Some(4));
        assert_eq!(step(&groups, 4, -1), Some(0));
        assert_eq!(step(&groups, 9, 1), Some(4), "the entry is filtered out");
        assert_eq!(step(&groups, 9, -1), Some(0));
        assert_eq!(step(&[], 4, 1), None);
    }
}
