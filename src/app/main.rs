//! Parse, run, print the error, exit code.

use clap::Parser;
use std::io::Write;
use std::process::ExitCode;

#[cfg(target_os = "linux")]
mod runtime_folder;

/// The exit code for options that cannot be.
const WRONG_USAGE: u8 = 2;

fn main() -> ExitCode {
    afterlight::memory::keep_freed();
    #[cfg(target_os = "linux")]
    runtime_folder::name();
    let cli = afterlight::cli::Cli::parse();
    let (done, failure) = match cli.check() {
        Ok(()) => (cli.run(), ExitCode::FAILURE),
        refused => (refused, ExitCode::from(WRONG_USAGE)),
    };
    done.map_or_else(
        |error| {
            // Where nobody reads this, the exit code still tells.
            let _ = writeln!(std::io::stderr(), "afterlight: {}", error.for_terminal());
            failure
        },
        |()| ExitCode::SUCCESS,
    )
}
