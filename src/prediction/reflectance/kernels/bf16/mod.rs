//! Convolutions with factors of bf16, summed in f32, by the processor's `vdpbf16ps`.
//!
//! They follow the plan of [`super::convolution`]: bands of rows surrounded by zeros, in which a tap is a constant
//! distance. Here the copy also rounds values to bf16.

mod band;
mod correlation;
mod layout;
mod pack;
mod product;
mod stored;
mod sum;
#[cfg(test)]
mod tests;
mod weights;

pub use correlation::correlate;

pub use product::convolve;
pub use stored::{Signs, to_bf16};
pub use sum::{available, multiply_add};

/// Inputs and outputs from which blocks of sums are full enough: below, f32 is faster.
pub const MIN_CHANNELS: usize = 16;
