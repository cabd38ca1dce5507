//! Programs to compare with.

use super::need::{Need, found, require};
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// True if `ffmpeg` and `ffprobe` start; otherwise the test returns.
pub fn ffmpeg() -> bool {
    let here = starts("ffmpeg", "-version") && starts("ffprobe", "-version");
    require(Need::Ffmpeg, here, "ffmpeg or ffprobe is not installed")
}

/// True if `pfspanoramic` starts; otherwise the test returns.
pub fn pfspanoramic() -> bool {
    let here = starts("pfspanoramic", "--help");
    require(Need::Pfspanoramic, here, "pfstools is not installed")
}

/// True if `blender` starts; otherwise the test returns.
pub fn blender() -> bool {
    let here = starts("blender", "--version");
    require(Need::Blender, here, "blender is not installed")
}

/// The program `openjd` named by `AFTERLIGHT_OPENJD`, if it starts; otherwise the test returns.
pub fn openjd() -> Option<PathBuf> {
    let named = std::env::var_os("AFTERLIGHT_OPENJD").filter(|program| !program.is_empty());
    let program = named
        .map(PathBuf::from)
        .ok_or_else(|| "AFTERLIGHT_OPENJD does not name openjd-cli; `make openjd` installs it".to_owned());
    let program = program.and_then(|program| {
        if starts(&program.to_string_lossy(), "--help") {
            Ok(program)
        } else {
            Err(format!("{} does not start", program.display()))
        }
    });
    found(Need::OpenJobDescription, program)
}

/// The interpreter named by `AFTERLIGHT_PYTHON`, if it has these modules; otherwise the test returns.
pub fn python(modules: &[&str]) -> Option<PathBuf> {
    found(Need::Python, interpreter(modules))
}

/// The same interpreter, if it has MediaPipe; otherwise the test returns.
pub fn mediapipe() -> Option<PathBuf> {
    found(Need::Mediapipe, interpreter(&["mediapipe", "cv2"]))
}

fn interpreter(modules: &[&str]) -> Result<PathBuf, String> {
    let python = std::env::var_os("AFTERLIGHT_PYTHON").filter(|python| !python.is_empty());
    let python = python.ok_or("AFTERLIGHT_PYTHON is not set; `make peers` makes an interpreter")?;
    let import = format!("import {}", modules.join(", "));
    let output = Command::new(&python).args(["-c", &import]).output();
    let python = PathBuf::from(python);
    match output {
        Ok(output) if output.status.success() => Ok(python),
        Ok(_) => Err(format!("{} cannot `{import}`", python.display())),
        Err(e) => Err(format!("{} does not start: {e}", python.display())),
    }
}

fn starts(program: &str, option: &str) -> bool {
    let mut program = Command::new(program);
    program.arg(option).stdin(Stdio::null());
    program.stdout(Stdio::null()).stderr(Stdio::null());
    program.status().is_ok()
}
