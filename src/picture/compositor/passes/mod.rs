//! Recordings of shaders, which make pictures on the GPU. The host of a pass is in the pass's own file.

mod clock;
mod display_texture;
mod lost;
mod measures;
mod pictures;
mod pyramid;
mod read;
mod recording;
pub(crate) mod relight;
mod shader;
mod subject;

pub use display_texture::DisplayTexture;
pub use lost::is_lost;
pub(crate) use pictures::extent;
pub use pictures::{GpuPicture, PicturePasses};
pub use recording::{Readback, Recording, Unread};
pub use relight::RelightPass;
pub use shader::Shader;
pub use subject::GpuMatte;

/// Shaders shared by several passes.
pub(crate) const SHARED: [&Shader; 5] =
    [&display_texture::DISPLAY_TEXTURE, &measures::MEASURE, &pyramid::PYRAMID, &relight::RELIGHT, &subject::EDGES];

#[cfg(test)]
pub(crate) mod agreement_tests;
