//! The compositor: a reflectance field, the weights of its lamps and a scene become a picture.
//!
//! [`plan()`] decides which passes a scene calls for, [`compose()`] runs those and reports on all of
//! them: on the CPU where the field is in memory, on the GPU where the network left it there. A pass on the
//! GPU has a shader of its name under `shaders/` and a host under [`passes`], tested against its twin here.

mod background;
mod background_blur;
mod channels;
mod compose;
mod composition;
mod curve;
mod despill;
mod difference;
mod edges;
mod false_color;
mod field;
mod glare;
mod grain;
mod levels;
mod light_wrap;
pub mod passes;
mod picture;
mod plan;
mod pyramid;
pub mod reference;
mod relight;
mod reuse;
mod shrunk;
mod smoothing;
mod texel;
mod view;

pub use background::{Backdrop, CameraView, draw_background};
pub use background_blur::background_blur;
pub use channels::channels;
pub use compose::{compose, compose_reusing, execute};
pub use despill::{Screen, Spill, despill, guide, rim, spill};
pub use difference::difference;
pub use false_color::{CLIPPED, LEGEND, Zone, false_color};
pub use field::{Field, Keeping, Storage};
pub use glare::{brightest, glare};
pub use grain::{Grain, grain};
pub use levels::Levels;
pub use light_wrap::light_wrap;
pub use picture::{Extra, Identity, Ingredients, PassReport, Picture, Upstream};
pub use plan::{Facts, Inputs, PlannedPass, plan};
pub use reuse::Reuse;
pub use smoothing::Steady;
pub use view::{code, view};

pub use scene::Pass;

#[cfg(test)]
mod on_gpu_tests;
