//! Cache of pictures after expensive passes, each with its key.

use super::facts::{Grain, Spill};
use super::passes::{GpuMatte, GpuPicture};
use super::plate::GpuPlate;
use imaging::{Image, Mask};
use scene::Pass;
use std::sync::Arc;

/// Cache across pictures, for each device that made one. It belongs to one series of pictures, such as
/// a window's, and holds at most six pictures, a matte and a panorama.
#[derive(Clone, Debug, Default)]
pub struct Reuse {
    pub(super) memory: Cache<Arc<Image>, Rim>,
    pub(super) gpu: Cache<GpuPicture, Uploads>,
}

/// Rim of the last matte.
pub(super) type Rim = Cached<Arc<Mask>>;

/// Pictures copied to or made on the GPU, for a frame and for an environment.
#[derive(Clone, Debug, Default)]
pub(super) struct Uploads {
    pub matte: Cached<GpuMatte>,
    pub plate: Cached<GpuPlate>,
    pub rim: Cached<GpuPicture>,
    pub panorama: Cached<GpuPicture>,
}

/// Cache of one device, for pictures of type `L`.
#[derive(Clone, Debug)]
pub(super) struct Cache<L, O> {
    /// Picture after a pass: the subject alone before `light_wrap`; the background after
    /// `background_blur`.
    after: [Cached<L>; Pass::ALL.len()],
    /// Guide of despill, and its measured spill.
    pub spill: Cached<(L, Spill)>,
    pub wrap_need: Cached<f32>,
    /// Largest value before glare.
    pub brightest: Cached<f32>,
    /// Grain of the codes.
    pub grain: Cached<Grain>,
    /// Device-specific cache.
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

/// A value and its key.
#[derive(Clone, Debug)]
pub(super) struct Cached<T>(Option<(u64, T)>);

impl<T> Default for Cached<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T: Clone> Cached<T> {
    /// The value cached under this key, if any.
    pub fn get(&self, key: u64) -> Option<T> {
        let cached = self.0.as_ref().filter(|(cached_key, _)| *cached_key == key);
        cached.map(|(_, value)| value.clone())
    }

    /// Caches this value in place of the old one.
    pub fn put(&mut self, key: u64, value: T) {
        self.0 = Some((key, value));
    }
}
