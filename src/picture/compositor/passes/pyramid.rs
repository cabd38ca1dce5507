//! Halving and doubling on the GPU, the base of wide blurs. The twins on the CPU are in [`crate::pyramid`].

use super::pictures::{GpuPicture, extent};
use super::recording::Recording;
use super::shader::Shader;
use base::error::Result;
use bytemuck::{Pod, Zeroable, bytes_of};

pub(crate) const PYRAMID: Shader = Shader::new("pyramid", include_str!("../../../../shaders/pyramid.wgsl"));

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct PyramidParams {
    size: [u32; 2],
    from_size: [u32; 2],
    odd_end: f32,
    keep: f32,
    unused: [f32; 2],
}

impl Recording<'_> {
    /// Half the size, rounded up; the last column and row of an odd picture times `odd_end`.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub(crate) fn halve(&mut self, fine: &GpuPicture, odd_end: f32) -> Result<GpuPicture> {
        let size = (fine.width.div_ceil(2), fine.height.div_ceil(2));
        let params =
            PyramidParams { size: extent(size), from_size: extent(fine.size()), odd_end, keep: 0.0, unused: [0.0; 2] };
        let halve = (&PYRAMID, "halve");
        self.run(halve, bytes_of(&params), fine, None, size)
    }

    /// `keep` · `fine` plus `coarse`, which has its halved size, doubled; the last column and row of `coarse` times
    /// `odd_end` if `fine` is odd.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub(crate) fn double_onto(
        &mut self,
        coarse: &GpuPicture,
        fine: &GpuPicture,
        keep: f32,
        odd_end: f32,
    ) -> Result<GpuPicture> {
        let params = PyramidParams {
            size: extent(fine.size()),
            from_size: extent(coarse.size()),
            odd_end,
            keep,
            unused: [0.0; 2],
        };
        let double = (&PYRAMID, "double");
        self.run(double, bytes_of(&params), coarse, Some(fine), fine.size())
    }
}
