//! An environment: radiance from every direction as a lat-long panorama.

use crate::error::Result;
use crate::imaging::Image;
use std::path::Path;

/// A lat-long panorama of radiance, cleaned of values that are not light.
#[derive(Clone, Debug)]
pub struct Environment {
    /// What people call it: the file's stem.
    pub name: String,
    /// Radiance, finite and not negative, at any size.
    pub radiance: Image,
    /// Texels that were NaN, infinite or negative and have been repaired.
    pub repaired_texels: usize,
}
