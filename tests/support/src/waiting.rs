//! Waiting for another thread.

use std::time::{Duration, Instant};

/// A test that waits this long has failed. Far longer than any real wait, even on a busy machine: it only ends endless
/// waits.
pub const PATIENCE: Duration = Duration::from_secs(600);

/// The first value that `get` returns.
///
/// # Panics
/// If there is none within [`PATIENCE`].
#[track_caller]
pub fn wait_for<T>(mut get: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(value) = get() {
            return value;
        }
        assert!(started.elapsed() < PATIENCE, "nothing arrived in time");
        std::thread::sleep(Duration::from_millis(1));
    }
}
