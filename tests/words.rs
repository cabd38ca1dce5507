//! Plain words: doc comments open with a noun, and phrases that need translating do not come back.

use std::path::{Path, PathBuf};

/// Openings that ask instead of naming.
const QUESTIONS: [&str; 7] = ["What", "Whether", "How", "Where", "Which", "Who", "Why"];
/// Largest share of doc comments that may open so.
const SHARE: f64 = 0.02;
/// Phrases of comments, sentences and pages, in lower case, each with its plain form.
const PHRASES: [(&str, &str); 10] = [
    ("anew", "again"),
    ("it is said", "a message says"),
    ("it is looked", "a check finds"),
    ("what is asked for", "the request"),
    ("is asked of", "is required of"),
    ("be wholly", "be fully"),
    ("its hash is another", "hash mismatch"),
    ("its checksum is another", "checksum mismatch"),
    ("by itself alone", "alone"),
    ("which is no", "expected …"),
];

/// Files of the repository, alone or under folders, whose names end so.
fn files(folders: &[&str], ending: &str) -> Vec<PathBuf> {
    let root = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").unwrap());
    let mut found = Vec::new();
    let mut open: Vec<PathBuf> = folders.iter().map(|folder| root.join(folder)).collect();
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path.to_string_lossy().ends_with(ending) && !path.ends_with("tests/words.rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn sources() -> Vec<PathBuf> {
    files(&["src", "tests", "benches"], ".rs")
}

/// Text of a doc comment.
fn doc(line: &str) -> Option<&str> {
    line.trim_start().strip_prefix("//")?.strip_prefix(['/', '!']).map(str::trim_start)
}

fn place(path: &Path, line: usize) -> String {
    format!("{}:{}", path.display(), line + 1)
}

#[test]
fn doc_comments_open_with_what_they_name() {
    let (mut all, mut asking) = (0, Vec::new());
    for path in sources() {
        let text = std::fs::read_to_string(&path).unwrap();
        let mut before = None;
        for (number, line) in text.lines().enumerate() {
            let words = doc(line);
            if let (Some(words), None) = (words, before) {
                all += 1;
                let first = words.split(|c: char| !c.is_alphabetic()).next().unwrap_or_default();
                if QUESTIONS.contains(&first) {
                    asking.push(format!("{}: {words}", place(&path, number)));
                }
            }
            before = words;
        }
    }
    assert!(all > 1000, "{all} doc comments were found");
    let share = asking.len() as f64 / all as f64;
    println!("{} of {all} doc comments open with a question word", asking.len());
    assert!(share <= SHARE, "{share:.3} of doc comments ask:\n{}", asking.join("\n"));
}

#[test]
fn phrases_that_need_translating_are_gone() {
    let mut found = Vec::new();
    let mut look = |path: &Path, number: usize, words: &str| {
        let words = words.to_lowercase();
        for (phrase, plain) in PHRASES {
            let whole = words.match_indices(phrase).any(|(at, _)| {
                let beside = |c: Option<char>| !c.is_some_and(char::is_alphanumeric);
                let after = words[at + phrase.len()..].chars().next();
                beside(words[..at].chars().next_back()) && beside(after)
            });
            if whole {
                found.push(format!("{}: \"{phrase}\", plainly \"{plain}\"", place(path, number)));
            }
        }
    };
    for path in sources().into_iter().chain(files(&["docs", "README.md", "CHANGELOG.md"], ".md")) {
        let text = std::fs::read_to_string(&path).unwrap();
        text.lines().enumerate().for_each(|(number, line)| look(&path, number, line));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn constructors_and_locals_have_names() {
    let mut found = Vec::new();
    for path in sources() {
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        for (number, line) in lines.iter().enumerate() {
            let local = ["let of ", "let mut of "].iter().any(|local| line.contains(local));
            // A method's receiver may stand on the next line.
            let parameters = lines[number..].iter().take(2).copied().collect::<String>();
            let parameters = parameters
                .split_once("fn of")
                .and_then(|(_, rest)| rest.starts_with(['(', '<']).then(|| rest.split_once('(')).flatten());
            let constructor = parameters.is_some_and(|(_, parameters)| {
                !parameters.split([',', ')']).next().is_some_and(|first| first.contains("self"))
            });
            if local || (line.contains("fn of") && constructor) {
                found.push(place(&path, number));
            }
        }
    }
    assert!(found.is_empty(), "called of, not new, from_x or what it is: {}", found.join("\n"));
}
