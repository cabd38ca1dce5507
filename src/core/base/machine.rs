//! The machine behind measured figures.

use serde::{Deserialize, Serialize};

/// A machine and the program on it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Model name of the processor.
    pub processor: String,
    /// Number of hardware threads.
    pub threads: usize,
    pub system: String,
    /// Afterlight's version.
    pub version: String,
}

impl Machine {
    /// The current machine.
    pub fn this() -> Self {
        Self {
            processor: processor().unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            system: std::env::consts::OS.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }

    /// A line about the machine.
    pub fn words(&self) -> String {
        format!("{}, {} threads, {}, Afterlight {}", self.processor, self.threads, self.system, self.version)
    }
}

/// The processor's name, if the system provides it.
fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    let name = line.split_once(':')?.1.trim();
    (!name.is_empty()).then(|| name.to_owned())
}
