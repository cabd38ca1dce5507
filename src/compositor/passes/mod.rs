//! Passes on the GPU, each beside a shader of its name.

mod relight;

pub use relight::RelightPass;
