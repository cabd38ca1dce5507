//! The measured program, run as by a user.

use base::{Error, Result};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// The program to measure.
#[derive(Clone, Copy, Debug)]
pub struct Program<'a>(pub &'a Path);

impl Program<'_> {
    /// Standard output of a command. Its other output is passed through.
    ///
    /// # Errors
    /// When it cannot be started, or fails.
    pub fn run(&self, arguments: &[&str]) -> Result<String> {
        println!("afterlight {}", arguments.join(" "));
        printed(Command::new(self.0).args(arguments))
    }

    /// Result of a command, which is run with `--json`.
    ///
    /// # Errors
    /// When it cannot be started, fails, or prints no JSON.
    pub fn json(&self, arguments: &[&str]) -> Result<Value> {
        let text = self.run(&[arguments, &["--json"]].concat())?;
        serde_json::from_str(&text).map_err(|e| {
            let command = arguments.join(" ");
            Error::invalid(format!("`{command}` did not print JSON: {e}"), "Build it again")
        })
    }
}

/// Standard output of a command. Its errors are passed through.
///
/// # Errors
/// When it cannot be started, or fails.
pub fn printed(command: &mut Command) -> Result<String> {
    let output = command.stderr(Stdio::inherit()).output().map_err(|e| {
        let remedy = "Install it, or build Afterlight first: make build";
        Error::io("start", Path::new(command.get_program()), e, remedy)
    })?;
    if !output.status.success() {
        return Err(Error::invalid(format!("{command:?} failed"), "See its output above"));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Exit code of a measuring program, after printing its error.
pub fn finish(result: Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", error.for_terminal());
            ExitCode::FAILURE
        }
    }
}

/// Parses an option `NAME=DIR`.
///
/// # Errors
/// When there is no `=`.
pub fn named_folder(text: &str) -> std::result::Result<(String, PathBuf), String> {
    let (name, folder) = text.split_once('=').ok_or("write it as NAME=DIR, such as portrait=shoots/portrait")?;
    Ok((name.to_owned(), PathBuf::from(folder)))
}

/// A name as a file name: letters, digits and hyphens.
pub fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn output_json_and_failures_are_told_apart() {
        let echo = Program(Path::new("echo"));
        assert_eq!(echo.run(&["3"]).unwrap(), "3\n");
        assert!(echo.json(&["3"]).unwrap_err().to_string().contains("did not print JSON"));
        let failed = Program(Path::new("false")).run(&[]).unwrap_err().to_string();
        assert!(failed.contains("\"false\" failed"), "{failed}");
        let missing = Program(Path::new("no/such")).run(&[]).unwrap_err().to_string();
        assert!(missing.contains("no/such") && missing.contains("make build"), "{missing}");
    }

    #[test]
    fn a_shoot_is_a_name_and_a_folder() {
        let wanted = ("head scan".to_owned(), PathBuf::from("a=b"));
        assert_eq!(named_folder("head scan=a=b"), Ok(wanted));
        assert!(named_folder("head").unwrap_err().contains("NAME=DIR"));
        assert_eq!(file_name("stage: hair, β"), "stage--hair---");
    }
}
