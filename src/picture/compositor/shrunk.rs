//! Reduced frames for quick pictures.

use super::field::Field;
use imaging::Mask;
use reflectance::HalfField;

impl Field {
    /// Field and matte at 1/`factor` of their width and height, by
    /// [`HalfField::shrunk`]. None for fields that are quick to light at full size: components, and fields on a GPU.
    pub fn shrunk(&self, mask: &Mask, factor: usize) -> Option<(Self, Mask)> {
        let (small, mask) = match self {
            Self::Memory(field) => HalfField::from(field).shrunk(mask, factor),
            Self::Half(field) => field.shrunk(mask, factor),
            Self::Compressed(_) | Self::Gpu(..) => return None,
        };
        Some((small.into(), mask))
    }
}
