//! The compositor: a reflectance field, the weights of its lamps and a scene become a picture.
//!
//! [`plan()`] decides which passes a scene needs, [`compose()`] runs them and reports on all
//! passes: on the CPU if the field is in memory, on the GPU if the network left it there. Each pass has a file of its
//! name with its descriptor, its function on the CPU, and the host of its shader. The shader has the same name under
//! `shaders/` and is tested against the function.

mod background;
mod background_blur;
mod camera_view;
mod channels;
mod compose;
mod composition;
mod cubic;
mod curve;
mod descriptor;
mod despill;
mod difference;
mod dither;
mod edges;
mod environment_light;
mod exposure;
mod facts;
mod false_color;
mod field;
mod fine_light;
mod glare;
mod grain;
mod levels;
mod light_wrap;
pub mod passes;
mod picture;
mod plan;
mod plate;
mod pyramid;
pub mod reference;
mod relight;
mod reuse;
mod series;
mod shown;
mod shrunk;
mod smoothing;
mod texel;
mod upstream;
mod view;
mod vignette;

pub use background::{Backdrop, draw_background};
pub use background_blur::background_blur;
pub use camera_view::CameraView;
pub use channels::channels;
pub use compose::{compose, compose_reusing, execute};
pub use descriptor::PlannedPass;
pub use despill::{despill, guide, rim, spill};
pub use difference::difference;
pub use environment_light::EnvironmentLight;
pub use facts::{Facts, Grain, Inputs, Screen, Spill};
pub use false_color::{CLIPPED, LEGEND, Zone, false_color};
pub use field::{Field, FieldEncoder, Storage};
pub use glare::{brightest, glare};
pub use grain::grain;
pub use levels::Levels;
pub use light_wrap::light_wrap;
pub use picture::{Extra, Identity, Ingredients, PassReport, Picture, Upstream};
pub use plan::plan;
pub use plate::{FineLight, Plate, PlateSquare};
pub use reuse::Reuse;
pub use series::Series;
pub use shown::ShownPicture;
pub use smoothing::Steady;
pub use view::{code, view, viewed, viewed_code};
pub use vignette::vignette;

pub use scene::Pass;

use descriptor::Descriptor;

/// Every pass, in the order of [`Pass::ALL`].
const PASSES: [&Descriptor; Pass::ALL.len()] = [
    &upstream::PREDICT,
    &smoothing::SMOOTHING,
    &upstream::WEIGHTS,
    &relight::RELIGHT,
    &plate::PLATE,
    &despill::DESPILL,
    &background::BACKGROUND,
    &background_blur::BACKGROUND_BLUR,
    &light_wrap::LIGHT_WRAP,
    &glare::GLARE,
    &vignette::VIGNETTE,
    &exposure::EXPOSURE,
    &view::VIEW,
    &grain::GRAIN,
    &dither::DITHER,
    &channels::CHANNELS,
    &difference::DIFFERENCE,
    &false_color::FALSE_COLOR,
];

/// Shaders as WGSL for a GPU.
pub fn shaders() -> impl Iterator<Item = &'static passes::Shader> {
    let own = PASSES.into_iter().filter_map(|pass| pass.shader);
    own.chain(passes::SHARED)
}

#[cfg(test)]
mod on_gpu_tests;
