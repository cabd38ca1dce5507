//! Saved measurements, with the build of the program behind them.

use base::files::{self, write_beside};
use base::{Error, Result};
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;

/// A result and its build.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    pub build: String,
    pub result: Value,
}

impl Kept {
    /// The result saved in a file; None without one, or if it is not a saved result.
    pub fn read(path: &Path) -> Option<Self> {
        let text = files::read_text(path, files::MOST_TEXT).ok()?;
        let kept: Value = serde_json::from_str(&text).ok()?;
        Some(Self { build: kept["build"].as_str()?.to_owned(), result: kept.get("result")?.clone() })
    }

    /// The result saved in a file, or otherwise the JSON that `make` prints, which is then saved.
    ///
    /// # Errors
    /// When `make` fails, prints something else, or the file cannot be written.
    pub fn or(path: &Path, build: &str, make: impl FnOnce() -> Result<String>) -> Result<Self> {
        if let Some(kept) = Self::read(path) {
            return Ok(kept);
        }
        let printed = make()?;
        let result = serde_json::from_str(&printed)
            .map_err(|e| Error::codec("read", path, e.to_string(), "The program did not print JSON; see above"))?;
        let kept = Self { build: build.to_owned(), result };
        let text = json!({"build": kept.build, "result": kept.result}).to_string();
        write_beside(path, |out| out.write_all(text.as_bytes()))?;
        Ok(kept)
    }
}
