//! Writes the tables of `docs/farm.md`: time per frame on this machine, as farm workers run it, the resulting time of
//! twenty hours of footage, and the scaling of a job.
//!
//! Run by `make farm`, in some ten minutes. Nothing else should run meanwhile.

mod case;
mod measure;
mod simulation;
mod tables;

use base::machine::Machine;
use case::CASES;
use measure::Rate;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

const BEGIN: &str = "<!-- written by `make farm` -->";
const END: &str = "<!-- to here -->";

type Result<T> = std::result::Result<T, String>;

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [program, folder, page] = &arguments[..] else {
        eprintln!("usage: AFTERLIGHT FOLDER PAGE, with FOLDER for projects and jobs");
        return ExitCode::from(2);
    };
    match write(program, folder, page) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{} cannot be written: {e}", page.display());
            ExitCode::FAILURE
        }
    }
}

/// Measures all cases in turn, and writes the page.
fn write(program: &Path, folder: &Path, page: &Path) -> Result<()> {
    // A missing tool or mark is reported before the measuring starts.
    let text = std::fs::read_to_string(page).map_err(|e| e.to_string())?;
    with_tables(&text, "")?;
    let afterlight =
        Afterlight { program: std::path::absolute(program).map_err(|e| e.to_string())? };
    let mut rates: Vec<Rate> = Vec::new();
    for case in &CASES {
        eprintln!("{}", case.words());
        let [project, shoot] = case.prepare(&afterlight, folder)?;
        let rate = measure::measure(case, &afterlight, (&project, &shoot), folder)?;
        eprintln!("{rate:?}");
        rates.push(rate);
    }
    let machine = Machine::this();
    let text = with_tables(&text, &tables::tables(&rates, &machine))?;
    std::fs::write(page, text).map_err(|e| e.to_string())
}

/// The page with these tables between its marks.
fn with_tables(page: &str, tables: &str) -> Result<String> {
    let missing = || format!("the lines {BEGIN} and {END} are missing");
    let (before, rest) = page.split_once(BEGIN).ok_or_else(missing)?;
    let (_, after) = rest.split_once(END).ok_or_else(missing)?;
    Ok(format!("{before}{BEGIN}\n\n{tables}\n{END}{after}"))
}

/// The program to measure.
struct Afterlight {
    program: PathBuf,
}

impl Afterlight {
    /// Output of a command with `--json`.
    fn run(&self, command: &str, words: &[&str]) -> Result<serde_json::Value> {
        let mut process = Command::new(&self.program);
        process.arg(command).args(words).arg("--json");
        let output = process.output().map_err(|e| format!("{command}: {e}"))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            return Err(format!("afterlight {command} {words:?} failed: {said}"));
        }
        serde_json::from_slice(&output.stdout).map_err(|e| format!("afterlight {command}: {e}"))
    }
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
