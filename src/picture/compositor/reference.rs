//! The passes on the CPU, the reference for the shaders' tests.

pub use super::dither::dither;
pub use super::edges::{SOLID, extend_edges};
pub use super::exposure::scale;
pub use super::relight::{lit_lamps, relight, relight_compressed, relight_half};
pub use super::view::srgb as view;
