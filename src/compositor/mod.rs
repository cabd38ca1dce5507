//! The compositor: a reflectance field, the weights of its lamps and a scene become a picture.
//!
//! [`plan()`] decides which passes a scene calls for, [`compose()`] runs those and reports on all of
//! them. [`mod@reference`] holds the passes for the CPU; a pass that also runs on the GPU has a shader of
//! its name under `shaders/` and a host under [`passes`], tested against its twin here.

mod background;
mod compose;
mod field;
mod levels;
pub mod passes;
mod plan;
pub mod reference;

pub use background::{CameraView, draw_background};
pub use compose::{Ingredients, PassReport, Picture, Upstream, compose, execute};
pub use field::Field;
pub use levels::Levels;
pub use plan::{Facts, Pass, PlannedPass, plan};
