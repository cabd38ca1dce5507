//! Reading and changing projects on the disk, beside the window: a disk may be slow, and another process may be writing.

use super::StudioApp;
use base::error::Result;
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use worker::background::catch_panic;

/// Action in the window after an errand is done.
type Then = Box<dyn FnOnce(&mut StudioApp) + Send>;

/// Errands that run, in the order in which they were asked for.
#[derive(Default)]
pub struct Errands(VecDeque<Receiver<Then>>);

impl Errands {
    /// Action after the first errand, once it is done.
    fn done(&mut self) -> Option<Then> {
        loop {
            match self.0.front()?.try_recv() {
                Ok(then) => {
                    self.0.pop_front();
                    return Some(then);
                }
                Err(TryRecvError::Empty) => return None,
                // Its thread could not be started: nothing follows.
                Err(TryRecvError::Disconnected) => drop(self.0.pop_front()),
            }
        }
    }
}

impl StudioApp {
    /// Calls `act` on a thread of its own, after the open project's list of environments has been written, and later
    /// `then` with what it made, here.
    pub(super) fn errand<T: Send + 'static>(
        &mut self,
        act: impl FnOnce() -> Result<T> + Send + 'static,
        then: impl FnOnce(&mut Self, Result<T>) + Send + 'static,
    ) {
        let (settled, wake) = (self.library.settled(), self.wake());
        let (send, done) = channel::<Then>();
        self.errands.0.push_back(done);
        std::thread::spawn(move || {
            // It fails if the writer is gone: then there is nothing to wait for.
            let _ = settled.map(|settled| settled.recv());
            let made = catch_panic(act);
            // Nobody listens once the window is closed.
            let _ = send.send(Box::new(move |app| then(app, made)));
            wake();
        });
    }

    /// The same for the open project: nothing follows once another is open.
    pub(super) fn errand_here<T: Send + 'static>(
        &mut self,
        act: impl FnOnce() -> Result<T> + Send + 'static,
        then: impl FnOnce(&mut Self, Result<T>) + Send + 'static,
    ) {
        let root = self.project().map(|project| project.root.clone());
        self.errand(act, move |app, made| {
            if app.project().map(|project| &project.root) == root.as_ref() {
                then(app, made);
            }
        });
    }

    /// Does what follows of errands that are done.
    pub(super) fn finish_errands(&mut self) {
        while let Some(then) = self.errands.done() {
            then(self);
        }
    }
}
