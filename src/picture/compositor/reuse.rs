//! Pictures kept for the next one: the picture after each pass that costs, with the key that it was made under.

use super::facts::{Grain, Spill};
use super::passes::{GpuMatte, GpuPicture};
use super::plate::GpuPlate;
use imaging::{Image, Mask};
use scene::Pass;
use std::sync::Arc;

/// Cache from one picture to the next, for each device that made one. It belongs to one series of pictures, such as
/// those of a window, and holds at most six pictures, a matte and a panorama.
#[derive(Clone, Debug, Default)]
pub struct Reuse {
    pub(super) memory: Cache<Arc<Image>, Rim>,
    pub(super) gpu: Cache<GpuPicture, Uploads>,
}

/// The rim of the last matte that was asked for.
pub(super) type Rim = Cached<Arc<Mask>>;

/// Pictures that were copied to the GPU, and made there, for a frame and for an environment.
#[derive(Clone, Debug, Default)]
pub(super) struct Uploads {
    pub matte: Cached<GpuMatte>,
    pub plate: Cached<GpuPlate>,
    pub rim: Cached<GpuPicture>,
    pub panorama: Cached<GpuPicture>,
}

/// The cache of one device, in pictures of the kind `L`.
#[derive(Clone, Debug)]
pub(super) struct Cache<L, O> {
    /// The picture after a pass: the subject, until it is laid over its background in `light_wrap`; after
    /// `background_blur` what is behind it.
    after: [Cached<L>; Pass::ALL.len()],
    /// The guide of despill, and the spill that it measured.
    pub spill: Cached<(L, Spill)>,
    pub wrap_need: Cached<f32>,
    /// The largest value before glare.
    pub brightest: Cached<f32>,
    /// The codes' own grain.
    pub grain: Cached<Grain>,
    /// The device's cache for itself.
    pub own: O,
}

impl<L, O> Cache<L, O> {
    /// The picture after a pass.
    pub fn after(&mut self, pass: Pass) -> &mut Cached<L> {
        &mut self.after[pass as usize]
    }
}

impl<L, O: Default> Default for Cache<L, O> {
    fn default() -> Self {
        Self {
            after: Default::default(),
            spill: Cached::default(),
            wrap_need: Cached::default(),
            brightest: Cached::default(),
            grain: Cached::default(),
            own: O::default(),
        }
    }
}

/// One thing and the key that it was made under.
#[derive(Clone, Debug)]
pub(super) struct Cached<T>(Option<(u64, T)>);

impl<T> Default for Cached<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T: Clone> Cached<T> {
    /// The value made under this key, if that one is cached.
    pub fn get(&self, key: u64) -> Option<T> {
        let cached = self.0.as_ref().filter(|(of, _)| *of == key);
        cached.map(|(_, value)| value.clone())
    }

    /// Caches this in place of what was cached.
    pub fn put(&mut self, key: u64, value: T) {
        self.0 = Some((key, value));
    }
}
