//! Precision of convolutions.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Precision of convolutions: accuracy against time. Sums are f32 in each, on a CPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// f32.
    Full,
    /// Factors rounded to bf16 if the processor multiplies these (AVX-512 BF16): results differ by 3e-3 of the largest. f32
    /// elsewhere, except that predictions on a GPU use f16 where available.
    #[serde(alias = "split", alias = "half")]
    #[value(aliases = ["split", "half"])]
    Mixed,
    /// `mixed` on a CPU that multiplies bf16 faster than f32 (AMD since Zen 4), else `full`.
    #[default]
    Auto,
}
