//! Convolutions on the tile registers of Intel's AMX: products of bf16, summed in f32.
//!
//! They follow the plan of [`super::convolution`]: bands of rows surrounded by zeros, in which a
//! tap is a constant distance. Here the copy also converts values to bf16.

mod band;
mod correlation;
mod layout;
#[cfg_attr(not(all(target_arch = "x86_64", target_os = "linux")), path = "no_machine.rs")]
mod machine;
mod pack;
mod product;
#[cfg(test)]
mod tests;
mod tiles;
mod weights;

pub use correlation::correlate;
pub use product::convolve;
pub use tiles::available;

/// Inputs and outputs from which tiles are full enough: below, vectors are faster.
pub const MIN_CHANNELS: usize = 16;

/// Conversion of f32 factors to factors of bf16.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Each is rounded to the nearest bf16: 8 bits of precision.
    Half,
    /// Each is the sum of two bf16, high and low. Products of two low parts are left out, so that a
    /// product is exact to 2⁻¹⁵ at worst, and a sum of many is close to that of f32.
    Split,
}

impl Precision {
    /// bf16 for each value.
    pub fn parts(self) -> usize {
        match self {
            Self::Half => 1,
            Self::Split => 2,
        }
    }
}
