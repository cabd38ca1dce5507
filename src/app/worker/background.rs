//! The one kind of thread behind the window. It handles the requests in its mailbox one after the other and
//! delivers each result. A panic is an error like any other: it ends the request, not the thread, and reaches the
//! window as a sentence.

use super::mailbox::Mailbox;
pub use super::mailbox::Request;
use base::error::{Error, Result};
use base::progress::Control;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// Handler of a thread's requests.
pub trait Handler {
    /// Input of the thread.
    type Request: Request;
    /// Output for a request.
    type Answer;

    /// Handles one request.
    ///
    /// # Errors
    /// When the request fails, in words for the window.
    fn work(&mut self, request: &mut Self::Request) -> Result<Self::Answer>;

    /// Delivers the result of a request. A panic in [`Self::work`] arrives here as an error.
    fn deliver(&mut self, request: Self::Request, answer: Result<Self::Answer>);

    /// Idle request: made by the thread to itself when no other comes within this time.
    fn rest(&self) -> Option<(Duration, Self::Request)> {
        None
    }
}

/// A running thread. Dropping it stops and joins it, after the current request.
pub struct Background<R: Request> {
    mailbox: Arc<Mailbox<R>>,
    stop: Control,
    thread: Option<JoinHandle<()>>,
}

impl<R: Request> Background<R> {
    /// Starts a thread that handles the requests in `mailbox`. `make` is called on that thread; long requests
    /// poll `stop`.
    pub(super) fn start<H: Handler<Request = R>>(
        name: &str,
        mailbox: Arc<Mailbox<R>>,
        stop: Control,
        make: impl FnOnce() -> H + Send + 'static,
    ) -> Self {
        let inbox = mailbox.clone();
        let run = move || {
            let mut handler = make();
            while let Some(mut request) = inbox.next(handler.rest()) {
                let answer = catch_panic(|| {
                    #[cfg(test)]
                    inbox.panic_if_asked();
                    handler.work(&mut request)
                });
                handler.deliver(request, answer);
            }
        };
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(run);
        Self { mailbox, stop, thread: Some(thread.expect("the system starts threads")) }
    }

    /// True if a matching request waits.
    #[cfg(test)]
    pub fn waits(&self, is_it: impl Fn(&R) -> bool) -> bool {
        self.mailbox.waits(is_it)
    }

    /// Starts a thread with its own mailbox. `make` is called on that thread, with the control that long requests
    /// poll to know when to stop. `name` is for debuggers.
    pub fn spawn<H: Handler<Request = R>>(name: &str, make: impl FnOnce(Control) -> H + Send + 'static) -> Self {
        let stop = Control::default();
        let own = stop.clone();
        Self::start(name, Mailbox::new(), stop, move || make(own))
    }

    /// Makes dropping return at once, without waiting for the current request.
    #[must_use]
    pub fn detached(mut self) -> Self {
        self.thread = None;
        self
    }

    /// Queues a request; never waits.
    pub fn put(&self, request: R) {
        self.mailbox.put(request);
    }

    /// Stops the thread after the current request.
    pub fn stop(&self) {
        self.stop.stop();
        self.mailbox.close();
    }

    /// Makes the thread panic at its next request.
    #[cfg(test)]
    pub(super) fn panic_next(&self) {
        self.mailbox.panic_next();
    }
}

impl<R: Request> Drop for Background<R> {
    fn drop(&mut self) {
        self.stop();
        if let Some(thread) = self.thread.take() {
            // The panic message already went to stderr; there is nothing left to stop.
            let _ = thread.join();
        }
    }
}

/// Drops a value on another thread. For values whose end takes time, such as a busy [`Background`].
pub fn drop_later(value: impl Send + 'static) {
    std::thread::spawn(move || drop(value));
}

/// Runs an action once and turns a panic into an error: [`Error::GpuLost`] if the GPU is gone, [`Error::Bug`]
/// otherwise.
///
/// # Errors
/// Those of `act`, and its panic.
pub fn catch_panic<T>(act: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(act)).unwrap_or_else(|panic| {
        if gpu::is_lost() {
            return Err(Error::GpuLost);
        }
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        Err(Error::bug(text.unwrap_or_else(|| "a panic".to_owned())))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, Sender, channel};

    struct By(u32);

    impl Request for By {
        fn lane(&self) -> Option<usize> {
            None
        }

        fn is_kept(&self) -> bool {
            self.0 == 3
        }
    }

    type Answers = (u32, Result<u32>);

    /// Divides 12 by each request.
    struct Divider {
        answers: Sender<Answers>,
        rests: u32,
    }

    impl Handler for Divider {
        type Request = By;
        type Answer = u32;

        fn work(&mut self, by: &mut By) -> Result<u32> {
            Ok(12 / by.0)
        }

        fn deliver(&mut self, by: By, answer: Result<u32>) {
            self.rests = self.rests.saturating_sub(1);
            self.answers.send((by.0, answer)).unwrap();
        }

        fn rest(&self) -> Option<(Duration, By)> {
            (self.rests > 0).then_some((Duration::ZERO, By(12)))
        }
    }

    fn divider(rests: u32) -> (Background<By>, Receiver<Answers>) {
        let (answers, answered) = channel();
        let make = move |_| Divider { answers, rests };
        (Background::spawn("divider", make), answered)
    }

    #[test]
    fn a_panic_is_a_sentence_and_the_thread_goes_on() {
        let (divider, answered) = divider(0);
        [0, 4].into_iter().for_each(|by| divider.put(By(by)));
        let (request, answer) = answered.recv().unwrap();
        let sentence = answer.unwrap_err().to_string();
        assert!(request == 0 && sentence.contains("divide by zero"), "{sentence}");
        assert!(sentence.contains("bug in Afterlight"), "{sentence}");
        assert_eq!(answered.recv().unwrap().1.unwrap(), 3);
    }

    #[test]
    fn what_is_kept_is_done_before_a_dropped_thread_ends() {
        let (divider, answered) = divider(0);
        divider.stop();
        divider.put(By(6));
        drop(divider);
        assert_eq!(answered.iter().count(), 0);
        let (answers, answered) = channel();
        let mailbox = Mailbox::new();
        [1, 3, 2].into_iter().for_each(|by| mailbox.put(By(by)));
        mailbox.close();
        let make = move || Divider { answers, rests: 0 };
        drop(Background::start("divider", mailbox, Control::default(), make));
        let done: Vec<u32> = answered.iter().map(|(request, _)| request).collect();
        assert_eq!(done, [3]);
    }

    #[test]
    fn a_thread_at_rest_does_what_it_asks_of_itself() {
        let (divider, answered) = divider(2);
        for _ in 0..2 {
            assert_eq!(answered.recv().unwrap().0, 12);
        }
        divider.put(By(2));
        assert_eq!(answered.recv().unwrap().0, 2);
    }
}
