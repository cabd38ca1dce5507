//! What makes pictures on the GPU: recordings of shaders. The host of a pass is in the pass's own file.

mod clock;
mod lost;
mod measures;
mod pictures;
mod pyramid;
mod read;
mod recording;
pub(crate) mod relight;
mod shader;
mod subject;

pub use lost::is_lost;
pub(crate) use pictures::extent;
pub use pictures::{GpuPicture, PicturePasses};
pub use recording::{Readback, Recording};
pub use relight::RelightPass;
pub use shader::Shader;
pub use subject::GpuMatte;

/// The shaders that several passes stand on.
pub(crate) const SHARED: [&Shader; 4] = [
    &measures::MEASURE,
    &pyramid::PYRAMID,
    &relight::RELIGHT,
    &subject::EDGES,
];

#[cfg(test)]
pub(crate) mod agreement_tests;
