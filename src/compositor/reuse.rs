//! What pictures leave for the next one: the picture after each pass that costs, with the key that it was
//! made under.

use super::despill::Spill;
use super::grain::Grain;
use super::passes::GpuPicture;
use super::stage::{Rim, Uploads};
use imaging::Image;
use std::sync::Arc;

/// What is kept from one picture to the next, for each device that made one. It belongs to one series of
/// pictures, such as those of a window, and holds at most six pictures, a matte and a panorama.
#[derive(Clone, Debug, Default)]
pub struct Reuse {
    pub(super) memory: Slots<Arc<Image>, Rim>,
    pub(super) gpu: Slots<GpuPicture, Uploads>,
}

/// What one device keeps, in pictures of the kind `L`.
#[derive(Clone, Debug)]
pub(super) struct Slots<L, O> {
    /// After `relight`.
    pub relit: Kept<L>,
    /// What is behind the subject, after `background_blur`.
    pub behind: Kept<L>,
    /// After `light_wrap`, when the subject lies over its background.
    pub laid: Kept<L>,
    /// After `glare`.
    pub glared: Kept<L>,
    /// What despill goes by, and what it measured.
    pub spill: Kept<(L, Spill)>,
    pub wrap_need: Kept<f32>,
    /// The largest value before glare.
    pub brightest: Kept<f32>,
    /// The codes' own grain.
    pub grain: Kept<Grain>,
    /// What the device keeps for itself.
    pub own: O,
}

impl<L, O: Default> Default for Slots<L, O> {
    fn default() -> Self {
        Self {
            relit: Kept::default(),
            behind: Kept::default(),
            laid: Kept::default(),
            glared: Kept::default(),
            spill: Kept::default(),
            wrap_need: Kept::default(),
            brightest: Kept::default(),
            grain: Kept::default(),
            own: O::default(),
        }
    }
}

/// One thing and the key that it was made under.
#[derive(Clone, Debug)]
pub(super) struct Kept<T>(Option<(u64, T)>);

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T: Clone> Kept<T> {
    /// What was made under this key, if that is what is kept.
    pub fn get(&self, key: u64) -> Option<T> {
        let kept = self.0.as_ref().filter(|(of, _)| *of == key);
        kept.map(|(_, value)| value.clone())
    }

    /// Keeps this in place of what was kept.
    pub fn put(&mut self, key: u64, value: T) {
        self.0 = Some((key, value));
    }
}
