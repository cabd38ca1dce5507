//! Measures and their figures.

use super::budget::Spread;
use base::error::Result;
use serde::{Deserialize, Serialize};
use training::Preset;

/// One measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "measure")]
pub enum Measure {
    /// A check that the device computes as the CPU does.
    SelfTest,
    /// Training steps and predictions of a preset's network.
    Network {
        #[serde(with = "preset")]
        preset: Preset,
        size: usize,
    },
    /// First step and first prediction of the preset `quick`, in a process that finds the kernels kept by this
    /// network's measure.
    FirstUse { size: usize },
    /// Copy speed of the device, every pass, and the sum of lamps.
    Passes { size: usize },
    /// A frame from plate to picture, with and without its prediction, and turning the light by hand. The network works
    /// at `working` pixels.
    Picture {
        #[serde(with = "preset")]
        preset: Preset,
        working: usize,
        size: usize,
    },
}

/// Request that a measuring process receives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    pub measure: Measure,
    /// True for a GPU, even a software one; false for the CPU.
    pub gpu: bool,
    /// Approximate time allowed, in seconds.
    pub seconds: f64,
}

/// One measured figure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Name of the timed work.
    pub what: String,
    /// None if the device has no clock for it, or after only the first run.
    pub times: Option<Spread>,
    /// Milliseconds of the first run beyond the median: compiling and tuning kernels, allocating memory. The whole time
    /// of the first run if it was the only one.
    pub first_ms: Option<f64>,
    /// Time in which the device copies as many bytes as the work reads and writes.
    pub copy_ms: Option<f64>,
    /// Bytes copied per second, counting reads and writes.
    pub bytes_per_second: Option<f64>,
    /// A sentence in place of times.
    pub note: Option<String>,
    /// Peak memory of the process so far, in bytes.
    pub peak_bytes: Option<u64>,
    /// GPU memory allocated so far, in bytes.
    pub gpu_bytes: Option<u64>,
}

/// Receiver of each figure as soon as it is known. A figure that replaces an earlier one has the same `what`. An error
/// ends the measure.
pub type Tell<'a> = &'a mut dyn FnMut(Figure) -> Result<()>;

/// A preset by its name.
mod preset {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};
    use training::Preset;

    #[allow(clippy::trivially_copy_pass_by_ref)]
    pub fn serialize<S: Serializer>(preset: &Preset, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(preset.name())
    }

    pub fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<Preset, D::Error> {
        let name = String::deserialize(from)?;
        let found = Preset::ALL.into_iter().find(|preset| preset.name() == name);
        found.ok_or_else(|| D::Error::custom(format!("there is no preset {name:?}")))
    }
}
