//! Light finer than the working size, added when a plate is lit.

use super::passes::{GpuPicture, Recording, extent};
use super::plate::{FineLight, Plate, PlateParams, SHADER};
use base::error::Result;
use bytemuck::{Zeroable, bytes_of};
use imaging::{Image, Mask};
use rayon::prelude::*;
use std::sync::Arc;

impl Plate {
    /// The plate with light finer than the working size.
    #[must_use]
    pub fn with_fine_light(mut self, fine: Arc<dyn FineLight>) -> Self {
        self.fine = Some(fine);
        self
    }

    /// True if pictures get light finer than the working size.
    pub fn has_fine_light(&self) -> bool {
        self.fine.as_ref().is_some_and(|fine| fine.is_ready())
    }

    /// The subject under these lamp weights, where `relit` is their sum: [`Self::relit`] plus the plate's fine light.
    ///
    /// # Panics
    /// As [`Self::relit`].
    pub fn relit_by(&self, relit: &Image, working: &Mask, weights: &[[f32; 3]]) -> Image {
        let mut picture = self.relit(relit, working);
        if let Some(fine) = self.fine_light(weights) {
            let pixels = picture.pixels.par_iter_mut().zip(&fine.pixels).with_min_len(4096);
            pixels.for_each(|(pixel, fine)| (0..3).for_each(|c| pixel[c] += fine[c]));
        }
        picture
    }

    /// The light that [`Self::relit`] lacks under these lamp weights.
    pub(crate) fn fine_light(&self, weights: &[[f32; 3]]) -> Option<Image> {
        let mut ratio = self.fine.as_ref()?.ratio(weights)?;
        let pixels = ratio.pixels.par_iter_mut().zip(&self.lit().pixels).with_min_len(4096);
        pixels.for_each(|(ratio, lit)| (0..3).for_each(|c| ratio[c] *= lit[c]));
        Some(ratio)
    }
}

impl Recording<'_> {
    /// Adds light to a picture of the plate's size.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub(crate) fn add_light(&mut self, subject: &GpuPicture, light: &GpuPicture) -> Result<GpuPicture> {
        let size = subject.size();
        let mut params = PlateParams::zeroed();
        params.size = extent(size);
        self.run((&SHADER, "add"), bytes_of(&params), subject, Some(light), size)
    }
}
