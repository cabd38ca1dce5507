//! Turns at the computing device, first come, first served: a network in training, which asks again as soon as a
//! step is done, leaves room for a preview after each step.

use parking_lot::{FairMutex, const_fair_mutex};

/// Lock for computing on the one device of the process. A thread that holds it must not lock it again, nor may a
/// job of the thread pool lock it: the holder's own parallel loops may take up that job.
pub static DEVICE: FairMutex<()> = const_fair_mutex(());

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
    use std::time::Duration;

    #[test]
    fn a_greedy_thread_starves_no_other() {
        const MAX_STEPS: u32 = 1000;
        let device = const_fair_mutex(());
        let (steps, served) = (AtomicU32::new(0), AtomicBool::new(false));
        let waited = std::thread::scope(|scope| {
            scope.spawn(|| {
                while steps.load(Ordering::SeqCst) < MAX_STEPS && !served.load(Ordering::SeqCst) {
                    let _turn = device.lock();
                    std::thread::sleep(Duration::from_millis(1));
                    steps.fetch_add(1, Ordering::SeqCst);
                }
            });
            while steps.load(Ordering::SeqCst) == 0 {
                std::thread::yield_now();
            }
            let asked = steps.load(Ordering::SeqCst);
            let _turn = device.lock();
            served.store(true, Ordering::SeqCst);
            steps.load(Ordering::SeqCst) - asked
        });
        // One step while it asks and one while it waits; more only if the system suspends this thread. An unfair
        // lock goes to the greedy thread nearly every time.
        assert!(waited < MAX_STEPS / 4, "{waited} steps");
    }

    #[test]
    fn a_turn_ends_where_its_holder_panics() {
        let device = const_fair_mutex(());
        let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let _turn = device.lock();
            panic!("on purpose");
        }));
        assert!(panicked.is_err());
        assert!(device.try_lock().is_some());
    }
}
