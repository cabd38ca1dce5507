//! Passes on the GPU, each beside a shader of its name.

mod clock;
mod effects;
mod lost;
mod measures;
mod pictures;
mod read;
pub(crate) mod relight;
mod subject;
mod work;

pub use lost::is_lost;
pub use pictures::{GpuPicture, PicturePasses};
pub use relight::RelightPass;
pub use subject::GpuMatte;
pub use work::{Finished, Work};
