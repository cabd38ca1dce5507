//! A slot in which the newest value wins: pictures reach the window through it, without a queue.

use parking_lot::Mutex;

/// At most one value. Putting replaces a value that was not taken, and never waits.
pub struct Latest<T> {
    slot: Mutex<Option<T>>,
    wake: Box<dyn Fn() + Send + Sync>,
}

impl<T> std::fmt::Debug for Latest<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Latest").finish_non_exhaustive()
    }
}

impl<T> Latest<T> {
    /// An empty slot that calls `wake` after each [`Self::put`].
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self { slot: Mutex::new(None), wake: Box::new(wake) }
    }

    /// Replaces the value and calls `wake`.
    pub fn put(&self, value: T) {
        *self.slot.lock() = Some(value);
        (self.wake)();
    }

    /// True if a value waits to be taken.
    pub fn is_full(&self) -> bool {
        self.slot.lock().is_some()
    }

    /// Takes the value, if one was put since the last time.
    pub fn take(&self) -> Option<T> {
        self.slot.lock().take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_wins_and_is_taken_once() {
        let slot = Latest::new(|| {});
        assert_eq!(slot.take(), None);
        (0..5).for_each(|i| slot.put(i));
        assert_eq!(slot.take(), Some(4));
        assert_eq!(slot.take(), None);
    }
}
