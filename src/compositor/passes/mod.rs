//! Passes on the GPU, each beside a shader of its name.

mod clock;
mod effects;
mod lost;
mod measures;
mod pictures;
mod read;
mod recording;
pub(crate) mod relight;
mod subject;

pub use lost::is_lost;
pub use pictures::{GpuPicture, PicturePasses};
pub use recording::{Readback, Recording};
pub use relight::RelightPass;
pub use subject::GpuMatte;
