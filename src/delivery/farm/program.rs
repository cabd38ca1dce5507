//! Program that wrote a job, and program that runs it.

use base::error::{Error, Result};
use export::hash_file;
use serde::{Deserialize, Serialize};
use std::fmt::{self, Display};
use std::path::Path;
use std::sync::OnceLock;

/// A build of Afterlight.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Program {
    pub version: String,
    /// SHA-256 of its file, in hexadecimal digits.
    pub sha256: String,
}

impl Program {
    /// The running program.
    ///
    /// # Errors
    /// When its file cannot be read.
    pub fn this() -> Result<Self> {
        static THIS: OnceLock<Program> = OnceLock::new();
        if let Some(this) = THIS.get() {
            return Ok(this.clone());
        }
        let own = || {
            let path = std::env::current_exe()?;
            hash_file(&path).map(|(_, sum)| sum)
        };
        let sha256 = own().map_err(|e| {
            let remedy = "Check that Afterlight's program file exists and can be read";
            Error::io("read", "afterlight", e, remedy)
        })?;
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Ok(THIS.get_or_init(|| Self { version, sha256 }).clone())
    }

    /// Refuses a job that another program wrote: frames of two programs may differ.
    ///
    /// # Errors
    /// When the builds differ; the message names both.
    pub(crate) fn check(&self, wrote: &Self, job: &Path) -> Result<()> {
        if self == wrote {
            return Ok(());
        }
        Err(Error::invalid(
            format!("{} was written by Afterlight {wrote}, but this worker has {self}", job.display()),
            "Install that build on the workers, or write the job again with this build: frames of two builds may differ",
        ))
    }
}

impl Display for Program {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let short = self.sha256.get(..12).unwrap_or(&self.sha256);
        write!(f, "{} (build {short})", self.version)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_program_is_refused_by_both_names() {
        let [old, new] = [("0.1.0", 'a'), ("0.1.0", 'b')]
            .map(|(version, digit)| Program { version: version.to_owned(), sha256: digit.to_string().repeat(64) });
        assert!(new.check(&new.clone(), Path::new("job")).is_ok());
        let said = new.check(&old, Path::new("job")).unwrap_err().to_string();
        let names = ["0.1.0 (build aaaaaaaaaaaa)", "0.1.0 (build bbbbbbbbbbbb)"];
        assert!(names.iter().all(|name| said.contains(name)), "{said}");
    }
}
