//! Threads that do not wake for nothing.
//!
//! burn runs what a GPU computes on threads of its own. Without work they sleep, but look around every 150 µs, so that a
//! window at rest would keep a processor awake. Work that comes wakes them at once: so they may sleep longer. Only a thread
//! that has found the queue of another full for some milliseconds sleeps without being woken, at most 20 ms too long.

/// Largest delay that the system may add to the end of a sleep of these threads, in nanoseconds.
#[cfg(target_os = "linux")]
const SLACK_NS: std::ffi::c_ulong = 20_000_000;

/// Does what starts the threads. They take over how exactly this thread is woken.
pub fn starting<T>(start: impl FnOnce() -> T) -> T {
    let _kept = Slack::set();
    start()
}

/// This thread's own exactness, set again at the end.
struct Slack {
    #[cfg(target_os = "linux")]
    before: Option<std::ffi::c_ulong>,
}

impl Slack {
    #[cfg(target_os = "linux")]
    fn set() -> Self {
        use nix::sys::prctl::{get_timerslack, set_timerslack};
        let before = get_timerslack().ok().and_then(|ns| ns.try_into().ok());
        // Where it cannot be set, they wake as often as they want.
        let set = before.is_some() && set_timerslack(SLACK_NS).is_ok();
        Self { before: before.filter(|_| set) }
    }

    /// Elsewhere a process cannot ask for this.
    #[cfg(not(target_os = "linux"))]
    fn set() -> Self {
        Self {}
    }
}

#[cfg(target_os = "linux")]
impl Drop for Slack {
    fn drop(&mut self) {
        if let Some(before) = self.before {
            // It could be set before.
            let _ = nix::sys::prctl::set_timerslack(before);
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use nix::sys::prctl::get_timerslack;

    #[test]
    fn threads_that_are_started_sleep_longer_and_this_one_does_not() {
        let before = get_timerslack().unwrap();
        let slack = || get_timerslack().unwrap();
        let started = starting(|| std::thread::spawn(slack).join().unwrap());
        assert_eq!(u64::try_from(started).unwrap(), SLACK_NS);
        assert_eq!(slack(), before);
    }
}
