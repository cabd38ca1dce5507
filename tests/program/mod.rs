//! The program as started by a user or a script.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

/// Runs the program in a folder, which is also its cache; burn's log goes there too.
pub fn afterlight(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_afterlight"))
        .args(arguments)
        .current_dir(folder)
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .env("CUBECL_DEBUG_LOG", folder.join("kernels.log"))
        .output()
        .expect("the program starts")
}

/// Figures printed by a command with `--json`.
pub fn succeed(folder: &Path, arguments: &[&str]) -> Value {
    let output = afterlight(folder, arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?} failed: {errors}");
    let printed = String::from_utf8(output.stdout).expect("figures are text");
    serde_json::from_str(&printed).unwrap_or_else(|e| panic!("{arguments:?} printed {printed:?}: {e}"))
}

/// The one line of an expected failure.
pub fn fail(folder: &Path, arguments: &[&str]) -> String {
    let output = afterlight(folder, arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments:?} did not fail");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    errors.lines().last().unwrap_or_default().to_owned()
}
