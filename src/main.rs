//! Parse, run, print the error, exit code.

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    afterlight::memory::keep_freed();
    let cli = afterlight::cli::Cli::parse();
    match cli.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("afterlight: {error}");
            ExitCode::FAILURE
        }
    }
}
