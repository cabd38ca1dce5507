//! Circles among the files of a crate: files that import each other, directly or through others.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Most circles of all crates together.
const MOST: usize = 8;

/// A module's path within its crate; empty for `lib.rs`.
type Module = Vec<String>;

#[derive(Default)]
struct Crate {
    /// Names that each module imports for itself, as written.
    imports: BTreeMap<Module, Vec<Vec<String>>>,
    /// Names that each module hands on, as written.
    exports: BTreeMap<Module, Vec<Vec<String>>>,
}

impl Crate {
    fn read(root: &Path) -> Self {
        let mut found = Self::default();
        found.read_folder(root, &[]);
        found
    }

    fn read_folder(&mut self, folder: &Path, module: &[String]) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
            if name.ends_with("tests") {
                continue;
            }
            let own = if name == "mod" || name == "lib" { None } else { Some(name) };
            let module: Module = module.iter().cloned().chain(own).collect();
            if path.is_dir() {
                self.read_folder(&path, &module);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                self.read_file(&std::fs::read_to_string(&path).unwrap(), module);
            }
        }
    }

    fn read_file(&mut self, text: &str, module: Module) {
        let text: String = text.split("#[cfg(test)]\nmod tests {").next().unwrap().to_owned();
        let text = text.split("#[cfg(test)]\npub mod tests {").next().unwrap();
        let (mut imports, mut exports) = (Vec::new(), Vec::new());
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            let (public, rest) = match line.strip_prefix("pub") {
                Some(rest) => (true, rest.split_once(' ').map_or("", |(_, rest)| rest)),
                None => (false, line),
            };
            let Some(first) = rest.strip_prefix("use ") else { continue };
            let mut tree = first.to_owned();
            while !tree.contains(';') {
                tree += lines.next().unwrap();
            }
            let tree = tree.split(';').next().unwrap();
            expand(tree, &[], if public { &mut exports } else { &mut imports });
        }
        self.imports.insert(module.clone(), imports);
        self.exports.insert(module, exports);
    }

    /// The module that defines what a path names; None outside the crate.
    fn home(&self, module: &[String], path: &[String], hops: usize) -> Option<Module> {
        let mut at = module.to_vec();
        let mut rest = path;
        match path[0].as_str() {
            "crate" => (at, rest) = (Vec::new(), &path[1..]),
            "self" => rest = &path[1..],
            "super" => {
                while rest.first().is_some_and(|name| name == "super") {
                    at.pop();
                    rest = &rest[1..];
                }
            }
            child => {
                let inner = [module, &[child.to_owned()]].concat();
                self.imports.get(&inner)?;
            }
        }
        while let Some(name) = rest.first() {
            let inner = [&at[..], std::slice::from_ref(name)].concat();
            if !self.imports.contains_key(&inner) {
                break;
            }
            (at, rest) = (inner, &rest[1..]);
        }
        let name = rest.first();
        let handed = self.exports.get(&at).into_iter().flatten();
        let handed = handed.filter(|path| name.is_some() && path.last() == name);
        let homes = handed.filter(|_| hops < 8).filter_map(|path| self.home(&at, path, hops + 1));
        let home = homes.into_iter().next();
        home.or(Some(at))
    }

    /// The circles, each as its modules.
    fn circles(&self) -> Vec<Vec<Module>> {
        let used = |module: &Module| {
            let homes = self.imports[module].iter().filter_map(|path| self.home(module, path, 0));
            homes.filter(|home| home != module).collect::<BTreeSet<_>>()
        };
        let used: BTreeMap<&Module, _> = self.imports.keys().map(|m| (m, used(m))).collect();
        let reached = |from: &Module| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
            while let Some(module) = open.pop() {
                open.extend(used[module].iter().filter(|next| seen.insert((*next).clone())));
            }
            seen
        };
        let reached: BTreeMap<&Module, _> = self.imports.keys().map(|m| (m, reached(m))).collect();
        let (mut found, mut done) = (Vec::new(), BTreeSet::new());
        for module in self.imports.keys() {
            if reached[module].contains(module) && !done.contains(module) {
                let mutual = reached[module].iter().filter(|other| reached[other].contains(module));
                let circle: Vec<Module> = mutual.cloned().collect();
                done.extend(circle.iter().cloned());
                found.push(circle);
            }
        }
        found
    }
}

/// Adds all paths of a `use` tree.
fn expand(tree: &str, before: &[String], into: &mut Vec<Vec<String>>) {
    let (mut depth, mut start) = (0, 0);
    let ends = tree.char_indices().filter(|&(_, c)| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ',' && depth == 0
    });
    let ends: Vec<usize> = ends.map(|(i, _)| i).chain([tree.len()]).collect();
    for end in ends {
        let part = tree[start..end].trim();
        start = (end + 1).min(tree.len());
        let (path, inner) =
            part.split_once('{').map_or((part, None), |(path, inner)| (path, inner.trim_end().strip_suffix('}')));
        let path = path.split(" as ").next().unwrap();
        let names = path.split("::").map(str::trim).filter(|name| !name.is_empty());
        let names: Vec<String> = before.iter().cloned().chain(names.map(str::to_owned)).collect();
        match inner {
            Some(inner) => expand(inner, &names, into),
            None if !names.is_empty() => into.push(names),
            None => {}
        }
    }
}

fn crates() -> Vec<PathBuf> {
    let source = Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap()).join("src");
    let folders = |path: &Path| {
        let entries = std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path());
        entries.filter(|path| path.is_dir()).collect::<Vec<_>>()
    };
    let all = folders(&source).iter().flat_map(|group| folders(group)).collect::<Vec<_>>();
    all.into_iter().filter(|folder| folder.join("lib.rs").is_file()).collect()
}

#[test]
fn few_files_import_each_other() {
    let crates = crates();
    assert!(crates.len() > 20, "{crates:?}");
    let mut found = Vec::new();
    for root in crates {
        let circles = Crate::read(&root).circles();
        let named = circles.iter().map(|circle| {
            let modules: Vec<String> = circle.iter().map(|module| module.join("::")).collect();
            format!("{}: {}", root.display(), modules.join(", "))
        });
        found.extend(named);
    }
    assert!(found.len() <= MOST, "{} circles, {MOST} at most:\n{}", found.len(), found.join("\n"));
}

#[test]
fn a_circle_through_what_a_module_hands_on_is_found() {
    let mut made = Crate::default();
    made.read_file("pub use inner::{Deep, deep::Other as Name};", Vec::new());
    made.read_file("use super::user::User;\nmod deep;\npub use deep::Deep;", vec!["inner".into()]);
    made.read_file("use std::path::Path;", ["inner", "deep"].map(String::from).to_vec());
    made.read_file("use crate::{\n    inner,\n    Deep,\n};", vec!["user".into()]);
    assert_eq!(made.circles(), [[vec!["inner".to_owned()], vec!["user".to_owned()]]]);
}
