//! Waiting for another thread.

use std::time::{Duration, Instant};

/// A test that waits this long has failed. Far longer than anything takes, on a busy machine too: it ends what would
/// wait for ever, and measures nothing.
pub const PATIENCE: Duration = Duration::from_secs(600);

/// First value that `get` gives, as soon as it gives one.
///
/// # Panics
/// If it gives nothing within [`PATIENCE`].
#[track_caller]
pub fn wait_for<T>(mut get: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(value) = get() {
            return value;
        }
        assert!(started.elapsed() < PATIENCE, "it never came");
        std::thread::sleep(Duration::from_millis(1));
    }
}
