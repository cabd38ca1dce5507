//! Idle threads that do not keep the processor awake.
//!
//! burn runs a GPU's work on its own threads. Without work they sleep, but poll every 150 µs, so that an idle window
//! would keep a processor awake. New work wakes them at once, so they may sleep longer. Only a thread
//! that has found another's queue full for some milliseconds sleeps without being woken, at most 20 ms too long.

/// Largest delay that the system may add to a sleep of these threads, in nanoseconds.
#[cfg(target_os = "linux")]
const SLACK_NS: std::ffi::c_ulong = 20_000_000;

/// Runs the code that starts the threads. They inherit this thread's timer slack.
pub fn starting<T>(start: impl FnOnce() -> T) -> T {
    let _kept = Slack::set();
    start()
}

/// This thread's own timer slack, restored at the end.
struct Slack {
    #[cfg(target_os = "linux")]
    before: Option<std::ffi::c_ulong>,
}

impl Slack {
    #[cfg(target_os = "linux")]
    fn set() -> Self {
        use nix::sys::prctl::{get_timerslack, set_timerslack};
        let before = get_timerslack().ok().and_then(|ns| ns.try_into().ok());
        // Where it cannot be set, they wake at their usual rate.
        let set = before.is_some() && set_timerslack(SLACK_NS).is_ok();
        Self { before: before.filter(|_| set) }
    }

    /// Other systems have no such setting per process.
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
