//! A slot in which the newest value wins: how heavy things go from thread to thread without queues.

use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Mutex, PoisonError};

/// One value at most. Putting replaces what nobody took; nobody ever waits.
pub struct Latest<T> {
    slot: Mutex<Option<T>>,
    wake: Box<dyn Fn() + Send + Sync>,
}

impl<T> Latest<T> {
    /// An empty slot that calls `wake` after each [`Self::put`].
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            slot: Mutex::new(None),
            wake: Box::new(wake),
        }
    }

    /// Replaces the value and wakes whoever takes it.
    pub fn put(&self, value: T) {
        // A slot is whole at any time, even where a thread panicked with the lock in hand.
        *self.slot.lock().unwrap_or_else(PoisonError::into_inner) = Some(value);
        (self.wake)();
    }

    /// Whether a value waits to be taken.
    pub fn is_full(&self) -> bool {
        self.slot
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .is_some()
    }

    /// Takes the value out, if one was put since the last time.
    pub fn take(&self) -> Option<T> {
        self.slot
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
    }
}

/// A doorbell for a thread that waits for several slots: what rings it never waits, and many rings
/// while the thread works count as one. The receiver fails once every ringer is gone.
pub fn doorbell() -> (impl Fn() + Clone + Send + Sync + 'static, Receiver<()>) {
    let (ring, rung) = sync_channel(1);
    let ring = move || {
        // A full channel means that the thread will look anyway; a closed one that it is gone.
        let _ = ring.try_send(());
    };
    (ring, rung)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn the_newest_wins_and_is_taken_once() {
        let slot = Latest::new(|| {});
        assert_eq!(slot.take(), None);
        (0..5).for_each(|i| slot.put(i));
        assert_eq!(slot.take(), Some(4));
        assert_eq!(slot.take(), None);
    }

    #[test]
    fn a_thread_that_waits_for_two_slots_sees_the_last_of_each() {
        let (ring, rung) = doorbell();
        let numbers = Arc::new(Latest::new(ring.clone()));
        let words = Arc::new(Latest::new(ring));
        let (n, w) = (numbers.clone(), words.clone());
        let thread = std::thread::spawn(move || {
            let (mut number, mut word) = (0, "");
            while rung.recv().is_ok() {
                number = n.take().unwrap_or(number);
                word = w.take().unwrap_or(word);
                if (number, word) == (999, "end") {
                    break;
                }
            }
            (number, word)
        });
        words.put("end");
        (0..1000).for_each(|i| numbers.put(i));
        assert_eq!(thread.join().unwrap(), (999, "end"));
    }
}
