//! One order of file names: listings of files go through `base::files::natural_order`.

use std::path::{Path, PathBuf};

/// Sorts of names or of listings that need no natural order: end of the file's path, text of the line, reason.
const ALLOWED: [(&str, &str, &str); 9] = [
    ("movies/index.rs", "kept.sort()", "by time of change"),
    ("movies/sequence.rs", "numbers.sort_unstable()", "numbers read from the names"),
    ("studio/look_shelf.rs", "numbers.sort_unstable_by", "numbers of versions"),
    ("export/shot_check/shot.rs", "files.sort()", "by frame number"),
    ("farm/record.rs", "found.sort_unstable_by_key", "by frames of a chunk"),
    ("training/checkpoints.rs", "all.sort_unstable_by_key", "by number, the newest first"),
    ("footage/lamp_list.rs", "names.sort()", "search for a name that appears twice"),
    ("footage/map.rs", "names.sort()", "search for a name that appears twice"),
    ("farm/snapshot.rs", "BTreeSet::new()", "files with hashes, compared and never shown"),
];
/// Names of variables that hold file names or paths.
const HOLDERS: [&str; 10] =
    ["names", "paths", "files", "found", "entries", "poses", "parts", "lists", "listing", "pictures"];

/// Sources of the product, without their tests: path, text.
fn sources() -> Vec<(PathBuf, String)> {
    let mut open = vec![PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").unwrap()).join("src")];
    let mut found = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            if path.is_dir() && name != "tests" {
                open.push(path);
            } else if name.ends_with(".rs") && !name.ends_with("tests.rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                let product = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
                found.push((path, product.to_owned()));
            }
        }
    }
    found
}

/// The variable and the call of a sort in a line: `names`, `.sort()`.
fn sort(line: &str) -> Option<(&str, &str)> {
    let at = line.find(".sort")?;
    let start = line[..at].rfind(|c: char| !c.is_alphanumeric() && c != '_').map_or(0, |i| i + 1);
    Some((&line[start..at], &line[at..]))
}

/// Fault of a line: an order of file names other than the natural one.
fn is_plain(line: &str, lists_files: bool) -> bool {
    // A set of names has their plain order.
    if lists_files && ["BTreeSet<PathBuf>", "BTreeSet<OsString>"].iter().any(|set| line.contains(set)) {
        return true;
    }
    let Some((variable, call)) = sort(line) else { return lists_files && line.contains("BTreeSet::new()") };
    if call.contains("natural_order") || call.contains("total_cmp") {
        return false;
    }
    let is_plain = [".sort()", ".sort_unstable()"].iter().any(|plain| call.starts_with(plain));
    lists_files || (is_plain && HOLDERS.contains(&variable))
}

fn allowed(path: &Path, line: &str) -> Option<usize> {
    ALLOWED.iter().position(|(file, text, _)| path.ends_with(file) && line.contains(text))
}

#[test]
fn file_names_have_one_order() {
    let (mut found, mut used) = (Vec::new(), [false; ALLOWED.len()]);
    for (path, text) in sources() {
        let lists_files = text.contains("read_dir(") || text.contains("sorted_names(");
        for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//")) {
            if !is_plain(line, lists_files) {
                continue;
            }
            match allowed(&path, line) {
                Some(place) => used[place] = true,
                None => found.push(format!("{}:{}: {}", path.display(), number + 1, line.trim())),
            }
        }
    }
    assert!(
        found.is_empty(),
        "use base::files::natural_order, or give the reason in tests/names.rs:\n{}",
        found.join("\n")
    );
    let unused: Vec<&str> =
        (ALLOWED.iter().zip(used)).filter_map(|((file, ..), used)| (!used).then_some(*file)).collect();
    assert!(unused.is_empty(), "no longer needed: {}", unused.join(", "));
}

#[test]
fn a_plain_order_is_noticed() {
    for (line, lists_files, is_fault) in [
        ("    names.sort();", false, true),
        ("    found.paths.sort_unstable();", false, true),
        ("    kept.sort();", true, true),
        ("    kept.sort();", false, false),
        ("    let mut names = BTreeSet::new();", true, true),
        ("    levels.sort_by(f32::total_cmp);", true, false),
        ("    names.sort_by(|a, b| natural_order(a, b));", true, false),
        ("    names.sort_by(|a, b| a.cmp(b));", true, true),
    ] {
        assert_eq!(is_plain(line, lists_files), is_fault, "{line}");
    }
}
