//! Results of hard-case tests, line by line, for `docs/stability.md`.
//!
//! `make test` names a file in `AFTERLIGHT_STABILITY`; each case shown by a test is appended to it, and `make
//! stability` turns it into the page.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// Environment variable with the file that collects cases.
const RECORD: &str = "AFTERLIGHT_STABILITY";

/// A section of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    /// Contents of project folders, and claims in files.
    Strangers,
    /// Killed programs, full disks, several processes at once.
    Accidents,
    /// Options, closed pipes, programs that hang.
    Surroundings,
    /// Light, lamps and balls that are hard to compute with.
    Light,
    /// The network and its training.
    Network,
    /// Pictures, mattes and passes.
    Pictures,
}

impl Section {
    const ALL: [Self; 6] =
        [Self::Strangers, Self::Accidents, Self::Surroundings, Self::Light, Self::Network, Self::Pictures];

    fn title(self) -> &'static str {
        match self {
            Self::Strangers => "Files from strangers",
            Self::Accidents => "Killed, full, shared",
            Self::Surroundings => "Options and other programs",
            Self::Light => "Light, lamps and mirror balls",
            Self::Network => "The network and its training",
            Self::Pictures => "Pictures, mattes and passes",
        }
    }
}

/// A hard case that a test has shown to end well.
#[derive(Clone, Copy, Debug)]
pub struct Case<'a> {
    pub section: Section,
    /// Input of the case, such as "a panorama with NaN texels".
    pub case: &'a str,
    /// The program's answer, or a measured value and its bound in brackets, with units.
    pub outcome: &'a str,
}

/// Records a [`Case`](crate::stability::Case) for `docs/stability.md`, under the name of the calling test. Belongs
/// after the test's last assertion.
///
/// ```ignore
/// shown!(Light, "A sun of one texel", bound: "energy within 1e-5", measured: format!("{error:.1e}"));
/// shown!(Strangers, "`.lock` is a link", done: "a link is refused");
/// ```
#[macro_export]
macro_rules! shown {
    ($section:ident, $case:expr, bound: $bound:expr, measured: $measured:expr $(,)?) => {
        $crate::shown!($section, $case, done: &format!("{} ({})", $measured, $bound))
    };
    ($section:ident, $case:expr, done: $outcome:expr $(,)?) => {{
        fn here() {}
        let section = $crate::stability::Section::$section;
        let case = $crate::stability::Case { section, case: $case, outcome: $outcome };
        $crate::stability::record(env!("CARGO_PKG_NAME"), std::any::type_name_of_val(&here), &case);
    }};
}

/// Appends a case to the file named by `AFTERLIGHT_STABILITY`, if set. `place` is the path of a function in the test.
///
/// # Panics
/// If the file cannot be written.
pub fn record(package: &str, place: &str, case: &Case) {
    let Some(path) = std::env::var_os(RECORD) else { return };
    // In a single write, since other tests append at the same time.
    std::fs::OpenOptions::new()
        .append(true)
        .create(true)
        .open(&path)
        .and_then(|mut file| file.write_all(line(package, place, case).as_bytes()))
        .unwrap_or_else(|e| panic!("cannot record a case in {}: {e}", Path::new(&path).display()));
}

/// Line of a case: its fields, separated by tabs.
fn line(package: &str, place: &str, case: &Case) -> String {
    let test = place.trim_end_matches("::here").replace("::{{closure}}", "");
    let test = test.split_once("::").map_or(&*test, |(_, test)| test);
    let section = case.section.title();
    let words = [section, package, test, case.case, case.outcome];
    let words = words.map(|words| words.split_whitespace().collect::<Vec<_>>().join(" "));
    words.join("\t") + "\n"
}

/// Page of recorded cases: a table for each section, in the order of crates and tests. Of a case recorded twice, the
/// last one counts.
///
/// # Panics
/// If a line was not written by [`record`].
pub fn page(record: &str) -> String {
    let rows = record.lines().map(|line| {
        let row: [&str; 5] = (line.split('\t').collect::<Vec<_>>().try_into())
            .unwrap_or_else(|_| panic!("not a recorded case: {line:?}"));
        row
    });
    let mut cases: Vec<[&str; 5]> = Vec::new();
    for row in rows {
        match cases.iter_mut().find(|case| case[1..4] == row[1..4]) {
            Some(case) => *case = row,
            None => cases.push(row),
        }
    }
    cases.sort_by_key(|case| [case[1], case[2]]);
    let mut page = String::from(include_str!("stability.md"));
    for title in Section::ALL.map(Section::title) {
        let mut cases = cases.iter().filter(|case| case[0] == title).peekable();
        if cases.peek().is_none() {
            continue;
        }
        let _ = write!(
            page,
            "\n## {title}\n\n\
             | case | outcome | test |\n|---|---|---|\n"
        );
        for [_, package, test, case, outcome] in cases {
            let words = [case, outcome].map(|words| words.replace('|', "\\|"));
            let package = package.trim_start_matches("afterlight-");
            let _ = writeln!(page, "| {} | `{package}::{test}` |", words.join(" | "));
        }
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recorded_case_is_a_row_of_its_section() {
        let case = Case { section: Section::Light, case: "a sun of\none texel", outcome: "split | by area" };
        let old = line("afterlight-light", "light::sun::tests::kept::here", &Case { outcome: "lost", ..case });
        let new = line("afterlight-light", "light::sun::tests::kept::{{closure}}::here", &case);
        let other = line("afterlight", "stability::lock::here", &Case { section: Section::Strangers, ..case });
        let page = page(&(old + &new + &other));
        let row = "| a sun of one texel | split \\| by area | `light::sun::tests::kept` |";
        assert_eq!(page.matches(row).count(), 1, "{page}");
        assert!(!page.contains("lost"), "{page}");
        assert_eq!(page.matches("a sun").count(), 2, "{page}");
        let titles = ["## Files from strangers", "afterlight::lock`", "## Light", "sun::tests::kept`"];
        let at = titles.map(|title| page.find(title).unwrap());
        assert!(at.is_sorted(), "{page}");
    }
}
