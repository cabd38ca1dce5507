//! Decoded frames of all movies within a memory budget. The least recently used go first.

use super::Pixels;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Maximum size of the decoded frames of a process, in bytes.
const MOST_BYTES: usize = 256 << 20;

/// A movie's number in this process, and a frame.
type Key = (u64, u64);

#[derive(Default)]
struct Cache {
    frames: HashMap<Key, (u64, Arc<Pixels>)>,
    bytes: usize,
    clock: u64,
}

static CACHE: Mutex<Option<Cache>> = Mutex::new(None);

fn with<T>(act: impl FnOnce(&mut Cache) -> T) -> T {
    let mut cache = CACHE.lock().unwrap_or_else(PoisonError::into_inner);
    act(cache.get_or_insert_with(Cache::default))
}

fn bytes(pixels: &Pixels) -> usize {
    2 * pixels.codes.len()
}

/// The frame, if it is cached.
pub(crate) fn get(key: Key) -> Option<Arc<Pixels>> {
    with(|cache| {
        cache.clock += 1;
        let (used, pixels) = cache.frames.get_mut(&key)?;
        *used = cache.clock;
        Some(pixels.clone())
    })
}

/// Stores a frame; others go if the budget is exceeded.
pub(crate) fn put(key: Key, pixels: Arc<Pixels>) {
    with(|cache| {
        cache.clock += 1;
        cache.bytes += bytes(&pixels);
        if let Some((_, old)) = cache.frames.insert(key, (cache.clock, pixels)) {
            cache.bytes -= bytes(&old);
        }
        while cache.bytes > MOST_BYTES && cache.frames.len() > 1 {
            let oldest = cache.frames.iter().min_by_key(|(_, (used, _))| *used).map(|(&key, _)| key);
            let gone = oldest.and_then(|key| cache.frames.remove(&key));
            cache.bytes -= gone.map_or(0, |(_, pixels)| bytes(&pixels));
        }
    });
}

/// Drops the frames of a movie.
pub(crate) fn forget(movie: u64) {
    with(|cache| {
        cache.frames.retain(|(cached, _), _| *cached != movie);
        cache.bytes = cache.frames.values().map(|(_, pixels)| bytes(pixels)).sum();
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_take_no_more_than_their_share_and_the_newest_stay() {
        // 48 MB each.
        let size = (2000, 4000);
        let frame = Arc::new(Pixels { size, has_alpha: false, codes: vec![0; 3 * size.0 * size.1] });
        let movie = u64::MAX;
        for number in 0..8 {
            put((movie, number), frame.clone());
            assert!(get((movie, 0)).is_some(), "a frame in use stays");
        }
        assert!(with(|cache| cache.bytes) <= MOST_BYTES);
        assert!(get((movie, 7)).is_some() && get((movie, 1)).is_none());
        forget(movie);
        assert!(get((movie, 7)).is_none());
    }
}
