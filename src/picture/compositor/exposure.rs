//! Pass `exposure`: brightens or darkens the whole picture.

use super::descriptor::{Descriptor, LightStep, Run, decide};
use super::facts::key;
use super::passes::{GpuPicture, Recording, Shader};
use base::error::Result;
use imaging::Image;
use scene::Pass;

const SHADER: Shader = Shader::new("exposure", include_str!("../../../shaders/exposure.wgsl"));

pub(crate) const EXPOSURE: Descriptor = Descriptor {
    settings: |context| key(context.scene.exposure_stops.to_bits()),
    shader: Some(&SHADER),
    run: Run::Light(LightStep {
        in_memory: |context, picture| scale(picture, context.scene.exposure_stops.exp2()),
        on_gpu: |context, recording, picture| recording.scale(picture, context.scene.exposure_stops.exp2()),
        cached: false,
    }),
    ..Descriptor::new(Pass::Exposure, |context| {
        let stops = context.scene.exposure_stops;
        decide(stops != 0.0, || format!("{stops:+} stops"), "0 stops change nothing")
    })
};

/// Scales every value.
pub fn scale(picture: &mut Image, factor: f32) {
    picture.pixels.iter_mut().flatten().for_each(|v| *v *= factor);
}

impl Recording<'_> {
    /// Scales every value except the fourth ones.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn scale(&mut self, picture: &GpuPicture, factor: f32) -> Result<GpuPicture> {
        self.plain((&SHADER, "exposure"), [factor.to_bits(), 0], picture, None)
    }
}
