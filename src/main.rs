//! Parse, run, print the error, exit code.

use clap::Parser;
use std::process::ExitCode;

#[cfg(target_os = "linux")]
mod runtime_folder;

fn main() -> ExitCode {
    afterlight::memory::keep_freed();
    #[cfg(target_os = "linux")]
    runtime_folder::name();
    let cli = afterlight::cli::Cli::parse();
    match cli.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("afterlight: {error}");
            ExitCode::FAILURE
        }
    }
}
