//! Passes on the GPU, each beside a shader of its name.

mod effects;
mod pictures;
mod read;
mod relight;

pub use pictures::{GpuPicture, PicturePasses};
pub use relight::{Layout, RelightPass};
