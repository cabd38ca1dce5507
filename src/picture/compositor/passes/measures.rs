//! Measurements for passes on the GPU. Full pictures stay there: they are reduced before reading.

use super::pictures::{GpuPicture, extent};
use super::recording::{PlainParams, Recording};
use super::shader::Shader;
use base::error::Result;
use bytemuck::bytes_of;

pub(crate) const MEASURE: Shader = Shader::new("measure", include_str!("../../../../shaders/measure.wgsl"));

/// Number of values that a picture is reduced to, as in the shader.
const GROUPS: u32 = 64;

/// Every function fails if the GPU cannot hold its pictures, or fails itself.
impl Recording<'_> {
    /// Every `step`-th pixel: at most the picture's number of pixels divided by `step`.
    pub fn every(&mut self, picture: &GpuPicture, step: usize) -> Result<Vec<[f32; 4]>> {
        let count = (picture.width * picture.height).div_ceil(step);
        let params = PlainParams { size: extent((count, 1)), values: [step as u32, 0] };
        let pick = (&MEASURE, "pick");
        let picked = self.run(pick, bytes_of(&params), picture, None, (count, 1))?;
        let [picked] = self.read([&picked])?;
        Ok(picked.pixels)
    }

    /// Partial results of an entry point of `measure` for a picture, still to be combined: reads 1 KiB.
    pub(crate) fn parts(&mut self, entry: &'static str, picture: &GpuPicture) -> Result<Vec<[f32; 4]>> {
        let params = PlainParams { size: extent(picture.size()), values: [0; 2] };
        let parts = self.blank((GROUPS as usize, 1))?;
        let bound = [picture, picture, &parts].map(GpuPicture::binding);
        self.dispatch((&MEASURE, entry), bytes_of(&params), bound, [GROUPS, 1]);
        let [parts] = self.read([&parts])?;
        Ok(parts.pixels)
    }

    /// A picture of this size; each pixel is the mean of its area.
    pub(crate) fn shrink(&mut self, picture: &GpuPicture, size: (usize, usize)) -> Result<GpuPicture> {
        let params = PlainParams { size: extent(size), values: extent(picture.size()) };
        let shrink = (&MEASURE, "shrink");
        self.run(shrink, bytes_of(&params), picture, None, size)
    }
}
