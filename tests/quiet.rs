//! Sessions without a runtime folder, as in a container: the graphics driver's complaint about it is not printed.
#![cfg(target_os = "linux")]

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

/// Output of the program on stderr, with `runtime` as the session's runtime folder, or without one.
fn printed(at: &Path, runtime: Option<&str>, arguments: &str) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_afterlight"));
    command
        .args(arguments.split(' '))
        .current_dir(at)
        .env("XDG_CACHE_HOME", at.join("cache"))
        .env_remove("XDG_RUNTIME_DIR");
    if let Some(runtime) = runtime {
        command.env("XDG_RUNTIME_DIR", runtime);
    }
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments}: {said}");
    said
}

#[test]
fn a_session_without_a_runtime_folder_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    printed(at, None, "stage shoot --size 32 --frames 2 --lamps 12");
    printed(at, None, "import film --shoot shoot --size 32");
    printed(at, None, "calibrate film");
    // The device choice lists the adapters.
    for runtime in [None, Some(""), Some("relative")] {
        let said = printed(at, runtime, "train film --fresh --epochs 1 --device auto");
        assert!(!said.contains("XDG_RUNTIME_DIR"), "{said}");
    }

    let session = std::fs::metadata("/proc/self").map(|own| {
        let person = std::os::unix::fs::MetadataExt::uid(&own);
        Path::new("/run/user").join(person.to_string())
    });
    if !session.unwrap().exists() {
        let own = std::fs::metadata(at.join("cache/afterlight/runtime")).unwrap();
        assert_eq!(own.permissions().mode() & 0o777, 0o700);
    }
}
