//! A frame with fewer pixels, for pictures that have to be there soon.

use super::field::Field;
use imaging::Mask;
use reflectance::HalfField;

impl Field {
    /// The field, and the matte that it is under, at a `factor`-th of their width and height, as
    /// [`HalfField::shrunk`] has it. None for what is quick to light as it is: components, and a field on a GPU.
    pub fn shrunk(&self, mask: &Mask, factor: usize) -> Option<(Self, Mask)> {
        let (small, mask) = match self {
            Self::Memory(field) => HalfField::from(field).shrunk(mask, factor),
            Self::Half(field) => field.shrunk(mask, factor),
            Self::Compressed(_) | Self::Gpu(..) => return None,
        };
        Some((small.into(), mask))
    }
}
