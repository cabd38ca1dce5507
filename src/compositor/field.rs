//! A frame under every lamp, in memory or on the GPU, and its sum under the lamps' weights.

use super::passes::PicturePasses;
use super::relight::{lit_lamps, relight, relight_compressed, relight_half};
use crate::error::Result;
use crate::imaging::Image;
use crate::reflectance::{CompressedField, DeviceField, FieldBuffer, HalfField, ReflectanceField};
use std::sync::Arc;

/// Where the compositor finds the OLATs of a frame.
#[derive(Debug)]
pub enum Field {
    Memory(ReflectanceField),
    /// In half the memory, and in half the time that a sum of it takes.
    Half(HalfField),
    /// As few principal components over its lamps.
    Compressed(CompressedField),
    /// Where the network left them, and the passes that make pictures of them there.
    Gpu(FieldBuffer, Arc<PicturePasses>),
}

impl From<ReflectanceField> for Field {
    fn from(field: ReflectanceField) -> Self {
        Self::Memory(field)
    }
}

impl From<HalfField> for Field {
    fn from(field: HalfField) -> Self {
        Self::Half(field)
    }
}

impl From<CompressedField> for Field {
    fn from(field: CompressedField) -> Self {
        Self::Compressed(field)
    }
}

impl Field {
    /// The field in f16 where it is in memory as f32. A field on the GPU stays as it is.
    #[must_use]
    pub fn halved(self) -> Self {
        match self {
            Self::Memory(field) => Self::Half(HalfField::from(&field)),
            other => other,
        }
    }

    /// A prediction: where there are passes for the network's GPU it stays there, else it is copied to
    /// memory.
    ///
    /// # Errors
    /// When the device fails.
    pub fn predicted(field: DeviceField, passes: Option<&Arc<PicturePasses>>) -> Result<Self> {
        match passes {
            Some(passes) => Ok(Self::Gpu(field.into_buffer()?, passes.clone())),
            None => Ok(Self::Memory(field.read()?)),
        }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Self::Memory(field) => (field.width, field.height),
            Self::Half(field) => (field.width, field.height),
            Self::Compressed(field) => (field.width, field.height),
            Self::Gpu(field, _) => (field.width, field.height),
        }
    }

    /// Number of lamps.
    pub fn lamps(&self) -> usize {
        match self {
            Self::Memory(field) => field.lamps,
            Self::Half(field) => field.lamps,
            Self::Compressed(field) => field.lamps,
            Self::Gpu(field, _) => field.lamps,
        }
    }

    /// What the OLATs take of the memory that they are in.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Memory(field) => size_of_val(&field.values[..]),
            Self::Half(field) => size_of_val(field.values()),
            Self::Compressed(field) => field.bytes(),
            Self::Gpu(field, _) => field.lamps * 3 * field.width * field.height * size_of::<f32>(),
        }
    }

    /// The picture under lamps of these weights, linear: pass `relight`. From the GPU it is all that
    /// is copied.
    ///
    /// # Errors
    /// When the field does not fit the weights, or the device fails.
    pub fn relight(&self, weights: &[[f32; 3]]) -> Result<Image> {
        match self {
            Self::Memory(field) => Ok(relight(field, weights, &lit_lamps(weights))),
            Self::Half(field) => Ok(relight_half(field, weights, &lit_lamps(weights))),
            Self::Compressed(field) => Ok(relight_compressed(field, weights)),
            Self::Gpu(field, passes) => passes.relight.sum(field, weights),
        }
    }
}
