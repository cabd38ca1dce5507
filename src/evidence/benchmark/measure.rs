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
    /// The first step and the first prediction of the preset `quick`, in a process that finds what the measure of this
    /// network kept.
    FirstUse { size: usize },
    /// The device's copy, every pass, and the sum of lamps.
    Passes { size: usize },
    /// A frame from the plate to the picture, with and without its prediction, and the light turned by hand. The network
    /// works at `working` pixels.
    Picture {
        #[serde(with = "preset")]
        preset: Preset,
        working: usize,
        size: usize,
    },
}

/// A measure as a process is asked for it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    pub measure: Measure,
    /// On a GPU, even a software one; else on the CPU.
    pub gpu: bool,
    /// About how long it may take, in seconds.
    pub seconds: f64,
}

/// One thing that was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Name of the timed work.
    pub what: String,
    /// None if the device has no clock for it, and after the first run alone.
    pub times: Option<Spread>,
    /// Milliseconds of the first run beyond the median: kernels compiled and timed against each other, memory taken. The
    /// whole time of the first run where there was no other.
    pub first_ms: Option<f64>,
    /// The time in which the device copies as many bytes as have to be read and written.
    pub copy_ms: Option<f64>,
    /// Bytes that the device copies in a second, read and written both counted.
    pub bytes_per_second: Option<f64>,
    /// A sentence in place of times.
    pub note: Option<String>,
    /// Bytes that the process has held at most until now.
    pub peak_bytes: Option<u64>,
    /// Bytes that it has taken of the GPU's memory until now.
    pub gpu_bytes: Option<u64>,
}

/// Receiver of each figure as soon as it is known; one that replaces another has its `what`. An error ends the measure.
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
