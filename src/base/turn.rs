//! Turns at the device that computes. Whoever asks first is served first: a network in training, which
//! asks again as soon as it is done, leaves room for a preview after each step.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Turns at the one device that the process computes with.
pub static DEVICE: Turns = Turns::new();

/// Turns at one device.
#[derive(Debug)]
pub struct Turns {
    state: Mutex<State>,
    over: Condvar,
}

#[derive(Debug)]
struct State {
    /// Numbers given out.
    given: u64,
    /// The number whose turn it is.
    serving: u64,
}

/// A turn; it is over when this is dropped.
#[derive(Debug)]
pub struct Turn<'a>(&'a Turns);

impl Turns {
    const fn new() -> Self {
        Self {
            state: Mutex::new(State {
                given: 0,
                serving: 0,
            }),
            over: Condvar::new(),
        }
    }

    /// Waits for a turn. A thread that has one must not ask for another.
    pub fn take(&self) -> Turn<'_> {
        let mut state = self.state();
        let number = state.given;
        state.given += 1;
        while state.serving != number {
            state = self
                .over
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
        Turn(self)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Two numbers are whole at any time, even where a thread panicked with the lock in hand.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        self.0.state().serving += 1;
        self.0.over.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A thread that asks again at once is not served before one that asked while it worked.
    #[test]
    fn a_greedy_thread_starves_no_other() {
        let turns = Turns::new();
        let order = Mutex::new(Vec::new());
        let asked = |count| {
            while turns.state().given < count {
                std::thread::yield_now();
            }
        };
        std::thread::scope(|scope| {
            let first = turns.take();
            scope.spawn(|| {
                for _ in 0..3 {
                    let _turn = turns.take();
                    order.lock().unwrap().push("training");
                }
            });
            asked(2);
            scope.spawn(|| {
                let _turn = turns.take();
                order.lock().unwrap().push("preview");
            });
            asked(3);
            drop(first);
        });
        let order = order.into_inner().unwrap();
        assert_eq!(order, ["training", "preview", "training", "training"]);
    }

    #[test]
    fn a_turn_ends_where_its_holder_panics() {
        let turns = Turns::new();
        let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let _turn = turns.take();
            panic!("on purpose");
        }));
        assert!(panicked.is_err());
        drop(turns.take());
    }
}
