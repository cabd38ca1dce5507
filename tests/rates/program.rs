//! Writes the tables of `docs/farm.md`: time per frame on this machine, as farm workers run it, the resulting time of
//! twenty hours of footage, and the scaling of a job.
//!
//! Run by `make farm`, in some ten minutes. Nothing else should run meanwhile.

mod case;
mod measure;
mod simulation;
mod tables;

use base::files::write_beside;
use base::machine::Machine;
use base::{Error, Result};
use case::CASES;
use measure::Rate;
use measuring::{Program, finish};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const BEGIN: &str = "<!-- written by `make farm` -->";
const END: &str = "<!-- to here -->";

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [program, folder, page] = &arguments[..] else {
        eprintln!("usage: AFTERLIGHT FOLDER PAGE, with FOLDER for projects and jobs");
        return ExitCode::from(2);
    };
    finish(write(program, folder, page))
}

/// Measures all cases in turn, and writes the page.
fn write(program: &Path, folder: &Path, page: &Path) -> Result<()> {
    // A missing tool or mark is reported before the measuring starts.
    let text =
        std::fs::read_to_string(page).map_err(|e| Error::io("read", page, e, "Start in the repository's root"))?;
    with_tables(&text, "")?;
    let mut rates: Vec<Rate> = Vec::new();
    for case in &CASES {
        eprintln!("{}", case.words());
        let [project, shoot] = case.prepare(Program(program), folder)?;
        let rate = measure::measure(case, Program(program), (&project, &shoot), folder)?;
        eprintln!("{rate:?}");
        rates.push(rate);
    }
    let machine = Machine::this();
    let text = with_tables(&text, &tables::tables(&rates, &machine))?;
    write_beside(page, |out| out.write_all(text.as_bytes()))
}

/// The page with these tables between its marks.
fn with_tables(page: &str, tables: &str) -> Result<String> {
    let missing = || Error::invalid(format!("the lines {BEGIN} and {END} are missing"), "Restore them in the page");
    let (before, rest) = page.split_once(BEGIN).ok_or_else(missing)?;
    let (_, after) = rest.split_once(END).ok_or_else(missing)?;
    Ok(format!("{before}{BEGIN}\n\n{tables}\n{END}{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_stands_between_the_marks_is_written() {
        let page = format!("before\n{BEGIN}\nold\n{END}\nafter\n");
        let written = with_tables(&page, "| new |").unwrap();
        assert!(written.starts_with("before\n") && written.ends_with("\nafter\n"));
        assert!(!written.contains("old") && written.contains("\n| new |\n"));
        assert_eq!(with_tables(&written, "| new |").unwrap(), written);
        assert!(with_tables("no marks", "").is_err());
    }
}
