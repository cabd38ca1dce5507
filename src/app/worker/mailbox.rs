//! Waiting requests of a thread: the newest of each kind, or all of them in order.

use parking_lot::{Condvar, Mutex};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A request to a thread.
pub trait Request: Send + 'static {
    /// Lane of the request. Only the newest request of a lane waits; lower lanes are taken first. Requests
    /// without a lane all wait, in order, behind the others.
    fn lane(&self) -> Option<usize> {
        Some(0)
    }

    /// True if the request is handled even when the thread is stopping, because it would be lost otherwise.
    fn is_kept(&self) -> bool {
        false
    }
}

/// Requests to one thread. Putting one in never waits.
pub(super) struct Mailbox<R> {
    waiting: Mutex<Waiting<R>>,
    changed: Condvar,
    /// Set by a test: the next request panics.
    #[cfg(test)]
    fault: std::sync::atomic::AtomicBool,
}

struct Waiting<R> {
    /// In the order in which they are taken.
    requests: VecDeque<R>,
    closed: bool,
}

impl<R: Request> Mailbox<R> {
    /// Creates an empty mailbox.
    pub fn new() -> Arc<Self> {
        Arc::new(Self {
            waiting: Mutex::new(Waiting { requests: VecDeque::new(), closed: false }),
            changed: Condvar::new(),
            #[cfg(test)]
            fault: Default::default(),
        })
    }

    /// Queues a request; replaces an older one in its lane. A closed mailbox drops it.
    pub fn put(&self, request: R) {
        let rank = |request: &R| request.lane().unwrap_or(usize::MAX);
        let lane = request.lane();
        let mut waiting = self.waiting.lock();
        if waiting.closed {
            return;
        }
        let requests = &mut waiting.requests;
        if lane.is_some() {
            requests.retain(|older| older.lane() != lane);
        }
        let behind = |other: &R| rank(other) > rank(&request);
        let at = requests.iter().position(behind).unwrap_or(requests.len());
        requests.insert(at, request);
        drop(waiting);
        self.changed.notify_one();
    }

    /// Takes the next request, if one waits.
    #[cfg(test)]
    pub fn take(&self) -> Option<R> {
        self.waiting.lock().requests.pop_front()
    }

    /// True if a matching request waits.
    #[cfg(test)]
    pub fn waits(&self, is_it: impl Fn(&R) -> bool) -> bool {
        self.waiting.lock().requests.iter().any(is_it)
    }

    /// Waits for the next request. If none comes within the time in `rest`, returns the request in `rest`. None
    /// once the mailbox is closed and empty.
    pub fn next(&self, rest: Option<(Duration, R)>) -> Option<R> {
        // A time too long to represent means no limit.
        let until = rest.as_ref().and_then(|(wait, _)| Instant::now().checked_add(*wait));
        let mut waiting = self.waiting.lock();
        loop {
            if let Some(request) = waiting.requests.pop_front() {
                return Some(request);
            }
            if waiting.closed {
                return None;
            }
            match until {
                None => self.changed.wait(&mut waiting),
                Some(until) if Instant::now() >= until => return rest.map(|(_, request)| request),
                Some(until) => {
                    self.changed.wait_until(&mut waiting, until);
                }
            }
        }
    }

    /// Closes the mailbox and drops waiting requests, except those that are kept.
    pub fn close(&self) {
        let mut waiting = self.waiting.lock();
        waiting.closed = true;
        waiting.requests.retain(R::is_kept);
        drop(waiting);
        self.changed.notify_one();
    }

    /// Makes the thread panic at its next request, before handling it.
    #[cfg(test)]
    pub fn panic_next(&self) {
        self.fault.store(true, std::sync::atomic::Ordering::SeqCst);
    }

    #[cfg(test)]
    pub fn panic_if_asked(&self) {
        if self.fault.swap(false, std::sync::atomic::Ordering::SeqCst) {
            panic!("on purpose");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Test lanes: the tens digit; 100 and more have no lane. 11 is kept.
    impl Request for u32 {
        fn lane(&self) -> Option<usize> {
            (*self < 100).then_some(*self as usize / 10)
        }

        fn is_kept(&self) -> bool {
            *self == 11
        }
    }

    fn all(mailbox: &Mailbox<u32>) -> Vec<u32> {
        std::iter::from_fn(|| mailbox.take()).collect()
    }

    #[test]
    fn the_newest_of_each_lane_waits_and_lower_lanes_come_first() {
        let mailbox = Mailbox::<u32>::new();
        [21, 11, 100, 22, 101, 1, 23, 12].into_iter().for_each(|request| mailbox.put(request));
        assert_eq!(all(&mailbox), [1, 12, 23, 100, 101]);
    }

    #[test]
    fn a_closed_mailbox_has_what_is_kept_and_then_ends() {
        let mailbox = Mailbox::<u32>::new();
        [1, 11, 100].into_iter().for_each(|r| mailbox.put(r));
        mailbox.close();
        mailbox.put(2);
        assert_eq!(mailbox.next(None), Some(11));
        assert_eq!(mailbox.next(Some((Duration::ZERO, 7))), None);
    }

    #[test]
    fn without_a_request_there_is_that_of_rest() {
        let mailbox = Mailbox::<u32>::new();
        let rest = || Some((Duration::from_millis(1), 7));
        assert_eq!(mailbox.next(rest()), Some(7));
        mailbox.put(5);
        assert_eq!(mailbox.next(rest()), Some(5));
    }

    #[test]
    fn a_thread_that_waits_sees_the_last_of_many() {
        let mailbox = Mailbox::<u32>::new();
        let inbox = mailbox.clone();
        let thread = std::thread::spawn(move || {
            let mut seen = Vec::new();
            while let Some(request) = inbox.next(None) {
                seen.push(request);
            }
            seen
        });
        (0..1000).for_each(|i| mailbox.put(i % 10));
        mailbox.put(100);
        while !mailbox.waiting.lock().requests.is_empty() {
            std::thread::yield_now();
        }
        mailbox.close();
        let seen = thread.join().unwrap();
        assert_eq!(seen[seen.len() - 2..], [9, 100]);
    }
}
