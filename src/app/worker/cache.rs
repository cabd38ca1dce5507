//! Reflectance fields in memory, within a budget. The least recently used goes first.

use super::prediction::PredictedFrame;
use std::collections::VecDeque;
use std::sync::Arc;

/// The fields of some frames.
pub struct FieldCache {
    budget_bytes: usize,
    /// The most recently used at the back.
    frames: VecDeque<Arc<PredictedFrame>>,
}

impl FieldCache {
    /// Creates a cache of at most `budget_bytes`. It always keeps one field, even a larger one.
    pub fn new(budget_bytes: usize) -> Self {
        Self { budget_bytes, frames: VecDeque::new() }
    }

    /// Removes all fields.
    pub fn clear(&mut self) {
        self.frames.clear();
    }

    /// Returns the field of frame `index` and marks it as used.
    pub fn get(&mut self, index: usize) -> Option<Arc<PredictedFrame>> {
        let place = self.frames.iter().position(|p| p.frame.index == index)?;
        let found = self.frames.remove(place)?;
        self.frames.push_back(found.clone());
        Some(found)
    }

    /// Returns the frame nearest to `index`, the earlier of two. Does not mark it as used.
    pub fn nearest(&self, index: usize) -> Option<Arc<PredictedFrame>> {
        let far = |p: &&Arc<PredictedFrame>| (p.frame.index.abs_diff(index), p.frame.index);
        self.frames.iter().min_by_key(far).cloned()
    }

    /// Stores a field; an older one of the same frame is replaced.
    pub fn insert(&mut self, predicted: Arc<PredictedFrame>) {
        self.frames.retain(|p| p.frame.index != predicted.frame.index);
        self.frames.push_back(predicted);
        let mut held: usize = self.frames.iter().map(|p| bytes(p)).sum();
        while held > self.budget_bytes && self.frames.len() > 1 {
            held -= self.frames.pop_front().map_or(0, |p| bytes(&p));
        }
    }

    /// Numbers of the cached frames, in no particular order.
    pub fn indices(&self) -> impl Iterator<Item = usize> {
        self.frames.iter().map(|p| p.frame.index)
    }
}

/// Size of a field and its frame in bytes: three channels per lamp, the plate and the matte, at both sizes.
fn bytes(predicted: &PredictedFrame) -> usize {
    let plate = predicted.plate.as_ref().map_or(0, |plate| plate.bytes());
    plate + predicted.field.bytes() + 4 * size_of::<f32>() * predicted.frame.mask.pixels.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use compositor::Field;
    use footage::Frame;
    use imaging::{Image, Mask};
    use reflectance::ReflectanceField;

    /// 40 bytes: one pixel under two lamps, its plate and its matte, ten values of four bytes.
    fn predicted(index: usize) -> Arc<PredictedFrame> {
        Arc::new(PredictedFrame {
            frame: Arc::new(Frame { index, plate: Image::filled(1, 1, [0.0; 3]), mask: Mask::filled(1, 1, 1.0) }),
            plate: None,
            field: Arc::new(Field::Memory(ReflectanceField { width: 1, height: 1, lamps: 2, values: vec![0.0; 6] })),
            generation: 1,
            ms: 1.0,
        })
    }

    fn indices(cache: &FieldCache) -> Vec<usize> {
        cache.indices().collect()
    }

    #[test]
    fn what_was_used_longest_ago_goes_first() {
        let mut cache = FieldCache::new(3 * 40);
        (0..3).for_each(|i| cache.insert(predicted(i)));
        assert!(cache.get(0).is_some());
        cache.insert(predicted(3));
        assert_eq!(indices(&cache), [2, 0, 3]);
        assert!(cache.get(1).is_none());
    }

    #[test]
    fn a_frame_is_kept_once_and_one_frame_is_always_kept() {
        let mut cache = FieldCache::new(0);
        cache.insert(predicted(7));
        cache.insert(predicted(7));
        assert_eq!(indices(&cache), [7]);
        cache.insert(predicted(8));
        assert_eq!(indices(&cache), [8]);
    }
}
