//! What pictures leave for the next one: the picture after each pass that costs, with the key that it was
//! made under.

use super::despill::Spill;
use crate::imaging::{Image, Mask};
use std::sync::Arc;

/// What is kept from one picture to the next. It belongs to one series of pictures, such as those of a
/// window, and holds at most five pictures and a matte.
#[derive(Clone, Debug, Default)]
pub struct Reuse {
    /// After `relight`, and how many pixels were mended.
    pub(super) relit: Kept<(Arc<Image>, usize)>,
    /// What is behind the subject, after `background_blur`.
    pub(super) behind: Kept<Arc<Image>>,
    /// After `light_wrap`, when the subject lies over its background.
    pub(super) laid: Kept<Arc<Image>>,
    /// After `glare`.
    pub(super) glared: Kept<Arc<Image>>,
    pub(super) rim: Kept<Arc<Mask>>,
    /// What despill goes by, and what it measured.
    pub(super) spill: Kept<(Arc<Image>, Spill)>,
    pub(super) wrap_need: Kept<f32>,
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
