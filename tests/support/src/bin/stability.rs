//! Prints `docs/stability.md` from the cases that the tests recorded in the given file.

use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(path) = std::env::args_os().nth(1) else {
        eprintln!("expected the file that AFTERLIGHT_STABILITY named when the tests ran");
        return ExitCode::from(2);
    };
    match std::fs::read_to_string(&path) {
        Ok(record) => {
            print!("{}", test_support::stability::page(&record));
            ExitCode::SUCCESS
        }
        Err(e) => {
            eprintln!("cannot read {}: {e}", path.display());
            ExitCode::FAILURE
        }
    }
}
